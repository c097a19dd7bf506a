//! The begin of a run over a rig.

use super::levels::Levels;
use crate::engine::Turns;

/// Where a run over a rig begins, with what it knows of the epochs before. The default is the first epoch.
#[derive(Debug, Clone, Default)]
pub struct Start {
    /// The number of the first epoch.
    pub(super) epoch: u64,
    /// The turns of each head; empty at the begin of a sequence.
    pub(super) turns: Vec<Turns>,
    pub(super) levels: Option<Levels>,
}

impl Start {
    /// Returns the number of the first epoch.
    pub fn epoch(&self) -> u64 {
        self.epoch
    }
}
