//! The state of a sequence that grows while it is shown.

use std::time::{Duration, Instant};

/// Most pictures that are kept: 15 minutes at ten pictures a second. The oldest ones are forgotten, so that the memory
/// stays the same however long a flight is followed.
const KEPT: usize = 9_000;
/// Part of the pictures that is forgotten at once, because the results of all others move.
const AT_ONCE: usize = 10;
/// Age of the newest picture from which it is marked as old.
pub(super) const OLD: Duration = Duration::from_secs(10);

/// The state of a sequence that grows while it is shown.
#[derive(Debug)]
pub(super) struct Follow {
    /// Further pictures are expected.
    pub(super) is_open: bool,
    /// The newest picture is shown as soon as it is there.
    pub(super) jumps: bool,
    /// Picture that was shown as the newest one. If another one is shown, the user went there.
    pub(super) shown: Option<usize>,
    /// Time at which the newest picture was found.
    pub(super) newest: Option<Instant>,
    /// Number of pictures that were forgotten.
    pub(super) forgotten: usize,
    /// Start of the last work in the background.
    pub(super) worked: Option<Instant>,
    /// Most pictures that are kept.
    pub(super) most: usize,
}

impl Default for Follow {
    fn default() -> Self {
        let most = KEPT;
        Self { is_open: false, jumps: false, shown: None, newest: None, forgotten: 0, worked: None, most }
    }
}

impl Follow {
    /// Returns the number of the oldest pictures to forget.
    pub(super) fn surplus(&self, count: usize) -> usize {
        if self.is_open && count > self.most { count - self.most + self.most / AT_ONCE } else { 0 }
    }

    /// Returns the time since the newest picture was found.
    pub(super) fn age(&self) -> Option<Duration> {
        Some(self.newest?.elapsed())
    }
}
