//! The pictures of one epoch, until all heads have theirs.

use hzn_core::rig::MOST_HEADS;
use hzn_core::status::Status;

use super::head_board::HeadAnswer;

/// The answers of the heads whose pictures belong together.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pending {
    pub(super) heads: [Option<HeadAnswer>; MOST_HEADS],
    /// The last checksum of each head.
    checksums: [Option<u32>; MOST_HEADS],
    /// Heads whose picture repeats another one.
    pub(super) repeated: u8,
    /// Latest exposure of the epoch before.
    closed_us: Option<u64>,
}

/// What becomes of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Place {
    /// It belongs to this epoch.
    Here,
    /// It begins the next epoch.
    Next,
    /// Its epoch is over.
    Late,
}

impl Pending {
    pub(super) const NONE: Self =
        Self { heads: [None; MOST_HEADS], checksums: [None; MOST_HEADS], repeated: 0, closed_us: None };

    /// Returns the earliest and the latest exposure; `None` if no head has a picture.
    fn span_us(&self) -> Option<(u64, u64)> {
        let times = || self.heads.iter().flatten().map(|head| head.exposure_us);
        Some((times().min()?, times().max()?))
    }

    /// Returns the earliest exposure.
    pub(super) fn opened_us(&self) -> Option<u64> {
        self.span_us().map(|(first, _)| first)
    }

    /// Returns where a picture of head `k` belongs. The exposures of an epoch are at most `sync_us` apart.
    pub(super) fn place(&self, k: usize, exposure_us: u64, sync_us: u64) -> Place {
        let is_over = self.closed_us.is_some_and(|closed| exposure_us <= closed);
        let Some((first, last)) = self.span_us() else { return if is_over { Place::Late } else { Place::Here } };
        let is_taken = self.heads.get(k).is_some_and(Option::is_some);
        if is_over || exposure_us.saturating_add(sync_us) < last {
            Place::Late
        } else if is_taken || exposure_us > first.saturating_add(sync_us) {
            Place::Next
        } else {
            Place::Here
        }
    }

    /// Adds the picture of head `k`.
    pub(super) fn add(&mut self, k: usize, answer: HeadAnswer) {
        let is_old = |checksum: &u32| self.checksums.get(k).is_some_and(|old| *old == Some(*checksum));
        let is_of_another = |checksum: &u32| self.heads.iter().flatten().any(|other| other.checksum == Some(*checksum));
        if answer.checksum.as_ref().is_some_and(|checksum| is_old(checksum) || is_of_another(checksum)) {
            self.repeated |= 1 << k;
        }
        if let (Some(place), Some(checksum)) = (self.heads.get_mut(k), self.checksums.get_mut(k)) {
            (*place, *checksum) = (Some(answer), answer.checksum);
        }
    }

    /// Ends the epoch and returns it.
    pub(super) fn close(&mut self) -> Self {
        let closed_us = self.span_us().map(|(_, last)| last).or(self.closed_us);
        let epoch = *self;
        *self = Self { closed_us, checksums: self.checksums, ..Self::NONE };
        epoch
    }

    /// Returns the heads that have a picture.
    pub(super) fn seen(&self) -> u8 {
        self.heads.iter().enumerate().fold(0, |set, (k, head)| set | u8::from(head.is_some()) << k)
    }

    /// Returns the status of the heads if they agree, as for an epoch in which none has an answer.
    pub(super) fn status(&self) -> Status {
        let mut statuses = self.heads.iter().flatten().map(|head| head.status);
        let first = statuses.next().filter(|status| *status != Status::Ok);
        first.filter(|first| statuses.all(|other| other == *first)).unwrap_or(Status::NoLimb)
    }
}
