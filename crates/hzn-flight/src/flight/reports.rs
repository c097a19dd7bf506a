//! Housekeeping and events, and the limits that keep a disturbed line from flooding itself.

use super::Flight;
use crate::board::Board;
use crate::bytes::Writer;
use crate::messages::{Event, EventRecord, Severity};
use crate::packet::{Apid, OVERHEAD};

/// Warnings that are sent at once. After them, one is sent in [`WARNING_US`].
const WARNINGS: u8 = 8;
/// A warning has 31 bytes: one a second takes 0.3 % of a line with 115 200 baud.
const WARNING_US: u64 = 1_000_000;
/// Bytes of answers that do not need bytes on the line before them. A longer answer than its telecommand is possible, but
/// not many of them.
const CREDIT: u16 = 1024;

/// Version of this crate: major, minor and patch in one byte each.
const VERSION: u32 = number(env!("CARGO_PKG_VERSION_MAJOR")) << 16
    | number(env!("CARGO_PKG_VERSION_MINOR")) << 8
    | number(env!("CARGO_PKG_VERSION_PATCH"));

const fn number(digits: &str) -> u32 {
    let mut rest = digits.as_bytes();
    let mut value = 0;
    while let [digit, after @ ..] = rest {
        value = value * 10 + (*digit - b'0') as u32;
        rest = after;
    }
    value
}

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
        self.credit = self.credit.saturating_add(bytes).min(CREDIT);
    }

    /// Returns whether an answer with this many bytes of user data may be sent, and counts it.
    fn allows_answer(&mut self, user_bytes: usize) -> bool {
        let rest = self.credit.checked_sub((OVERHEAD + user_bytes) as u16);
        self.credit = rest.unwrap_or(self.credit);
        rest.is_some()
    }

    /// Counts an answer that is sent in any case.
    pub(super) fn charge_answer(&mut self, user_bytes: usize) {
        self.credit = self.credit.saturating_sub((OVERHEAD + user_bytes) as u16);
    }

    /// Returns whether a warning may be sent now, and counts it.
    fn allows_warning(&mut self, now_us: u64) -> bool {
        let passed = now_us.saturating_sub(self.since_us) / WARNING_US;
        if passed > 0 {
            self.warnings = self.warnings.saturating_add(u8::try_from(passed).unwrap_or(WARNINGS)).min(WARNINGS);
            self.since_us += passed * WARNING_US;
        }
        let rest = self.warnings.checked_sub(1);
        self.warnings = rest.unwrap_or(0);
        rest.is_some()
    }
}

/// Bits of `flags` in housekeeping.
const NOT_STORED: u8 = 1;
const ARMED: u8 = 2;
const LIFTED_OFF: u8 = 4;
const CAMERA_SILENT: u8 = 8;
const STAGED: u8 = 16;

impl<B: Board> Flight<'_, B> {
    /// Sends housekeeping if its time has come.
    pub(super) fn report_by_time(&mut self, now_us: u64) {
        let period_us = u64::from(self.operations.housekeeping_s) * 1_000_000;
        if now_us.saturating_sub(self.housekeeping_us) >= period_us {
            self.send_housekeeping();
        }
    }

    pub(super) fn send_housekeeping(&mut self) {
        let now_us = self.board.now_us();
        (self.since_housekeeping, self.housekeeping_us) = (0, now_us);
        let bit = |is_set: bool, bit: u8| if is_set { bit } else { 0 };
        let state = &mut self.state;
        state.mode = self.mode as u8;
        state.stack_bytes = self.board.stack_bytes();
        state.version = VERSION;
        state.flags = bit(self.is_not_stored, NOT_STORED)
            | bit(self.recovery.is_armed(now_us), ARMED)
            | bit(self.recovery.has_lifted_off(), LIFTED_OFF)
            | bit(self.camera.is_silent(), CAMERA_SILENT)
            | bit(self.staged > 0, STAGED);
        state.last_sequence = self.last_sequence.unwrap_or(u16::MAX);
        state.since_lift_off_s = self.recovery.since_lift_off_s(now_us).unwrap_or(u32::MAX);
        let state = self.state;
        self.send(Apid::Housekeeping, |out| state.write(out));
    }

    /// Sends an event. There may be too many warnings; then they are counted.
    pub(super) fn send_event(&mut self, event: Event, a: u32, b: u32) {
        let now_us = self.board.now_us();
        let is_caused_by_line = event == Event::CommandRejected;
        if event.severity() == Severity::Warning && !self.limiter.allows_warning(now_us)
            || is_caused_by_line && !self.limiter.allows_answer(EventRecord::BYTES)
        {
            self.state.withheld = self.state.withheld.saturating_add(1);
            return;
        }
        let record = EventRecord { number: event as u16, severity: event.severity() as u8, a, b };
        self.send(Apid::Event, |out| record.write(out));
    }

    /// Returns whether the acknowledgement of a rejected telecommand may be sent. If not, it is counted.
    pub(super) fn may_answer(&mut self, user_bytes: usize) -> bool {
        let is_allowed = self.limiter.allows_answer(user_bytes);
        self.state.withheld = self.state.withheld.saturating_add(u32::from(!is_allowed));
        is_allowed
    }

    pub(super) fn send(&mut self, apid: Apid, user: impl FnOnce(&mut Writer<'_>)) {
        self.buffers.line.send(&mut self.board, apid, user);
    }
}
