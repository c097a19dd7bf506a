//! Sigmas of the direction, for every combination of the design's quantities.

use hzn_core::camera::{self, Model};
use hzn_sim::sensitivity::{Design, Sigmas};

use super::args::{Args, Lens, Size};
use super::body::Body;
use super::study::Study;
use super::table::Table;
use crate::exit::{Stop, usage};
use crate::plot::{Chart, Series, Style};

/// One quantity with its values.
struct Axis {
    /// Name of its column.
    column: &'static str,
    /// Name of the quantity in the plot.
    label: &'static str,
    values: Vec<f64>,
}

/// The grid of all designs: one design for each combination of the axes' values.
struct Grid<'a> {
    args: &'a Args,
    sensor: Option<hzn_core::Config>,
    bodies: Vec<Body>,
    axes: Vec<Axis>,
}

impl<'a> Grid<'a> {
    fn new(args: &'a Args) -> Result<Self, Stop> {
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
        axis("depression_deg", "depression [deg]", &args.depression.0);
        axis("roll_deg", "roll of the camera [deg]", &args.roll.0);
        let radii: Vec<f64> = bodies.iter().map(|b| b.radius_km).collect();
        axis("radius_km", "radius [km]", &radii);
        Ok(Self { args, sensor, bodies, axes })
    }

    fn value(&self, place: &[f64], column: &str) -> Option<f64> {
        self.axes.iter().zip(place).find(|(a, _)| a.column == column).map(|(_, v)| *v)
    }

