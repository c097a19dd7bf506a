//! The line to the computer: whole packets from its bytes, and the gate before its telecommands.

use super::gate::Gate;
use crate::inbox::Inbox;

/// What belongs to the line to the computer.
#[derive(Debug)]
pub(super) struct Uplink {
    pub(super) inbox: Inbox,
    pub(super) gate: Gate,
}

impl Uplink {
    /// Makes an uplink of all zeros.
    pub(super) const fn new() -> Self {
        Self { inbox: Inbox::new(), gate: Gate::new() }
    }
}
