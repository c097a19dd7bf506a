//! Chooses pictures that were refused because they contradict their attitude or their rates.

use hzn_core::status::Status;
use hzn_core::verdict::Verdict;
use hzn_run::engine::Finished;
use hzn_run::explain;

use super::spread::Spread;

/// Fewest refused pictures that say something about all.
const FEWEST: u64 = 3;
/// Most pairs of pictures that are looked at again.
const MOST_PAIRS: usize = 20;

/// Collects such pictures.
#[derive(Debug, Default)]
pub(crate) struct Refused {
    /// Pictures with an answer, and those that were refused for their attitude, or as fixed.
    answered: u64,
    attitude: u64,
    fixed: u64,
    of_attitude: Spread<u64>,
    /// Pictures of which they and the one before have a limb, a time and a rate.
    pairs: Spread<u64>,
    /// The last picture, if it has these.
    last: Option<u64>,
}

impl Refused {
    pub(crate) fn count(&mut self, frame: &Finished) {
        let last = self.last.take();
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
        let has_rate = frame.data.as_ref().is_some_and(|data| data.rate_rad_s.is_some()) && frame.time_s.is_some();
        if (is_answer || is_fixed) && has_rate {
            self.last = Some(frame.index);
            if last.is_some_and(|last| last + 1 == frame.index) {
                self.pairs.add(frame.index);
            }
        }
    }

    /// Returns the numbers of some pictures that were refused for their attitude, if most of those with a limb were.
    pub(crate) fn of_attitude(&self) -> Vec<u64> {
        let are_most = self.attitude >= FEWEST && self.attitude > self.answered + self.fixed;
        if are_most { self.of_attitude.choose(Some) } else { Vec::new() }
    }

    /// Returns the numbers of the later picture of some pairs, if several pictures were refused as fixed.
    pub(crate) fn pairs(&self) -> Vec<u64> {
        if self.fixed < FEWEST {
            return Vec::new();
        }
        let all = self.pairs.choose(Some);
        let step = all.len().div_ceil(MOST_PAIRS).max(1);
        all.into_iter().step_by(step).collect()
    }
}
