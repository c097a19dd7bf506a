//! Sends housekeeping when its time has come, and events.

use super::Flight;
use super::reports::{ARMED, CAMERA_SILENT, LIFTED_OFF, NOT_STORED, STAGED};
use crate::board::Board;
use crate::bytes::Writer;
use crate::messages::{Event, EventRecord, Severity};
use crate::packet::Apid;

impl<B: Board> Flight<'_, B> {
    /// Sends housekeeping if its time has come.
    pub(super) fn report_by_time(&mut self, now_us: u64) {
        let period_us = u64::from(self.operations.get().housekeeping_s) * 1_000_000;
        if now_us.saturating_sub(self.housekeeping_us) >= period_us {
            // Modes without pictures have no other comparison, and a second flip in the same place would hide the
            // first.
            self.check_memory(None);
            self.send_housekeeping();
        }
    }

    pub(super) fn send_housekeeping(&mut self) {
        let now_us = self.board.now_us();
        // Both limits start again, so that pictures and time together do not send twice as often.
        (self.since_housekeeping, self.housekeeping_us) = (0, now_us);
        let bit = |is_set: bool, bit: u8| if is_set { bit } else { 0 };
        let state = &mut self.state;
        state.mode = self.mode as u8;
        state.stack_bytes = self.board.stack_bytes();
        state.version = crate::VERSION;
        state.flags = bit(self.is_not_stored, NOT_STORED)
            | bit(self.recovery.is_armed(now_us), ARMED)
            | bit(self.recovery.has_lifted_off(), LIFTED_OFF)
            | bit(self.camera.is_silent(), CAMERA_SILENT)
            | bit(self.staged > 0, STAGED);
        state.last_sequence = self.recovery.last_sequence().unwrap_or(u16::MAX);
        state.since_lift_off_s = self.recovery.since_lift_off_s(now_us).unwrap_or(u32::MAX);
        state.clock = self.buffers.line.clock.state(now_us);
        let state = self.state;
        self.send(Apid::Housekeeping, |out| state.write(out));
    }

    /// Sends an event. There may be too many warnings; then they are counted.
    pub(super) fn send_event(&mut self, event: Event, a: u32, b: u32) {
        let now_us = self.board.now_us();
        // Noise causes this event, so it needs as many bytes on the line. Otherwise more would go out than comes in.
        let is_caused_by_line = event == Event::CommandRejected;
        // The warnings are asked first, so that one that is withheld does not use up the bytes for answers.
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

    /// Sends a packet with the time of now.
    pub(super) fn send(&mut self, apid: Apid, user: impl FnOnce(&mut Writer<'_>)) {
        let now_us = self.board.now_us();
        self.send_at(now_us, apid, user);
    }

    /// Sends a packet with a time on the board's clock.
    pub(super) fn send_at(&mut self, clock_us: u64, apid: Apid, user: impl FnOnce(&mut Writer<'_>)) {
        let line = &mut self.buffers.line;
        line.send(&mut self.board, apid, line.clock.at(clock_us), user);
    }
}
