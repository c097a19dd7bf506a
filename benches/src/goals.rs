//! Compares the measured times with the goals of hzn-core.

use std::fmt::Write;

use crate::results::{CaseResult, median};
use crate::sensors::FEWER;

/// Cases, each with the goal for its speed: how many times as fast as the recipe.
const FACTORS: [(&str, f64); 5] = [
    ("clean-640x480", 10.0),
    ("clean-1920x1080", 20.0),
    ("cloudy-1920x1080", 40.0),
    ("clean-4096x3072", 60.0),
    ("cloudy-4096x3072", 60.0),
];
/// Two cases, and the goal for the ratio of their times. The second picture has six times the pixels of the first.
const GROWTH: (&str, &str, f64) = ("clean-1920x1080", "clean-4096x3072", 2.0);
/// Case, with the goals for nanoseconds per edge point and for the percentage of pixels that are read.
const POINT_AND_PIXEL_GOALS: (&str, f64, f64) = ("clean-1920x1080", 30.0, 1.0);

/// Returns the table of goals. Cases that were not measured have no row.
pub(crate) fn table(cases: &[CaseResult]) -> String {
    let case = |name: &str| cases.iter().find(|c| c.name == name);
    let mut s = format!("| goal | measured | with {FEWER} points kept |\n|---|---|---|\n");
    for (name, factor) in FACTORS {
        let Some(c) = case(name) else { continue };
        let [ours, fewer] = [&c.f32, &c.fewer].map(|t| c.opencv.median() / t.median());
        let _ = writeln!(s, "| {name}: {factor} times as fast as the recipe | {ours:.1} | {fewer:.1} |");
    }
    let (small, large, most) = GROWTH;
    if let (Some(small), Some(large)) = (case(small), case(large)) {
        let ours = large.f32.median() / small.f32.median();
        let fewer = large.fewer.median() / small.fewer.median();
        let _ =
            writeln!(s, "| {}: at most {most} times as long as {} | {ours:.1} | {fewer:.1} |", large.name, small.name);
    }
    let (name, ns, percent) = POINT_AND_PIXEL_GOALS;
    if let Some(c) = case(name) {
        let point = median(&c.ns_a_point);
        let _ = writeln!(s, "| {name}, every point kept, warm: at most {ns} ns per point | {point:.0} | |");
        let read = median(&c.pixels_percent);
        let _ = writeln!(s, "| {name}: at most {percent} % of the pixels read | {read:.2} | |");
    }
    s
}
