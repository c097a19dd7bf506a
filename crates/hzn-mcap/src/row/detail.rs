//! The column `detail` in words.

use hzn_core::real::Real;
use hzn_core::status::{Stage, Status};
use hzn_core::{Report, Solution};

/// Describes what an answer is besides the limb by day: the limb of the airglow, or an edge that stays in the picture
/// while the vehicle turns.
pub(super) fn describe_answer<T: Real>(report: &Report<T>, solution: &Solution<T>) -> String {
    let parts = [(solution.is_airglow, "airglow"), (report.is_suspect, "suspect: fixed in the picture")];
    parts.into_iter().filter(|(holds, _)| *holds).map(|(_, text)| text).collect::<Vec<_>>().join("; ")
}

/// Describes the last stage, the verdict of each candidate, and the number of looks if there was more than one.
pub(super) fn describe<T: Real>(report: &Report<T>) -> String {
    let mut text = format!("ended at {}", report.stage.name());
    if report.status == Status::NoLimb && report.stage == Stage::Threshold {
        text.push_str(
            ": dark and lit differ by less than 3 % of full scale; the body fills the picture or is not in it",
        );
    }
    if report.counters.looks > 1 {
        text.push_str(&format!(" in {} looks", report.counters.looks));
    }
    for (i, c) in report.candidates.iter().enumerate() {
        text.push_str(if i == 0 { ": " } else { ", " });
        text.push_str(c.verdict.name());
    }
    text
}
