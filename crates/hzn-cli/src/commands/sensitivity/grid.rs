//! The grid of designs: every combination of the quantities on the command line.

use hzn_core::camera::{self, Model};
use hzn_sim::sensitivity::Design;

use super::args::{Args, Lens, Size, What};
use super::body::Body;
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
    sensor: Option<hzn_core::Config>,
    bodies: Vec<Body>,
    pub(super) axes: Vec<Axis>,
}

impl<'a> Grid<'a> {
    pub(super) fn new(args: &'a Args) -> Result<Self, Stop> {
        let mut sensor = None;
        if let Some(path) = &args.sensor {
            let mut config = hzn_calib::sensor::load(path)?.config;
            match config.bodies.as_slice() {
                [] => {}
                [one] => config.body = one.clone(),
                _ if !args.body.is_empty() => {}
                several => {
                    let names: Vec<&str> = several.iter().map(|b| b.kind.name()).collect();
                    let what = format!("looks for several bodies ({}); name one with --body", names.join(", "));
                    return Err(usage(format!("{}: {what}", path.display())));
                }
            }
            sensor = Some(config);
        }
        let body = sensor.as_ref().map(|s| &s.body);
        let bodies = match (args.body.is_empty(), body) {
            (false, _) => args.body.clone(),
            (true, Some(body)) => vec![Body::from_config(body)],
            (true, None) => vec![Body::EARTH],
        };
        let altitude = match (&args.altitude, body.and_then(|b| b.altitude_km)) {
            (Some(values), _) => values.0.clone(),
            (None, Some(km)) => vec![km],
            (None, None) => return Err(usage("--altitude: missing; give it in kilometres, such as --altitude 200")),
        };
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
        if args.what == What::Yaw {
            axis("latitude_deg", "latitude [deg]", &args.latitude.0);
            axis("azimuth_deg", "azimuth of the view [deg]", &args.azimuth.0);
        }
        axis("depression_deg", "depression [deg]", &args.depression.0);
        axis("roll_deg", "roll of the camera [deg]", &args.roll.0);
        let radii: Vec<f64> = bodies.iter().map(|b| b.radius_km).collect();
        axis("radius_km", "radius [km]", &radii);
        Ok(Self { args, sensor, bodies, axes })
    }

    pub(super) fn value(&self, place: &[f64], column: &str) -> Option<f64> {
        self.axes.iter().zip(place).find(|(a, _)| a.column == column).map(|(_, v)| *v)
    }

    /// Returns the body of a place in the grid.
    pub(super) fn body(&self, place: &[f64]) -> Body {
        let radius_km = self.value(place, "radius_km");
        self.bodies.iter().find(|b| Some(b.radius_km) == radius_km).copied().unwrap_or(Body::EARTH)
    }

    pub(super) fn design(&self, place: &[f64]) -> Result<Design, Stop> {
        let args = self.args;
        let value = |column: &str| self.value(place, column);
        let own = self.sensor.as_ref().map(|s| (&s.body, &s.covariance));
        let camera = match &self.sensor {
            Some(sensor) => sensor.camera.clone(),
            None => lens(args.lens, args.size, value("fov_deg").unwrap_or(f64::NAN), value("rows_px"))?,
        };
        let body = self.body(place);
        let radius_km = body.radius_km;
        let positive = |name: &str, x: f64| match x >= 0.0 && x.is_finite() {
            true => Ok(x),
            false => Err(usage(format!("--{name}: {x} is refused: must be 0 or more"))),
        };
        // With --body, the limb height of the sensor.toml is not used, because it belongs to another body.
        let limb_height = own.filter(|_| args.body.is_empty()).map_or(body.limb_height_km, |(b, _)| b.limb_height_km);
        let sigma_px = args.sigma_px.or(own.map(|(_, c)| c.sigma_px)).unwrap_or(1.0);
        if !(sigma_px > 0.0) {
            return Err(usage(format!("--sigma-px: {sigma_px} is refused: must be above 0")));
        }
        let limb_height_sigma = args.limb_height_sigma.or(body.limb_height_sigma_km);
        Ok(Design {
            camera,
            radius_km,
            altitude_km: value("altitude_km").unwrap_or(f64::NAN),
            altitude_sigma_km: positive(
                "altitude-sigma",
                args.altitude_sigma.or(own.map(|(b, _)| b.altitude_sigma_km)).unwrap_or(0.5),
            )?,
            limb_height_km: value("limb_height_km").unwrap_or(limb_height),
            limb_height_sigma_km: positive(
                "limb-height-sigma",
                limb_height_sigma.or(own.map(|(b, _)| b.limb_height_sigma_km)).unwrap_or(2.0),
            )?,
            depression_deg: value("depression_deg").unwrap_or(0.0),
            roll_deg: value("roll_deg").unwrap_or(0.0),
            sigma_px,
            correlation_px: positive(
                "correlation-px",
                args.correlation_px.or(own.map(|(_, c)| c.correlation_px)).unwrap_or(300.0),
            )?,
        })
    }
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
