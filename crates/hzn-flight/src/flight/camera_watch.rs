//! Notices that the camera sends no pictures any more.

use crate::board::Picture;

/// Longest wait for the first two pictures, whose period is not known yet.
const FIRST_US: u64 = 2_000_000;

/// The time and the period of the pictures.
#[derive(Debug)]
pub(super) struct CameraWatch {
    /// Time when the last picture was taken, or when the wait for pictures began.
    waiting_since_us: u64,
    last_exposure_us: Option<u64>,
    period_us: Option<u64>,
    is_silent: bool,
}

impl CameraWatch {
    pub(super) const fn new() -> Self {
        Self { waiting_since_us: 0, last_exposure_us: None, period_us: None, is_silent: false }
    }

    /// Begins to wait for pictures.
    pub(super) fn start(&mut self, now_us: u64) {
        *self = Self { waiting_since_us: now_us, ..Self::new() };
    }

    /// Takes note of a picture. The period is the time from exposure to exposure, also if pictures were lost in
    /// between.
    pub(super) fn note(&mut self, picture: &Picture, now_us: u64) {
        let since = self.last_exposure_us.and_then(|last| picture.exposure_us.checked_sub(last));
        let pictures = u64::from(picture.lost).saturating_add(1);
        self.period_us = since.and_then(|since| since.checked_div(pictures)).filter(|&period| period > 0);
        self.last_exposure_us = Some(picture.exposure_us);
        (self.waiting_since_us, self.is_silent) = (now_us, false);
    }

    /// Returns the time since the last picture when it becomes longer than one and a half periods.
    pub(super) fn becomes_silent(&mut self, now_us: u64) -> Option<u64> {
        let waited_us = now_us.saturating_sub(self.waiting_since_us);
        let longest_us = self.period_us.map_or(FIRST_US, |period| period + period / 2);
        if self.is_silent || waited_us <= longest_us {
            return None;
        }
        self.is_silent = true;
        Some(waited_us)
    }

    pub(super) fn is_silent(&self) -> bool {
        self.is_silent
    }
}
