//! The grid of designs: every combination of the quantities on the command line.

use std::path::Path;

use hzn_core::Config;
use hzn_core::body::Kind;
use hzn_core::camera::{self, Model};
use hzn_core::edge_noise;
use hzn_sim::sensitivity::{Design, SensorPlace, Sigmas};

use super::args::{Args, Lens, Size, What};
use super::body::{Body, doubt_altitudes};
use super::noise::{EdgeNoise, noise_of};
use crate::exit::{Stop, usage};

/// One quantity with its values.
pub(super) struct Axis {
    /// Name of its column.
    pub(super) column: &'static str,
    /// Name of the quantity in the plot.
    pub(super) label: &'static str,
    pub(super) values: Vec<f64>,
}

/// The grid of all designs: one design for each combination of the axes' values.
pub(super) struct Grid<'a> {
    args: &'a Args,
    /// For each body a sensor that looks for it, with its noise; empty without `--sensor`.
    sensors: Vec<(Config, EdgeNoise)>,
    bodies: Vec<Body>,
    pub(super) axes: Vec<Axis>,
}

impl<'a> Grid<'a> {
    pub(super) fn new(args: &'a Args) -> Result<Self, Stop> {
        let sensor = args.sensor.as_deref().map(|path| load(path, !args.body.is_empty())).transpose()?;
        let body = sensor.as_ref().map(|s| &s.body);
        let bodies = match (args.body.is_empty(), body) {
            (true, Some(body)) => vec![Body::from_config(body)],
            _ => args.bodies()?,
        };
        if let Some(px) = args.sigma_px.filter(|px| !(*px > 0.0)) {
            return Err(usage(format!("--sigma-px: {px} is refused: must be above 0")));
        }
        let mut sensors = Vec::new();
        if let (Some(sensor), Some(path)) = (&sensor, &args.sensor) {
            for body in &bodies {
                let one = looking_for(sensor, body);
                let noise = EdgeNoise::of_sensor(path, &one, args.sigma_px)?;
                sensors.push((one, noise));
            }
        }
        let altitude = match (&args.altitude, body.and_then(|b| b.altitude_km)) {
            (Some(values), _) => values.0.clone(),
            (None, Some(km)) => vec![km],
            (None, None) => return Err(usage("--altitude: missing; give it in kilometres, such as --altitude 200")),
        };
        doubt_altitudes(&bodies, &altitude);
        let mut axes = Vec::new();
        let mut axis = |column, label, values: &[f64]| axes.push(Axis { column, label, values: values.to_vec() });
        if sensor.is_none() {
            axis("fov_deg", "field of view [deg]", &args.fov.0);
        }
        axis("altitude_km", "altitude [km]", &altitude);
        if let Some(rows) = &args.rows {
            axis("rows_px", "rows [px]", &rows.0);
        }
        if let Some(heights) = &args.limb_height {
            axis("limb_height_km", "limb height [km]", &heights.0);
        }
        if args.what == What::Yaw || sensor.is_some() {
            axis("latitude_deg", "latitude [deg]", &args.latitude.0);
        }
        if args.what == What::Yaw {
            axis("azimuth_deg", "azimuth of the view [deg]", &args.azimuth.0);
        }
        if args.what == What::Rig {
            if let Some(between) = &args.between {
                axis("between_deg", "angle between heads [deg]", &between.0);
            }
            axis("mount_sigma_deg", "sigma of a mount [deg]", &args.mount_sigma.0);
            // The lines of a plot are the numbers of heads, so another quantity comes first.
            axis("heads", "heads", &args.heads.0);
        }
        axis("depression_deg", "depression [deg]", &args.depression.0);
        axis("roll_deg", "roll of the camera [deg]", &args.roll.0);
        let radii: Vec<f64> = bodies.iter().map(|b| b.radius_km).collect();
        axis("radius_km", "radius [km]", &radii);
        Ok(Self { args, sensors, bodies, axes })
    }

    pub(super) fn value(&self, place: &[f64], column: &str) -> Option<f64> {
        self.axes.iter().zip(place).find(|(a, _)| a.column == column).map(|(_, v)| *v)
    }

    fn body_number(&self, place: &[f64]) -> usize {
        let radius_km = self.value(place, "radius_km");
        self.bodies.iter().position(|b| Some(b.radius_km) == radius_km).unwrap_or(0)
    }

    /// Returns the body of a place in the grid.
    pub(super) fn body(&self, place: &[f64]) -> Body {
        self.bodies.get(self.body_number(place)).copied().unwrap_or_else(Body::earth)
    }

