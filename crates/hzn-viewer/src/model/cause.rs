//! Why a picture has no answer, in one word, and the groups of pictures with the same cause.

use std::collections::BTreeMap;

use hzn_core::Report;
use hzn_core::status::Status;
use hzn_core::verdict::Verdict;
use hzn_mcap::Row;
use hzn_run::explain;
use hzn_run::unread::Unread;

/// Cause of the status of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cause {
    /// Status of the picture.
    pub status: Status,
    /// Reason for a picture that has edges but no answer, or that is unreadable.
    pub reason: Option<Reason>,
}

/// Reason why a picture with edges has no answer, or why a picture could not be processed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reason {
    /// Otsu's threshold shows a limb, and the threshold in use does not.
    Level,
    /// The verdict of the best candidate.
    Verdict(Verdict),
    /// Why the picture is unreadable.
    Unread(Unread),
}

impl Reason {
    /// Returns the word on the screen.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Level => "threshold",
            Self::Verdict(verdict) => verdict.name(),
            Self::Unread(unread) => unread.name(),
        }
    }
}

impl Cause {
    /// Returns the cause of a result. `otsu_is_better` is true if Otsu's threshold, which is not in use, gives an
    /// answer or shows a limb of another size.
    pub fn from_report(report: &Report<f64>, otsu_is_better: bool) -> Self {
        let reason = match report.status {
            Status::Ok => None,
            _ if otsu_is_better => Some(Reason::Level),
            _ => explain::best_candidate(report).map(|best| Reason::Verdict(best.verdict)),
        };
        Self { status: report.status, reason }
    }
    /// Returns the cause of a result in a file. The detail of a row lists verdicts without inliers.
    pub fn from_row(row: &Row) -> Self {
        if row.status == Status::Unreadable {
            return Self { status: row.status, reason: Some(Reason::Unread(Unread::of_detail(&row.detail))) };
        }
        let names = row.detail.split_once(": ").into_iter().flat_map(|(_, verdicts)| verdicts.split(", "));
        let verdicts = names.filter_map(|name| Verdict::ALL.iter().find(|v| v.name() == name).copied());
        let refused = row.status != Status::Ok;
        Self { status: row.status, reason: explain::best_verdict(verdicts).map(Reason::Verdict).filter(|_| refused) }
    }
    /// Returns true if the picture has an edge, which may be the limb.
    pub fn has_edge(&self) -> bool {
        self.status == Status::Ok || matches!(self.reason, Some(Reason::Level | Reason::Verdict(_)))
    }
    /// Returns true if this picture belongs to a group.
    pub fn is_in(&self, group: &Group) -> bool {
        self.status == group.status && (group.reason.is_none() || group.reason == self.reason)
    }
}

/// A group of pictures: a status, or one reason of a status.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Group {
    /// Status of the pictures.
    pub status: Status,
    /// Reason of the pictures; `None` for all reasons.
    pub reason: Option<Reason>,
}

/// Number of pictures with a status, in all and by reason, the most frequent reason first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Counted {
    /// Status.
    pub status: Status,
    /// Number of pictures.
    pub count: usize,
    /// Reasons with their numbers of pictures.
    pub reasons: Vec<(Reason, usize)>,
}

/// Counts pictures by status and reason, in the order of the statuses.
pub fn count(causes: impl Iterator<Item = Cause>) -> Vec<Counted> {
    let mut by_status: BTreeMap<u8, Counted> = BTreeMap::new();
    for Cause { status, reason } in causes {
        let entry = by_status.entry(status as u8).or_insert(Counted { status, count: 0, reasons: Vec::new() });
        entry.count += 1;
        let Some(reason) = reason else { continue };
        match entry.reasons.iter_mut().find(|(r, _)| *r == reason) {
            Some((_, n)) => *n += 1,
            None => entry.reasons.push((reason, 1)),
        }
    }
    for counted in by_status.values_mut() {
        counted.reasons.sort_by_key(|(reason, n)| (std::cmp::Reverse(*n), reason.name()));
    }
    by_status.into_values().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use hzn_mcap::RowMeta;

    #[test]
    fn pictures_are_counted_by_status_and_reason() {
        let cause = |status, reason| Cause { status, reason };
        let short = Some(Reason::Verdict(Verdict::ShortArc));
        let causes = [
            cause(Status::Rejected, short),
            cause(Status::Ok, None),
            cause(Status::Rejected, Some(Reason::Level)),
            cause(Status::Rejected, Some(Reason::Level)),
            cause(Status::NoLimb, None),
        ];
        let counted = count(causes.into_iter());
        let words: Vec<_> = counted.iter().map(|c| (c.status.name(), c.count, c.reasons.len())).collect();
        assert_eq!(words, [("ok", 1, 0), ("no-limb", 1, 0), ("rejected", 3, 2)]);
        assert_eq!(counted[2].reasons[0], (Reason::Level, 2));
        let group = Group { status: Status::Rejected, reason: short };
        assert!(causes[0].is_in(&group) && !causes[2].is_in(&group));
        assert!(causes[2].is_in(&Group { reason: None, ..group }) && !causes[1].is_in(&group));
    }

    #[test]
    fn a_row_of_a_file_tells_the_verdict_of_its_best_edge() {
        let meta = RowMeta { index: 0, file: "a".into(), time_s: None, body: "earth".into(), altitude_km: None };
        let mut row = Row::unprocessed(&meta, Status::Rejected, "ended at gates: half-angle, short-arc");
        assert_eq!(Cause::from_row(&row).reason, Some(Reason::Verdict(Verdict::HalfAngle)));
        row.detail = "ended at gates in 2 looks: no-consensus, short-arc, half-angle, no-consensus".into();
        assert_eq!(Cause::from_row(&row).reason, Some(Reason::Verdict(Verdict::HalfAngle)));
        row.detail = "ended at contour".into();
        assert_eq!(Cause::from_row(&row).reason, None);
        let unread = Row::unprocessed(&meta, Status::Unreadable, hzn_run::unread::other_size([4, 3], [8, 6]));
        assert_eq!(Cause::from_row(&unread).reason.map(Reason::name), Some("wrong size"));
    }
}
