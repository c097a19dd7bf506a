//! Notices that the camera sends no pictures any more.

use crate::board::Picture;

/// Longest wait for a picture while the period is not known well yet.
const FIRST_US: u64 = 2_000_000;
/// Shortest wait: what follows the event, housekeeping and other warnings, comes at most once a second.
// One and a half periods alone are 25 ms at 60 pictures a second, and an operating system may pause for longer.
const LEAST_US: u64 = 1_000_000;
/// Number of intervals that the mean period is taken over. One early or late picture moves it little.
// The last interval alone was used before. With pictures a fifth of a period early or late it can be 0.6 periods, and
// one and a half times 0.6 is shorter than the wait for a picture in time.
const MEAN_OF: u64 = 8;

/// The time and the period of the pictures.
#[derive(Debug)]
pub(super) struct CameraWatch {
    /// Time when the last picture was taken, or when the wait for pictures began.
    waiting_since_us: u64,
    last_exposure_us: Option<u64>,
    /// Mean time from picture to picture; 0 as long as there is none.
    period_us: u64,
    /// Number of intervals in the mean.
    intervals: u64,
    is_silent: bool,
}

impl CameraWatch {
    pub(super) const fn new() -> Self {
        Self { waiting_since_us: 0, last_exposure_us: None, period_us: 0, intervals: 0, is_silent: false }
    }

    /// Begins to wait for pictures.
    pub(super) fn start(&mut self, now_us: u64) {
        *self = Self { waiting_since_us: now_us, ..Self::new() };
    }

    /// Takes note of a picture. The period is the mean time from exposure to exposure, also if pictures were lost in
    /// between. An interval that is far from this mean begins a new one: the rate of the camera was changed.
    pub(super) fn note(&mut self, picture: &Picture, now_us: u64) {
        let since_us = self.last_exposure_us.and_then(|last| picture.exposure_us.checked_sub(last)).unwrap_or(0);
        // A plain division would be a panic path of the flight image.
        // Lost pictures count, because the camera took them: the computer was late.
        let interval_us = since_us.checked_div(u64::from(picture.lost).saturating_add(1));
        self.add_interval(interval_us.unwrap_or(0));
        self.last_exposure_us = Some(picture.exposure_us);
        (self.waiting_since_us, self.is_silent) = (now_us, false);
    }

    fn add_interval(&mut self, interval_us: u64) {
        // A mean over two rates would be the period of neither.
        if interval_us == 0 || interval_us.abs_diff(self.period_us) > self.period_us / 2 {
            (self.period_us, self.intervals) = (interval_us, u64::from(interval_us > 0));
            return;
        }
        self.intervals = (self.intervals + 1).clamp(1, MEAN_OF);
        let share_us = |us: u64| us.checked_div(self.intervals).unwrap_or(0);
        self.period_us = self.period_us - share_us(self.period_us) + share_us(interval_us);
    }

    /// Returns the time since the last picture when it becomes longer than one and a half periods and a second.
    pub(super) fn becomes_silent(&mut self, now_us: u64) -> Option<u64> {
        let waited_us = now_us.saturating_sub(self.waiting_since_us);
        let least_us = if self.intervals < MEAN_OF { FIRST_US } else { LEAST_US };
        // One and a half periods, so that a picture may be a fifth late, and the event of a slow camera comes within
        // two.
        let longest_us = least_us.max(self.period_us.saturating_add(self.period_us / 2));
        if self.is_silent || waited_us <= longest_us {
            return None;
        }
        // Reported once, because a dead camera would otherwise send an event in every turn.
        self.is_silent = true;
        Some(waited_us)
    }

    pub(super) fn is_silent(&self) -> bool {
        self.is_silent
    }
}
