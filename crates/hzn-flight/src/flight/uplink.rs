//! The line to the computer: whole packets from its bytes, and the choice of the telecommands that are admitted.

use super::admission::Admission;
use crate::inbox::Inbox;

/// What belongs to the line to the computer.
#[derive(Debug)]
pub(super) struct Uplink {
    pub(super) inbox: Inbox,
    pub(super) admission: Admission,
}

impl Uplink {
    /// Makes an uplink of all zeros.
    pub(super) const fn new() -> Self {
        Self { inbox: Inbox::new(), admission: Admission::new() }
    }
}
