//! The common reasons of pictures without an answer, for the end of a run.

use std::path::Path;

use hzn_core::body::Kind;
use hzn_core::status::Status;
use hzn_core::verdict::Verdict;
use hzn_core::{Config, Report, gates};
use hzn_run::engine::Finished;
use hzn_run::explain;
pub(crate) use hzn_run::provenance::quoted;

use crate::doubts::Spread;

/// The reason why a body was not found in a picture: the verdict on the best candidate, or the status if there is none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Why {
    /// The verdict, and the kind of the body: the same verdict has another meaning for the Sun than for the Earth.
    Verdict(Verdict, Kind),
    Status(Status),
}

impl Why {
    /// Returns the reason; `None` for an answer.
    fn from_report(report: &Report<f64>, kind: Kind) -> Option<Self> {
        if report.status == Status::Ok {
            return None;
        }
        let best = explain::best_candidate(report);
        Some(best.map_or(Self::Status(report.status), |c| Self::Verdict(c.verdict, kind)))
    }

    /// Returns whether the body may have another size than expected.
    fn is_size(self) -> bool {
        matches!(self, Self::Verdict(Verdict::HalfAngle | Verdict::NoConsensus | Verdict::FewInliers, _))
    }

    /// Returns whether a body of another size may be the reason. The picture of such a body also lacks an edge along a
    /// part of the limb that is expected.
    fn may_be_size(self) -> bool {
        self.is_size() || matches!(self, Self::Verdict(Verdict::Unsupported, _))
    }

    fn text(self, limits: &gates::Config) -> String {
        match self {
            Self::Verdict(verdict, kind) => {
                format!("{}: {}", verdict.name(), explain::verdict_text(verdict, limits, kind))
            }
            Self::Status(status) => format!("{status}: {}", explain::status_text(status)),
        }
    }
}

/// Counts refusals (a body without an answer in a picture) by their reason.
#[derive(Debug, Default)]
pub(crate) struct Refusals {
    /// Number of answers that a further look at another threshold gave.
    further: u64,
    each: Vec<Reason>,
    total: u64,
    /// Numbers of pictures whose body may have another size than expected.
    of_size: Spread<u64>,
}

/// Most pictures with one reason that are kept to look at again.
const MAX_KEPT: usize = 5;
/// Most pictures that are looked at for two wrong values: twice as many as are needed, because some show clouds. Each
/// takes a few tenths of a second.
const MOST_OF_SIZE: usize = 16;

/// A reason with its count.
#[derive(Debug)]
struct Reason {
    why: Why,
    count: u64,
    /// Numbers of the first pictures with it that were processed for every body.
    first: Vec<u64>,
}

/// The commonest reason.
#[derive(Debug)]
pub(crate) struct Commonest<'a> {
    /// The reason in words, with its count.
    pub(crate) text: String,
    /// Numbers of the first pictures with it.
    pub(crate) pictures: &'a [u64],
    /// Whether the body may have another size than expected.
    pub(crate) is_size: bool,
    /// Whether an edge was found and refused.
    pub(crate) is_edge: bool,
}

impl Refusals {
    pub(crate) fn count(&mut self, frame: &Finished, config: &Config) {
        let first_here = frame.outcomes.iter().all(|f| f.report.is_ok()).then_some(frame.index);
        let is_further = |report: &Report<f64>| report.status == Status::Ok && report.counters.looks > 1;
        self.further += frame.outcomes.iter().filter(|f| f.report.as_ref().is_ok_and(is_further)).count() as u64;
        let mut may_be_size = false;
        let bodies = config.each_body();
        let each = frame.outcomes.iter().zip(bodies);
        for why in each.filter_map(|(f, body)| Why::from_report(f.report.as_ref().ok()?, body.kind)) {
            self.total += 1;
            may_be_size |= why.may_be_size();
            match self.each.iter_mut().find(|known| known.why == why) {
                Some(known) => {
                    known.count += 1;
                    known.first.extend(first_here.filter(|_| known.first.len() < MAX_KEPT));
                }
                None => self.each.push(Reason { why, count: 1, first: first_here.into_iter().collect() }),
            }
        }
        first_here.filter(|_| may_be_size).into_iter().for_each(|index| self.of_size.add(index));
    }

    /// Returns the numbers of some pictures whose body may have another size than expected, evenly spread over the run.
    pub(crate) fn of_size(&self) -> Vec<u64> {
        let all = self.of_size.choose(Some);
        let step = all.len().div_ceil(MOST_OF_SIZE).max(1);
        all.into_iter().step_by(step).collect()
    }

    /// Returns the number of answers from further looks, in words; `None` if there are none.
    pub(crate) fn further(&self) -> Option<String> {
        match self.further {
            0 => None,
            1 => Some("1 answer came from a further look at another threshold (retry.levels)".to_owned()),
            n => Some(format!("{n} answers came from a further look at another threshold (retry.levels)")),
        }
    }

    /// Returns the commonest reason. Among equally common reasons the first is used.
    pub(crate) fn commonest(&self, limits: &gates::Config) -> Option<Commonest<'_>> {
        let Reason { why, count, first } = self.each.iter().rev().max_by_key(|reason| reason.count)?;
        let share = if *count == self.total { "all".to_owned() } else { format!("{count}") };
        Some(Commonest {
            text: format!("{} refused, {share} as {}", self.total, why.text(limits)),
            pictures: first,
            is_edge: matches!(why, Why::Verdict(..)),
            is_size: why.is_size(),
        })
    }
}

/// Quotes a path so that no program takes it for an option.
pub(crate) fn quoted_path(path: &Path) -> String {
    if path.to_string_lossy().starts_with('-') { quoted(&Path::new(".").join(path)) } else { quoted(path) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_quoted_for_a_shell() {
        let shown = |text: &str| quoted_path(Path::new(text));
        assert_eq!(shown("in/0001.png"), "in/0001.png");
        assert_eq!(shown("a b.png"), "'a b.png'");
        assert_eq!(shown("it's.png"), r"'it'\''s.png'");
        assert_eq!(shown("-x.png"), "./-x.png");
        assert_eq!(shown("$(x)*"), "'$(x)*'");
    }
}
