//! The state of the work on the whole sequence in the background.

use std::time::Instant;

use crate::work::background::Background;

/// Version numbers of the session and of the sensor that it is compared with.
pub(in crate::ui) type Versions = (Option<u64>, Option<u64>);

/// The state of the work on the whole sequence in the background.
#[derive(Debug, Default)]
pub(in crate::ui) struct SequenceWork {
    /// Work in progress.
    pub(in crate::ui) running: Option<Background>,
    /// Versions that are processed or being processed.
    pub(in crate::ui) wanted: Versions,
    /// Versions whose results are complete.
    pub(in crate::ui) complete: Versions,
    /// Start of the work, a moment after the last change.
    pub(in crate::ui) due: Option<Instant>,
    /// The user stopped the work; it starts again with the next change.
    pub(in crate::ui) stopped: bool,
}
