//! The telecommand that arrives, and its acknowledgement.
//!
//! A packet that is no telecommand for this computer is counted and gets no answer, because another computer on the
//! line may own it, and because the line may return the packets of this computer.

use super::Flight;
use super::admission::Admitted;
use super::uplink::Uplink;
use crate::board::Board;
use crate::bytes::Reader;
use crate::inbox::Filled;
use crate::messages::{Acknowledge, Code, Event, Function, Housekeeping};
use crate::packet::{Apid, MAX_BYTES};

/// Most bytes that are read in a turn. More bytes wait in the memory of the serial port.
// A line that never pauses would otherwise keep the loop from its pictures and its watchdog.
pub(super) const MAX_TAKEN: usize = 1024;
/// Most work of a turn, in examined bytes: two of the longest packets. Packets inside of packets could otherwise make a
/// thousand times the work of their bytes.
pub(super) const MAX_EFFORT: usize = 2 * MAX_BYTES;

/// Returns whether the inbox is asked for a packet: one may be complete, or the line is silent, so that it is known
/// that the line pauses.
#[inline(always)]
pub(super) fn may_hold_packet(filled: Filled, is_done: bool, effort: usize) -> bool {
    filled != Filled::Full && !is_done && effort < MAX_EFFORT
}

/// A packet that was received.
enum Received {
    Broken,
    Foreign,
    /// A telecommand whose user data have this length.
    Command {
        sequence: u16,
        bytes: usize,
    },
}