    fn design(&self, place: &[f64]) -> Result<Design, Stop> {
        let args = self.args;
        let value = |column: &str| self.value(place, column);
        let own = self.sensor.as_ref().map(|s| (&s.body, &s.covariance));
        let camera = match &self.sensor {
            Some(sensor) => sensor.camera.clone(),
            None => lens(args.lens, args.size, value("fov_deg").unwrap_or(f64::NAN), value("rows_px"))?,
        };
        let radius_km = value("radius_km").unwrap_or(f64::NAN);
        let body = self.bodies.iter().find(|b| b.radius_km == radius_km).copied().unwrap_or(Body::EARTH);
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
                args.limb_height_sigma.or(own.map(|(b, _)| b.limb_height_sigma_km)).unwrap_or(2.0),
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
fn combinations(axes: &[Axis]) -> Vec<Vec<f64>> {
    axes.iter().fold(vec![Vec::new()], |places, axis| {
        let with = |place: Vec<f64>| axis.values.iter().map(move |v| [place.as_slice(), &[*v]].concat()).collect();
        places.into_iter().flat_map::<Vec<Vec<f64>>, _>(with).collect()
    })
}

type Pick = fn(&Sigmas) -> Option<f64>;

/// Columns of the result: name in files, head in the text (empty: only in files), value.
const COLUMNS: [(&str, &str, Pick); 11] = [
    ("half_angle_deg", "half-angle", |s| Some(s.half_angle_deg)),
    ("limb_px", "limb px", |s| Some(s.limb_px)),
    ("roll_free_deg", "roll free", |s| Some(s.free.roll_deg)),
    ("pitch_free_deg", "pitch free", |s| Some(s.free.pitch_deg)),
    ("roll_fused_deg", "roll fused", |s| Some(s.fused.roll_deg)),
    ("pitch_fused_deg", "pitch fused", |s| Some(s.fused.pitch_deg)),
    ("roll_known_deg", "roll known", |s| Some(s.known.roll_deg)),
    ("pitch_known_deg", "pitch known", |s| Some(s.known.pitch_deg)),
    ("roll_braun_barf_33_deg", "", |s| s.braun_barf.map(|t| t.roll_deg)),
    ("pitch_braun_barf_33_deg", "", |s| s.braun_barf.map(|t| t.pitch_deg)),
    ("bound_braun_barf_37_deg", "", |s| s.braun_barf_bound_deg),
];

/// Computes the sigmas of all designs.
pub(super) fn compute(args: &Args) -> Result<Study, Stop> {
    let grid = Grid::new(args)?;
    let mut results: Vec<(Vec<f64>, Option<Sigmas>)> = Vec::new();
    let mut unseen = Vec::new();
    for place in combinations(&grid.axes) {
        let design = grid.design(&place)?;
        let sigmas = design.sigmas().map_err(usage)?;
        if sigmas.is_none() {
            unseen.push(design);
        }
        results.push((place, sigmas));
    }
    let swept: Vec<usize> = (0..grid.axes.len()).filter(|&i| grid.axes[i].values.len() > 1).collect();
    let mut table = Table::default();
    for (i, axis) in grid.axes.iter().enumerate() {
        let shown = swept.contains(&i) || matches!(axis.column, "fov_deg" | "altitude_km");
        table.column(axis.column, if shown { axis.column } else { "" }, results.iter().map(|(p, _)| p.get(i).copied()));
    }
    for (column, head, value) in COLUMNS {
        table.column(column, head, results.iter().map(|(_, s)| s.as_ref().and_then(value)));
    }
    let mut notes = Vec::new();
    if let (Some(design), Ok(dip)) = (unseen.first(), unseen.first().map_or(Ok(0.0), Design::dip_deg)) {
        let n = unseen.len();
        let (of, km) = (results.len(), design.altitude_km);
        notes.push(format!(
            "{n} of {of} designs see no limb, or too little of it: at {km} km the limb is {dip:.1} deg below the \
             horizontal; --depression {dip:.0} looks at it"
        ));
    }
    let best = |value: Pick| {
        let with = |(p, s): &(Vec<f64>, Option<Sigmas>)| Some((p.clone(), value(s.as_ref()?)?));
        results.iter().filter_map(with).min_by(|a, b| a.1.total_cmp(&b.1))
    };
    if let Some((place, deg)) = best(|s| Some(s.fused.pitch_deg)).filter(|_| !swept.is_empty()) {
        let place: Vec<String> = swept.iter().map(|&i| format!("{} {}", grid.axes[i].label, place[i])).collect();
        notes.push(format!("smallest pitch, fused: {deg:.4} deg at {}", place.join(", ")));
    }
    let chart = swept.first().map(|&x| chart(&grid, &results, x, &swept[1..]));
    Ok(Study { table, chart, notes })
}

/// Plots sigmas over the first quantity that varies. Every combination of the others has its own lines.
fn chart(grid: &Grid<'_>, results: &[(Vec<f64>, Option<Sigmas>)], x: usize, others: &[usize]) -> Chart {
    let mut chart = Chart::new("Sigma of the direction by design (1 sigma)", grid.axes[x].label, "deg");
    let name = |place: &[f64]| -> String {
        others.iter().map(|&i| format!(", {} {}", grid.axes[i].label, place[i])).collect()
    };
    let mut names: Vec<String> = results.iter().map(|(p, _)| name(p)).collect();
    names.dedup();
    names.sort();
    names.dedup();
    // With several lines for each quantity, roll and the pitch with free or known half-angle would fill the plot.
    let lines: &[(&str, Pick)] = if others.is_empty() {
        &[
            ("pitch, half-angle free", |s| Some(s.free.pitch_deg)),
            ("pitch, fused", |s| Some(s.fused.pitch_deg)),
            ("pitch, half-angle known", |s| Some(s.known.pitch_deg)),
            ("roll", |s| Some(s.fused.roll_deg)),
        ]
    } else {
        &[("pitch, fused", |s| Some(s.fused.pitch_deg))]
    };
    for which in &names {
        for (what, value) in lines {
            let same = results.iter().filter(|(p, _)| name(p) == *which);
            let points = same.map(|(p, s)| (p[x], s.as_ref().and_then(value).unwrap_or(f64::NAN)));
            chart = chart.with_series(Series::new(format!("{what}{which}"), Style::Line, points));
        }
    }
    chart
}