    /// Returns the edge noise of each sensor and where it comes from, in words; or without a sensor the errors that are
    /// assumed.
    pub(super) fn notes(&self) -> Vec<String> {
        let note = |(one, noise): &(Config, EdgeNoise)| {
            let model = noise_of(one).noise.name();
            format!(
                "edge noise of {}: {:.3} px, {} (noise = {model:?})",
                one.body.kind.name(),
                noise.rms_px,
                noise.source
            )
        };
        self.sensors.iter().map(note).chain(self.describe_assumed()).collect()
    }

    /// Describes the errors of a design without a sensor.toml, which are those of no camera in particular; `None` if
    /// the command line states all of them.
    fn describe_assumed(&self) -> Option<String> {
        let args = self.args;
        let is_told = [args.sigma_px, args.correlation_px, args.limb_height_sigma, args.altitude_sigma];
        if !self.sensors.is_empty() || is_told.iter().all(Option::is_some) {
            return None;
        }
        let design = self.design(combinations(&self.axes).first()?).ok()?;
        let sensor = match args.what {
            What::Rig => "",
            _ => "-s sensor.toml takes those of a camera (hzn init writes a first one, hzn calibrate measures it); ",
        };
        Some(format!(
            "these errors are assumed, and are those of no camera in particular: edge points {:.2} px, correlated over \
             {:.0} px along the edge; limb height {} +- {} km; altitude +- {} km. {sensor}--sigma-px, \
             --correlation-px, --limb-height-sigma and --altitude-sigma state them",
            design.sigma_px,
            design.correlation_px,
            design.limb_height_km,
            design.limb_height_sigma_km,
            design.altitude_sigma_km
        ))
    }

    /// Returns the sigmas of a place in the grid; `None` if too little limb is in view.
    pub(super) fn sigmas(&self, place: &[f64], design: &Design) -> Result<Option<Sigmas>, Stop> {
        let Some((one, noise)) = self.sensors.get(self.body_number(place)) else {
            return design.sigmas().map_err(usage);
        };
        let mut sensor = one.clone();
        sensor.body.tell_limb_height(design.limb_height_km, design.limb_height_sigma_km);
        sensor.body.altitude_sigma_km = design.altitude_sigma_km;
        let place = SensorPlace {
            sensor,
            altitude_km: design.altitude_km,
            latitude_deg: self.value(place, "latitude_deg").unwrap_or(0.0),
            depression_deg: design.depression_deg,
            roll_deg: design.roll_deg,
            rms_px: noise.rms_px,
            correlation_px: self.args.correlation_px,
        };
        place.sigmas().map_err(usage)
    }

    pub(super) fn design(&self, place: &[f64]) -> Result<Design, Stop> {
        let args = self.args;
        let value = |column: &str| self.value(place, column);
        let sensor = self.sensors.get(self.body_number(place));
        let camera = match sensor {
            Some((sensor, _)) => sensor.camera.clone(),
            None => lens(args.lens, args.size, value("fov_deg").unwrap_or(f64::NAN), value("rows_px"))?,
        };
        let body = self.body(place);
        let own = sensor.map(|(s, _)| &s.body);
        let positive = |name: &str, x: f64| match x >= 0.0 && x.is_finite() {
            true => Ok(x),
            false => Err(usage(format!("--{name}: {x} is refused: must be 0 or more"))),
        };
        let limb_height = own.map_or(body.limb_height_km, |b| b.limb_height_km);
        let own_sigma = own.map_or(body.limb_height_sigma_km, |b| b.limb_height_sigma_km);
        let altitude_sigma = args.altitude_sigma.or(own.map(|b| b.altitude_sigma_km)).unwrap_or(0.5);
        let noise = |limb_px: f64| sensor.map(|(s, noise)| noise_of(s).measured(noise.rms_px, limb_px));
        let part = part_in_wide_pixels(&camera);
        let mut design = Design {
            camera,
            radius_km: body.radius_km,
            altitude_km: value("altitude_km").unwrap_or(f64::NAN),
            altitude_sigma_km: positive("altitude-sigma", altitude_sigma)?,
            limb_height_km: value("limb_height_km").unwrap_or(limb_height),
            limb_height_sigma_km: positive("limb-height-sigma", args.limb_height_sigma.unwrap_or(own_sigma))?,
            depression_deg: value("depression_deg").unwrap_or(0.0),
            roll_deg: value("roll_deg").unwrap_or(0.0),
            sigma_px: noise(0.0).map_or(args.sigma_px.unwrap_or(SIGMA_PX * part), |n| n.sigma_px),
            correlation_px: positive("correlation-px", args.correlation_px.unwrap_or(CORRELATION_PX * part))?,
        };
        if args.correlation_px.is_none() && sensor.is_some() {
            // The correlation length depends on the length of the edge.
            let limb_px = design.sigmas().map_err(usage)?.map_or(0.0, |s| s.limb_px);
            design.correlation_px = noise(limb_px).map_or(design.correlation_px, |n| n.correlation_px);
        }
        Ok(design)
    }
}

