//! Results of other commands that belong to the sequence.

use crossbeam_channel::Receiver;

use crate::model::{LensResiduals, Navigation};
use crate::work::companion::Companion;

/// Results of other commands that belong to the sequence.
#[derive(Default)]
pub(in crate::ui) struct Companions {
    /// Results of `hzn fuse`.
    pub(in crate::ui) navigation: Option<Navigation>,
    /// Residuals of a lens calibration.
    pub(in crate::ui) residuals: Option<LensResiduals>,
    /// Results from a folder that may also have results of other pictures.
    pub(super) doubtful: Option<Navigation>,
    /// Files that are being read.
    pub(super) reading: Vec<Receiver<Companion>>,
}

impl Companions {
    /// Returns true while files are being read.
    pub(in crate::ui) fn is_reading(&self) -> bool {
        !self.reading.is_empty() || self.doubtful.is_some()
    }
}
