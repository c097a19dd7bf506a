//! The flags of housekeeping, and the limits that keep a disturbed line from being flooded by events and answers.

use crate::packet::OVERHEAD;

/// Warnings that are sent at once. After them, one is sent in [`WARNING_US`].
const WARNINGS: u8 = 8;
/// A warning has 31 bytes: one a second takes 0.3 % of a line with 115 200 baud.
const WARNING_US: u64 = 1_000_000;
/// Bytes of answers that do not need bytes on the line before them. A longer answer than its telecommand is possible,
/// but not many of them.
const CREDIT: u16 = 1024;

/// Limits of what the line makes the computer send.
#[derive(Debug)]
pub(super) struct Limiter {
    warnings: u8,
    since_us: u64,
    credit: u16,
}

impl Limiter {
    pub(super) const fn new() -> Self {
        Self { warnings: WARNINGS, since_us: 0, credit: CREDIT }
    }

    /// Counts bytes that arrived: answers may have as many bytes.
    pub(super) fn add_received(&mut self, bytes: u16) {
        // Not more than at the start, because a long exchange would otherwise pay for a flood.
        self.credit = self.credit.saturating_add(bytes).min(CREDIT);
    }

    /// Returns whether an answer with this many bytes of user data may be sent, and counts it.
    pub(super) fn allows_answer(&mut self, user_bytes: usize) -> bool {
        let rest = self.credit.checked_sub((OVERHEAD + user_bytes) as u16);
        self.credit = rest.unwrap_or(self.credit);
        rest.is_some()
    }

    /// Counts an answer that is sent in any case.
    pub(super) fn charge_answer(&mut self, user_bytes: usize) {
        self.credit = self.credit.saturating_sub((OVERHEAD + user_bytes) as u16);
    }

    /// Returns whether a warning may be sent now, and counts it.
    pub(super) fn allows_warning(&mut self, now_us: u64) -> bool {
        let waited_us = now_us.saturating_sub(self.since_us);
        // A division of 64 bits takes long on a small processor, and there may be a warning for every few bytes.
        if waited_us >= WARNING_US {
            let passed = waited_us / WARNING_US;
            self.warnings = self.warnings.saturating_add(u8::try_from(passed).unwrap_or(WARNINGS)).min(WARNINGS);
            // Whole seconds, so that the rest of a second counts for the next warning.
            self.since_us += passed * WARNING_US;
        }
        let rest = self.warnings.checked_sub(1);
        self.warnings = rest.unwrap_or(0);
        rest.is_some()
    }
}

/// Bits of `flags` in housekeeping.
pub(super) const NOT_STORED: u8 = 1;
pub(super) const ARMED: u8 = 2;
pub(super) const LIFTED_OFF: u8 = 4;
pub(super) const CAMERA_SILENT: u8 = 8;
pub(super) const STAGED: u8 = 16;
