//! Error of the direction from several heads that are one sensor.

use hzn_core::rig::{Limb, MOST_HEADS};
use hzn_plot::{Chart, Series, Style};
use hzn_sim::sensitivity::{Design, RigDesign, RigSigmas};

use super::args::Args;
use super::grid::{Grid, combinations};
use super::study::Study;
use super::table::Table;
use crate::exit::{Stop, usage};

type Pick = fn(&RigSigmas) -> Option<f64>;

/// Columns of the result: name in files, head in the text, value.
const COLUMNS: [(&str, &str, Pick); 3] = [
    ("rms_deg", "rms", |s| Some(s.rms_deg)),
    ("sigma_max_deg", "sigma max", |s| Some(s.largest_deg)),
    ("protection_deg", "protection", |s| s.protection_deg),
];

/// Computes the errors of all rigs.
pub(super) fn compute(args: &Args) -> Result<Study, Stop> {
    check(args)?;
    let grid = Grid::new(args)?;
    let mut results: Vec<(Vec<f64>, Option<RigSigmas>)> = Vec::new();
    for place in combinations(&grid.axes) {
        results.push((place.clone(), design(&grid, args, &place)?.sigmas().map_err(usage)?));
    }
    let swept: Vec<usize> = (0..grid.axes.len()).filter(|&i| grid.axes[i].values.len() > 1).collect();
    let mut table = Table::default();
    for (i, axis) in grid.axes.iter().enumerate().filter(|(_, axis)| axis.column != "depression_deg") {
        let shown = swept.contains(&i) || matches!(axis.column, "fov_deg" | "altitude_km" | "heads");
        table.column(axis.column, if shown { axis.column } else { "" }, results.iter().map(|(p, _)| p.get(i).copied()));
    }
    for (column, head, value) in COLUMNS {
        table.column(column, head, results.iter().map(|(_, s)| s.as_ref().and_then(value)));
    }
    let unseen = results.iter().filter(|(_, s)| s.is_none()).count();
    let note = (unseen > 0).then(|| format!("{unseen} of {} rigs see too little limb for a direction", results.len()));
    Ok(Study { table, chart: chart(&grid, &results, &swept), notes: grid.notes().into_iter().chain(note).collect() })
}

/// Refuses what a rig cannot have.
fn check(args: &Args) -> Result<(), Stop> {
    if args.sensor.is_some() {
        return Err(usage("--sensor: for rig, give the camera by --fov, --size and --lens"));
    }
    if args.depression.0 != [0.0] {
        return Err(usage("--depression: the heads of a rig look at the limb; leave it out"));
    }
    if args.body.len() > 1 {
        return Err(usage("--body: give one body for a rig"));
    }
    if let Some(heads) = args.heads.0.iter().find(|n| n.fract() != 0.0 || !(1.0..=MOST_HEADS as f64).contains(*n)) {
        return Err(usage(format!("--heads: {heads} is refused: a rig has 1 to {MOST_HEADS} heads")));
    }
    let between = args.between.iter().flat_map(|values| &values.0);
    if let Some(deg) = between.copied().find(|deg| !(*deg > 0.0 && *deg <= 180.0)) {
        return Err(usage(format!("--between: {deg} is refused: must be above 0 and up to 180")));
    }
    let sigmas = args.mount_sigma.0.iter().map(|x| ("mount-sigma", *x));
    let heights = [("own-height-sigma", args.own_height_sigma), ("tilt-sigma", args.tilt_sigma)];
    let mut all = sigmas.chain(heights.into_iter().filter_map(|(name, x)| Some((name, x?))));
    match all.find(|(_, x)| !(*x >= 0.0 && x.is_finite())) {
        Some((name, x)) => Err(usage(format!("--{name}: {x} is refused: must be 0 or more"))),
        None => Ok(()),
    }
}

fn design(grid: &Grid<'_>, args: &Args, place: &[f64]) -> Result<RigDesign, Stop> {
    let head = grid.design(place)?;
    // The optical axis is on the limb.
    let head = Design { depression_deg: head.dip_deg().map_err(usage)?, ..head };
    let heads = grid.value(place, "heads").unwrap_or(1.0);
    let between = grid.value(place, "between_deg").unwrap_or(360.0 / heads);
    Ok(RigDesign {
        head,
        azimuths_deg: (0..heads as u32).map(|k| between * f64::from(k)).collect(),
        mount_sigma_deg: grid.value(place, "mount_sigma_deg").unwrap_or(0.0),
        own_km: [args.own_height_sigma.unwrap_or(Limb::<f64>::OWN_SIGMA_KM), Limb::<f64>::OWN_LENGTH_KM],
        tilt_sigma_km: args.tilt_sigma,
    })
}

/// Plots the error over the first quantity that varies, with a line for each combination of the others.
fn chart(grid: &Grid<'_>, results: &[(Vec<f64>, Option<RigSigmas>)], swept: &[usize]) -> Option<Chart> {
    let (&x, others) = swept.split_first()?;
    let name = |place: &[f64]| {
        let part = |&i: &usize| Some(format!("{} {}", place.get(i)?, grid.axes.get(i)?.label));
        others.iter().filter_map(part).collect::<Vec<_>>().join(", ")
    };
    let mut names: Vec<String> = Vec::new();
    for (place, _) in results {
        let own = name(place);
        if !names.contains(&own) {
            names.push(own);
        }
    }
    let mut chart = Chart::new("Error of the direction from several heads (RMS)", grid.axes.get(x)?.label, "deg");
    for which in names {
        let same = results.iter().filter(|(place, _)| name(place) == which);
        let points = same.filter_map(|(place, s)| Some((*place.get(x)?, s.as_ref().map_or(f64::NAN, |s| s.rms_deg))));
        let label = if which.is_empty() { "RMS".to_owned() } else { which.clone() };
        chart = chart.with_series(Series::new(label, Style::Line, points));
    }
    Some(chart)
}
