//! A calibration from the sky in words and numbers.

use hzn_calib::sky::{self, Check, Estimate, Mount, MountRefusal};
use hzn_plot::{Chart, Series, Style};
use hzn_run::explain::counted;

use crate::tell::one_line;

/// Returns the report of an estimate.
pub(super) fn report(estimate: &Estimate, pictures: u64, mount: Option<&Result<Mount, MountRefusal>>) -> String {
    join(&sky::lines(estimate, &counted(pictures, "picture"), mount))
}

/// Returns the report of a check. Its first line is the verdict.
pub(super) fn check_report(check: &Check, pictures: u64) -> String {
    join(&sky::check_lines(check, &counted(pictures, "picture")))
}

pub(super) fn join(lines: &[(String, String)]) -> String {
    lines.iter().map(|(name, value)| format!("{name:<14} {}\n", one_line(value))).collect()
}

/// Plots the limb height of each picture with its errors.
pub(super) fn heights(estimate: &Estimate) -> Chart {
    let each = || estimate.pictures.iter().enumerate().map(|(i, p)| (i as f64, p));
    let bars = each().flat_map(|(x, p)| [(x, p.km - p.sigma_km), (x, p.km + p.sigma_km), (x, f64::NAN)]);
    let dots = |counts: bool| each().filter(move |(_, p)| p.counts == counts).map(|(x, p)| (x, p.km));
    let mut chart = Chart::new("Limb height of each picture with the new lens", "picture", "limb height [km]")
        .with_series(Series::new("1 sigma from edge noise", Style::Ideal, bars))
        .with_series(Series::new("measured", Style::Dots, dots(true)))
        .with_series(Series::new("fitted", Style::Line, each().map(|(x, _)| (x, estimate.height_km[0]))));
    if estimate.pictures.iter().any(|p| !p.counts) {
        chart = chart.with_series(Series::new("left out", Style::Dots, dots(false)));
    }
    chart
}
