//! Chooses pictures that were refused because they contradict their attitude.

use hzn_core::status::Status;
use hzn_core::verdict::Verdict;
use hzn_run::engine::Finished;
use hzn_run::explain;

use super::spread::Spread;

/// Fewest refused pictures that say something about all.
const FEWEST: u64 = 3;

/// Collects such pictures.
#[derive(Debug, Default)]
pub(crate) struct Refused {
    /// Pictures with an answer, and those that were refused for their attitude, or as fixed.
    answered: u64,
    attitude: u64,
    fixed: u64,
    of_attitude: Spread<u64>,
}

impl Refused {
    pub(crate) fn count(&mut self, frame: &Finished) {
        let Some(report) = frame.outcomes.first().and_then(|first| first.report.as_ref().ok()) else { return };
        let verdict = explain::best_candidate(report).map(|candidate| candidate.verdict);
        let is_answer = report.status == Status::Ok;
        let is_fixed = !is_answer && verdict == Some(Verdict::Fixed);
        self.answered += u64::from(is_answer);
        if !is_answer && verdict == Some(Verdict::Attitude) {
            self.attitude += 1;
            self.of_attitude.add(frame.index);
        }
        self.fixed += u64::from(is_fixed);
    }

    /// Returns the numbers of some pictures that were refused for their attitude, if most of those with a limb were.
    pub(crate) fn of_attitude(&self) -> Vec<u64> {
        let are_most = self.attitude >= FEWEST && self.attitude > self.answered + self.fixed;
        if are_most { self.of_attitude.choose(Some) } else { Vec::new() }
    }
}
