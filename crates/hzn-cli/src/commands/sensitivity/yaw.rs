//! Sigma of the rotation about the line to a flattened body.

use hzn_plot::{Chart, Series, Style};
use hzn_sim::sensitivity::{ThirdAxis, ThirdAxisSigmas};

use super::args::Args;
use super::grid::{Grid, combinations};
use super::study::Study;
use super::table::Table;
use crate::exit::{Stop, usage};

type Pick = fn(&ThirdAxisSigmas) -> f64;

/// Columns of the result: name in files, head in the text, value.
const COLUMNS: [(&str, &str, Pick); 4] = [
    ("limb_px", "limb px", |s| s.limb_px),
    ("yaw_by_edges_deg", "by edges", |s| s.by_edges_deg),
    ("yaw_by_height_deg", "by limb height", |s| s.by_height_deg),
    ("yaw_deg", "yaw", ThirdAxisSigmas::total_deg),
];

/// Computes the sigmas of all designs.
pub(super) fn compute(args: &Args) -> Result<Study, Stop> {
    let grid = Grid::new(args)?;
    let mut results = Vec::new();
    for place in combinations(&grid.axes) {
        let sigmas = design(&grid, args, &place)?.sigmas().map_err(usage)?;
        results.push((place, sigmas));
    }
    let swept: Vec<usize> = (0..grid.axes.len()).filter(|&i| grid.axes[i].values.len() > 1).collect();
    let mut table = Table::default();
    for (i, axis) in grid.axes.iter().enumerate() {
        let shown = swept.contains(&i) || matches!(axis.column, "altitude_km" | "latitude_deg");
        table.column(axis.column, if shown { axis.column } else { "" }, results.iter().map(|(p, _)| p.get(i).copied()));
    }
    for (column, head, value) in COLUMNS {
        table.column(column, head, results.iter().map(|(_, s)| s.as_ref().map(value)));
    }
    let unseen = results.iter().filter(|(_, s)| s.is_none()).count();
    let note = (unseen > 0).then(|| {
        format!(
            "{unseen} of {} designs do not determine the rotation: too little limb is in view (--depression 90 looks \
             at the centre), the body is a sphere, or the camera is above its pole",
            results.len()
        )
    });
    let chart = swept.first().map(|&x| {
        let points = |value: Pick| results.iter().filter_map(move |(p, s)| Some((*p.get(x)?, value(s.as_ref()?))));
        let mut chart = Chart::new("Sigma of the rotation about the line to the body", grid.axes[x].label, "deg");
        for (_, head, value) in &COLUMNS[1..] {
            chart = chart.with_series(Series::new(*head, Style::Line, points(*value)));
        }
        chart
    });
    // A plot over one quantity has one line for each column.
    Ok(Study {
        table,
        chart: chart.filter(|_| swept.len() == 1),
        notes: grid.notes().into_iter().chain(note).collect(),
    })
}

fn design(grid: &Grid<'_>, args: &Args, place: &[f64]) -> Result<ThirdAxis, Stop> {
    let limb = grid.design(place)?;
    let value = |column: &str| grid.value(place, column).unwrap_or(0.0);
    let body = grid.body(place);
    // A limb height that is given on the command line replaces all that is known of the body's.
    let own = body.second_harmonic_km.filter(|_| args.limb_height_sigma.is_none());
    let second_harmonic_km = args.second_harmonic.or(own).unwrap_or(limb.limb_height_sigma_km);
    if !(second_harmonic_km >= 0.0 && second_harmonic_km.is_finite()) {
        return Err(usage(format!("--second-harmonic: {second_harmonic_km} is refused: must be 0 or more")));
    }
    let latitude_deg = value("latitude_deg");
    if !(latitude_deg.abs() <= 90.0) {
        return Err(usage(format!("--latitude: {latitude_deg} is refused: must be from -90 to 90")));
    }
    Ok(ThirdAxis {
        radii_km: body.radii_km,
        limb_height_km: limb.limb_height_km,
        second_harmonic_km,
        altitude_km: limb.altitude_km,
        latitude_deg,
        azimuth_deg: value("azimuth_deg"),
        depression_deg: limb.depression_deg,
        roll_deg: limb.roll_deg,
        sigma_px: limb.sigma_px,
        correlation_px: limb.correlation_px,
        camera: limb.camera,
    })
}
