//! Compares the measured times with the goals of hzn-core.

use std::fmt::Write;

use crate::results::{CaseResult, EXPERT, HZN, HZN_FEWER, HZN_SEQUENCE, median};
use crate::sensors::FEWER;
use crate::state::State;

/// Cases, each with a state and the goal for its speed: how many times as fast as the recipe. The second number is a
/// stretch goal; it is 0 if there is none. `book/results/speed.md` says why the missed ones are missed.
const FACTORS: [(&str, State, f64, f64); 7] = [
    ("clean-640x480", State::AllFlushed, 7.5, 9.0),
    ("clean-1920x1080", State::AllFlushed, 11.5, 12.5),
    ("clean-1920x1080", State::PictureFlushed, 9.0, 10.0),
    ("clean-1920x1080", State::Warm, 13.0, 15.0),
    ("cloudy-1920x1080", State::AllFlushed, 25.0, 30.0),
    ("clean-4096x3072", State::AllFlushed, 24.0, 28.0),
    ("cloudy-4096x3072", State::AllFlushed, 90.0, 120.0),
];
/// The same in a sequence.
const IN_SEQUENCE: [(&str, State, f64); 5] = [
    ("clean-1920x1080", State::AllFlushed, 15.0),
    ("clean-1920x1080", State::PictureFlushed, 13.0),
    ("clean-1920x1080", State::Warm, 18.0),
    ("cloudy-1920x1080", State::AllFlushed, 32.0),
    ("clean-4096x3072", State::AllFlushed, 45.0),
];
/// The same against the recipe that looks at every 8th pixel first.
const AGAINST_EXPERT: [(&str, State, f64); 2] =
    [("clean-1920x1080", State::PictureFlushed, 5.0), ("clean-4096x3072", State::PictureFlushed, 7.0)];
/// Two cases, and the goal for the ratio of their times. The second picture has six times the pixels of the first.
const GROWTH: (&str, &str, f64) = ("clean-1920x1080", "clean-4096x3072", 2.0);
/// Case, with the goals for nanoseconds per edge point and for the percentage of pixels that are read.
const POINT_AND_PIXEL_GOALS: (&str, f64, f64) = ("clean-1920x1080", 95.0, 1.0);

/// Returns the table of goals. Cases that were not measured have no row.
pub(crate) fn table(cases: &[CaseResult]) -> String {
    let case = |name: &str| cases.iter().find(|c| c.title == name);
    let mut s = format!("| figure | goal | measured | missed by | with {FEWER} points |\n|---|---:|---:|---:|---:|\n");
    let mut row = |figure: String, goal: String, measured: f64, missed: f64, fewer: Option<f64>| {
        let missed = if missed > 0.0 { format!("{:.0} %", missed * 100.0) } else { "met".to_owned() };
        let fewer = fewer.map_or(String::new(), |f| format!("{f:.1}"));
        let _ = writeln!(s, "| {figure} | {goal} | {} | {missed} | {fewer} |", short(measured));
    };
    for (name, state, factor, stretch) in FACTORS {
        let Some(c) = case(name) else { continue };
        let goal = if stretch > 0.0 { format!("{factor}; stretch {stretch}") } else { format!("{factor}") };
        let ours = c.ratio(HZN, state);
        let figure = format!("{name}, {}: times as fast as the recipe", state.name());
        row(figure, goal, ours, 1.0 - ours / factor, Some(c.ratio(HZN_FEWER, state)));
    }
    for (name, state, factor) in IN_SEQUENCE {
        let Some(c) = case(name) else { continue };
        let ours = c.ratio(HZN_SEQUENCE, state);
        let figure = format!("{name}, {}, in a sequence: times as fast as the recipe", state.name());
        row(figure, format!("{factor}"), ours, 1.0 - ours / factor, None);
    }
    for (name, state, factor) in AGAINST_EXPERT {
        let Some(c) = case(name) else { continue };
        let ours = c.ratio_to(EXPERT, HZN_SEQUENCE, state);
        let figure = format!("{name}, {}, in a sequence: times as fast as the recipe of an expert", state.name());
        row(figure, format!("{factor}"), ours, 1.0 - ours / factor, None);
    }
    let (small, large, most) = GROWTH;
    if let (Some(small), Some(large)) = (case(small), case(large)) {
        let growth = |program: usize| {
            let time = |c: &CaseResult| c.programs.get(program).map_or(f64::NAN, |p| p.median_us(State::AllFlushed));
            time(large) / time(small)
        };
        let figure = format!("{}, all flushed: times as long as {}", large.title, small.title);
        row(figure, format!("≤ {most}"), growth(HZN), growth(HZN) / most - 1.0, Some(growth(HZN_FEWER)));
    }
    let (name, ns, percent) = POINT_AND_PIXEL_GOALS;
    if let Some(c) = case(name) {
        let point = median(&c.ns_a_point);
        let figure = format!("{name}, every point kept, changing frames: ns a point");
        row(figure, format!("≤ {ns}"), point, point / ns - 1.0, None);
        let read = median(&c.pixels_percent);
        row(format!("{name}: pixels read, %"), format!("≤ {percent}"), read, read / percent - 1.0, None);
    }
    s
}

/// Formats a number with as many digits as the table needs.
fn short(value: f64) -> String {
    let decimals = if value >= 20.0 { 0 } else { 1 + usize::from(value < 1.0) };
    format!("{value:.decimals$}")
}
