//! Sigmas of the direction, for every combination of the design's quantities.

use hzn_plot::{Chart, Series, Style};
use hzn_sim::sensitivity::{Design, Sigmas};

use super::args::Args;
use super::grid::{CORRELATION_PX, Grid, combinations};
use super::study::Study;
use super::table::Table;
use crate::exit::Stop;

type Pick = fn(&Sigmas) -> Option<f64>;

/// Columns of the result: name in files, head in the text (empty: only in files), value.
const COLUMNS: [(&str, &str, Pick); 12] = [
    ("half_angle_deg", "half-angle", |s| Some(s.half_angle_deg)),
    ("limb_px", "limb px", |s| Some(s.limb_px)),
    ("roll_free_deg", "roll free", |s| Some(s.free.roll_deg)),
    ("pitch_free_deg", "pitch free", |s| Some(s.free.pitch_deg)),
    ("roll_fused_deg", "roll fused", |s| Some(s.fused.roll_deg)),
    ("pitch_fused_deg", "pitch fused", |s| Some(s.fused.pitch_deg)),
    ("sigma_max_deg", "sigma max", |s| Some(s.largest_deg)),
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
        let sigmas = grid.sigmas(&place, &design)?;
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
    let mut notes = grid.notes();
    if let (Some(design), Ok(dip)) = (unseen.first(), unseen.first().map_or(Ok(0.0), Design::dip_deg)) {
        let n = unseen.len();
        let (of, km) = (results.len(), design.altitude_km);
        notes.push(format!(
            "{n} of {of} designs see no limb, or too little of it: at {km} km the limb is {dip:.1} deg below the \
             horizontal; --depression {dip:.0} looks at it"
        ));
    }
    notes.extend(small_picture(args, results.iter().filter_map(|(_, s)| s.as_ref()).map(|s| s.limb_px)));
    let best = |value: Pick| {
        let with = |(p, s): &(Vec<f64>, Option<Sigmas>)| Some((p.clone(), value(s.as_ref()?)?));
        results.iter().filter_map(with).min_by(|a, b| a.1.total_cmp(&b.1))
    };
    if let Some((place, deg)) = best(|s| Some(s.largest_deg)).filter(|_| !swept.is_empty()) {
        let place: Vec<String> = swept.iter().map(|&i| format!("{} {}", grid.axes[i].label, place[i])).collect();
        notes.push(format!("smallest sigma max: {deg:.4} deg at {}", place.join(", ")));
    }
    let chart = swept.first().map(|&x| chart(&grid, &results, x, &swept[1..]));
    Ok(Study { table, chart, notes })
}

/// Returns the note that the default errors are not those of a small picture, in which they shift the whole limb.
fn small_picture(args: &Args, limbs_px: impl Iterator<Item = f64>) -> Option<String> {
    let is_default = args.sensor.is_none() && args.correlation_px.is_none();
    let shortest_px = limbs_px.filter(|_| is_default).fold(f64::INFINITY, f64::min);
    (shortest_px < CORRELATION_PX).then(|| {
        format!(
            "the default errors of the edge are those of visible pictures 1920 px wide. A limb of {shortest_px:.0} px \
             is shifted as a whole by them. For a small picture, such as that of a thermal array, give --sigma-px and \
             --correlation-px of the camera, or its --sensor"
        )
    })
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