/// Returns the part of the default errors that a camera with wide pixels has: there they keep their angle, as the
/// default errors of a sensor do.
fn part_in_wide_pixels(camera: &camera::Config) -> f64 {
    let here = edge_noise::Config::for_focal_length(0.5 * (camera.fx_px + camera.fy_px));
    here.correlation_px / edge_noise::Config::default().correlation_px
}

/// Sigma of an edge point if nothing gives one, in pixels.
const SIGMA_PX: f64 = 1.0;

/// Correlation length of the edge if nothing gives one, in pixels: that of the visible pictures of Braun & Barf 2022,
/// which are 1920 px wide.
pub(super) const CORRELATION_PX: f64 = 300.0;

/// Reads a sensor.toml. A sensor that looks for several bodies is refused unless the command line names one.
fn load(path: &Path, is_body_named: bool) -> Result<Config, Stop> {
    let mut config = hzn_files::sensor::load(path)?.config;
    match config.bodies.as_slice() {
        [] => {}
        [one] => config.body = one.clone(),
        _ if is_body_named => {}
        several => {
            let names: Vec<&str> = several.iter().map(|b| b.kind.name()).collect();
            let what = format!("looks for several bodies ({}); name one with --body", names.join(", "));
            return Err(usage(format!("{}: {what}", path.display())));
        }
    }
    Ok(config)
}

/// Returns the sensor that looks only for this body. What it knows of another body does not count.
fn looking_for(sensor: &Config, body: &Body) -> Config {
    let own = sensor.each_body().iter().find(|own| Body::from_config(own).radius_km == body.radius_km).cloned();
    let other = || hzn_core::body::Config {
        radius_km: Some(body.radius_km),
        limb_height_km: body.limb_height_km,
        limb_height_sigma_km: body.limb_height_sigma_km,
        altitude_sigma_km: sensor.body.altitude_sigma_km,
        ..hzn_core::body::Config::of_kind(Kind::Sphere, None)
    };
    Config { body: own.unwrap_or_else(other), bodies: Default::default(), ..sensor.clone() }
}

/// Returns a camera with this lens and this field of view across the width, in degrees.
fn lens(lens: Lens, size: Size, fov_deg: f64, rows: Option<f64>) -> Result<camera::Config, Stop> {
    let (width, height) = match rows {
        None => (size.width, size.height),
        Some(rows) => {
            let width = (rows * f64::from(size.width) / f64::from(size.height)).round();
            if !(rows >= 2.0 && rows.fract() == 0.0 && width >= 2.0 && width.max(rows) <= 65535.0) {
                return Err(usage(format!(
                    "--rows: {rows} is refused: must be a whole number of pixels from 2 to 65535"
                )));
            }
            (width as u16, rows as u16)
        }
    };
    let (model, max_deg) = match lens {
        Lens::Pinhole => (Model::Pinhole, 175.0),
        Lens::Equidistant => (Model::Equidistant, 350.0),
    };
    if !(fov_deg > 0.0 && fov_deg <= max_deg) {
        let hint = if lens == Lens::Pinhole { "; --lens equidistant goes to 350" } else { "" };
        return Err(usage(format!(
            "--fov: {fov_deg} is refused: must be above 0 and up to {max_deg} for this lens{hint}"
        )));
    }
    let half = (fov_deg / 2.0).to_radians();
    let f_px = f64::from(width) / 2.0 / if lens == Lens::Pinhole { half.tan() } else { half };
    // More than 175° off axis, the corners of an equidistant picture are empty.
    let corner_deg = f64::from(width).hypot(f64::from(height)).to_degrees() / (2.0 * f_px);
    let theta_max_deg = (lens == Lens::Equidistant && corner_deg > 175.0).then_some(175.0);
    Ok(camera::Config { theta_max_deg, ..camera::Config::ideal(model, width, height, f_px) })
}

/// Returns every combination of the values of the axes; the last axis varies fastest.
pub(super) fn combinations(axes: &[Axis]) -> Vec<Vec<f64>> {
    axes.iter().fold(vec![Vec::new()], |places, axis| {
        let with = |place: Vec<f64>| axis.values.iter().map(move |v| [place.as_slice(), &[*v]].concat()).collect();
        places.into_iter().flat_map::<Vec<Vec<f64>>, _>(with).collect()
    })
}