impl<B: Board> Flight<'_, B> {
    /// Takes the bytes that have arrived, and handles at most one telecommand.
    // One telecommand, because writing parameters to flash may take seconds, and the watchdog is fed once a turn.
    pub(super) fn listen(&mut self) {
        let now_us = self.board.now_us();
        // Given back below, because handling a packet needs the rest of the loop.
        let Some(uplink) = self.uplink.take() else { return };
        uplink.inbox.reset_effort();
        let (mut bytes, mut is_done) = (0, false);
        loop {
            let (board, inbox) = (&mut self.board, &mut uplink.inbox);
            let most = (MAX_TAKEN - bytes).min(MAX_EFFORT.saturating_sub(inbox.effort()));
            if most == 0 {
                break;
            }
            // After a telecommand it reads on, because the time at which bytes arrive shows the pauses.
            // Without this, and with pauses that were not always noticed, 59 of 200 339 telecommands were lost.
            let (count, filled) = inbox.fill(now_us, most, is_done, || board.receive());
            bytes += count;
            while may_hold_packet(filled, is_done, uplink.inbox.effort()) {
                match self.handle_packet(uplink, now_us) {
                    Some(is_command) => is_done = is_command,
                    None => break,
                }
                // Bytes have just come, so that an empty inbox cannot show a pause.
                if filled == Filled::Ready && uplink.inbox.is_empty() {
                    break;
                }
            }
            if filled != Filled::Ready {
                break;
            }
        }
        self.uplink = Some(uplink);
        self.limiter.add_received(bytes as u16);
    }

    /// Handles a packet that has arrived. Returns whether it was a telecommand; `None` if there is no packet.
    fn handle_packet(&mut self, uplink: &mut Uplink, now_us: u64) -> Option<bool> {
        let base = self.buffers.line.base();
        // The memory for packets that are sent is free now.
        let room = &mut self.buffers.line.out;
        let received = uplink.inbox.next(now_us, |packet| {
            let Some(packet) = packet else { return Received::Broken };
            if base.subject(&packet) != Some(Apid::Command) {
                return Received::Foreign;
            }
            if let Some(room) = room.get_mut(..packet.user.len()) {
                room.copy_from_slice(packet.user);
            }
            Received::Command { sequence: packet.sequence, bytes: packet.user.len() }
        })?;
        match received {
            Received::Broken => self.note_broken_packet(),
            Received::Foreign => self.state.foreign = self.state.foreign.saturating_add(1),
            Received::Command { sequence, bytes } => {
                let user = self.buffers.line.out.get(..bytes).unwrap_or_default();
                let admitted = uplink.admission.admit(&mut self.board, base, sequence, user);
                self.handle_admitted(sequence, admitted);
                return Some(true);
            }
        }
        Some(false)
    }

    pub(super) fn note_broken_packet(&mut self) {
        // No acknowledgement, because APID and sequence count of a broken packet may be wrong.
        self.state.broken = self.state.broken.saturating_add(1);
        self.send_event(Event::CommandRejected, Code::Broken as u32, 0);
    }

    /// Carries out and acknowledges a telecommand, whose user data are in the memory for packets that are sent.
    #[inline(never)]
    fn handle_command(&mut self, sequence: u16, bytes: usize) {
        // The data are copied, because the command may use every buffer.
        let user = self.buffers.line.out;
        let mut from = Reader::new(user.get(..bytes).unwrap_or_default());
        let number = from.u8().unwrap_or(0);
        self.detail = 0;
        let code = match Function::from_number(number) {
            // This is asked first, so that a replay changes nothing.
            _ if !self.is_in_sequence(sequence) => {
                // The sender learns from the refusal which count comes next.
                self.refuse(Code::Sequence, self.recovery.last_sequence().unwrap_or(0))
            }
            Some(function) => {
                // It counts even if it is refused below, because its replay could be allowed later, in another mode.
                let now_us = self.board.now_us();
                self.recovery.note_sequence(&mut self.board, sequence, now_us);
                // A telecommand may copy what it does not change, into a new intact copy and into permanent memory.
                self.check_memory(None);
                self.carry_out(function, &mut from)
            }
            None => Code::Unknown,
        };
        self.acknowledge(number, sequence, code);
        // A new base is valid from the next packet on, so that the acknowledgement comes from the old one.
        self.buffers.line.set_base(self.operations.get().base());
    }

    /// Handles a telecommand whose sender was looked at. Its user data are in the memory for packets that are sent.
    pub(super) fn handle_admitted(&mut self, sequence: u16, admitted: Admitted) {
        match admitted {
            Admitted::Taken(bytes) => self.handle_command(sequence, bytes),
            Admitted::Anonymous => self.answer_anonymous(sequence),
            Admitted::Refused(code) => self.refuse_stranger(sequence, code),
        }
    }

    /// Carries out `ping` or `report` of somebody without a key. Its sequence count does not count: a stranger could
    /// otherwise move the window away from that of the operator.
    fn answer_anonymous(&mut self, sequence: u16) {
        let number = self.buffers.line.out.first().copied().unwrap_or(0);
        // A stranger could otherwise fill the line with answers.
        if !self.may_answer(Acknowledge::BYTES + Housekeeping::BYTES) {
            return;
        }
        self.detail = 0;
        let code = match Function::from_number(number) {
            Some(function) => self.carry_out(function, &mut Reader::new(&[])),
            None => Code::Unknown,
        };
        self.acknowledge(number, sequence, code);
    }

    /// Refuses a telecommand that is not authenticated. Nothing but a counter changes.
    fn refuse_stranger(&mut self, sequence: u16, code: Code) {
        let number = self.buffers.line.out.first().copied().unwrap_or(0);
        self.detail = 0;
        self.acknowledge(number, sequence, code);
    }

    /// Returns whether a sequence count is within the window after that of the last telecommand that was taken.
    fn is_in_sequence(&self, sequence: u16) -> bool {
        let window = self.operations.get().sequence_window;
        // After power-on no count is known, so that the first telecommand is taken with any count.
        let Some(last) = self.recovery.last_sequence().filter(|_| window > 0) else { return true };
        let ahead = sequence.wrapping_sub(last) & 0x3FFF;
        (1..=window).contains(&ahead)
    }

    fn acknowledge(&mut self, function: u8, sequence: u16, code: Code) {
        if matches!(code, Code::Done | Code::NotStored) {
            self.state.commands = self.state.commands.saturating_add(1);
            // This acknowledgement is never withheld, because the ground waits for it.
            self.limiter.charge_answer(Acknowledge::BYTES);
        } else {
            self.state.rejected = self.state.rejected.saturating_add(1);
            self.send_event(Event::CommandRejected, code as u32, u32::from(function));
            if !self.may_answer(Acknowledge::BYTES) {
                return;
            }
        }
        let record = Acknowledge { function, sequence, code: code as u8, detail: self.detail };
        self.send(Apid::Acknowledge, |out| record.write(out));
    }
}
