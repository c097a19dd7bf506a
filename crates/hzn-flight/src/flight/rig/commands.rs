//! The telecommands of a rig: those to one head, and those to all.

use hzn_core::Prior;
use hzn_core::rig::MOST_HEADS;

use super::{Rig, RigBoard};
use crate::attitude::turned_back;
use crate::board::Board;
use crate::bytes::Reader;
use crate::flight::admission::Admitted;
use crate::flight::attitude::{TimedAttitude, read_attitude};
use crate::flight::navigation::{Values, read_navigation, read_prior};
use crate::flight::{Flight, listen};
use crate::messages::{Acknowledge, Code, Function, Housekeeping, Mode};
use crate::packet::{Apid, ApidBase, MAX_BYTES};

/// A packet that was received.
enum Received {
    Broken,
    Foreign,
    /// A telecommand to this base, whose user data have this length.
    Command {
        base: ApidBase,
        sequence: u16,
        bytes: usize,
    },
}

impl<B: RigBoard, const N: usize> Rig<'_, '_, B, N> {
    /// Takes the bytes that have arrived, and handles at most one telecommand, like the loop of one head.
    pub(super) fn listen(&mut self) {
        let now_us = self.now_us();
        self.buffers.uplink.inbox.reset_effort();
        let (mut bytes, mut is_done) = (0, false);
        loop {
            let (board, inbox) = (&mut self.board, &mut self.buffers.uplink.inbox);
            let most = (listen::MAX_TAKEN - bytes).min(listen::MAX_EFFORT.saturating_sub(inbox.effort()));
            if most == 0 {
                break;
            }
            let receive = || board.as_deref_mut()?.receive();
            let (count, filled) = inbox.fill(now_us, most, is_done, receive);
            bytes += count;
            while listen::may_hold_packet(filled, is_done, self.buffers.uplink.inbox.effort()) {
                match self.handle_packet(now_us) {
                    Some(is_command) => is_done = is_command,
                    None => break,
                }
                // Bytes have just come, so that an empty inbox cannot show a pause.
                if filled == crate::inbox::Filled::Ready && self.buffers.uplink.inbox.is_empty() {
                    break;
                }
            }
            if filled != crate::inbox::Filled::Ready {
                break;
            }
        }
        for flight in &mut self.heads.loops {
            flight.limiter.add_received(bytes as u16);
        }
    }

    /// Handles a packet that has arrived. Returns whether it was a telecommand; `None` if there is no packet.
    fn handle_packet(&mut self, now_us: u64) -> Option<bool> {
        let heads = self.heads.loops.iter().map(|flight| flight.buffers.line.base());
        let mut bases = [None; 1 + MOST_HEADS];
        for (place, base) in bases.iter_mut().zip(core::iter::once(self.setup.base).chain(heads)) {
            *place = Some(base);
        }
        let super::RigBuffers { line, uplink } = &mut *self.buffers;
        let room = &mut line.out;
        let received = uplink.inbox.next(now_us, |packet| {
            let Some(packet) = packet else { return Received::Broken };
            let is_of = |base: &&ApidBase| base.subject(&packet) == Some(Apid::Command);
            let Some(base) = bases.iter().flatten().find(is_of) else { return Received::Foreign };
            if let Some(room) = room.get_mut(..packet.user.len()) {
                room.copy_from_slice(packet.user);
            }
            Received::Command { base: *base, sequence: packet.sequence, bytes: packet.user.len() }
        })?;
        match received {
            // Nobody knows whose packet it was, so that the first head counts it.
            Received::Broken => {
                self.with_head(0, Flight::note_broken_packet);
            }
            Received::Foreign => {
                self.with_head(0, |first| first.state.foreign = first.state.foreign.saturating_add(1));
            }
            Received::Command { base, sequence, bytes } => {
                let user = line.out.get(..bytes).unwrap_or_default();
                // One for all heads, so that one counter belongs to a key.
                let admitted = match self.board.as_deref_mut() {
                    Some(board) => uplink.admission.admit(board, base, sequence, user),
                    None => Admitted::Refused(Code::Closed),
                };
                if base == self.setup.base {
                    self.handle_command(sequence, admitted);
                } else {
                    self.pass_on(base, sequence, admitted);
                }
                return Some(true);
            }
        }
        Some(false)
    }

    /// Lets the head with this base carry out and acknowledge a telecommand.
    fn pass_on(&mut self, base: ApidBase, sequence: u16, admitted: Admitted) {
        let is_meant = |flight: &Flight<'_, _>| flight.buffers.line.base() == base && flight.mode != Mode::ShutDown;
        let Some(k) = self.heads.loops.iter().position(is_meant) else { return };
        let room = self.buffers.line.out;
        let mut taken = [Some(self.setup.base); 1 + MOST_HEADS];
        for (j, place) in taken.iter_mut().skip(1).enumerate() {
            *place = self.heads.loops.get(j).filter(|_| j != k).map(|other| other.buffers.line.base());
        }
        self.with_head(k, |flight| {
            flight.board.taken_bases = taken;
            flight.check_operations();
            flight.buffers.line.out = room;
            flight.handle_admitted(sequence, admitted);
        });
    }

    /// Carries out and acknowledges a telecommand to the rig.
    #[inline(never)]
    fn handle_command(&mut self, sequence: u16, admitted: Admitted) {
        let bytes = match admitted {
            Admitted::Taken(bytes) => bytes,
            Admitted::Anonymous | Admitted::Refused(_) => 1,
        };
        let user: [u8; MAX_BYTES] = self.buffers.line.out;
        let mut from = Reader::new(user.get(..bytes).unwrap_or_default());
        let number = from.u8().unwrap_or(0);
        let window = self.loops().next().map_or(0, |first| first.operations.get().sequence_window);
        // The first head keeps the count of the rig for the time after a reset.
        let last_sequence = self.loops().next().and_then(|first| first.recovery.rig_sequence());
        let ahead = last_sequence.map(|last| sequence.wrapping_sub(last) & 0x3FFF);
        let is_replay = window > 0 && ahead.is_some_and(|ahead| !(1..=window).contains(&ahead));
        let (code, detail) = match (admitted, Function::from_number(number)) {
            (Admitted::Refused(code), _) => (code, 0),
            // Its sequence count does not count, see `Flight::answer_anonymous`.
            (Admitted::Anonymous, Some(function)) => {
                let bytes = Acknowledge::BYTES + N * Housekeeping::BYTES;
                if self.with_head(0, |first| first.may_answer(bytes)) != Some(true) {
                    return;
                }
                self.carry_out(function, from)
            }
            _ if is_replay => (Code::Sequence, last_sequence.unwrap_or(0)),
            (_, Some(function)) => {
                let now_us = self.now_us();
                // Before it is carried out: after a reset in the middle its replay is refused, too.
                self.with_head(0, |first| first.recovery.note_rig_sequence(&mut first.board, sequence, now_us));
                self.carry_out(function, from)
            }
            (_, None) => (Code::Unknown, 0),
        };
        let record = Acknowledge { function: number, sequence, code: code as u8, detail };
        let may_answer =
            code == Code::Done || self.with_head(0, |first| first.may_answer(Acknowledge::BYTES)) == Some(true);
        if may_answer {
            let now_us = self.now_us();
            self.send(now_us, Apid::Acknowledge, |out| record.write(out));
        }
    }

    /// Lets each head carry out a telecommand. Returns the first refusal, or that all have done it.
    fn carry_out(&mut self, function: Function, from: Reader<'_>) -> (Code, u16) {
        match function {
            Function::Ping if from.rest().is_empty() => return (Code::Done, 0),
            Function::SetParameters
            | Function::TryParameters
            | Function::StageParameters
            | Function::CommitParameters
            | Function::ReadParameters
            | Function::DumpEdges => return (Code::OneHead, 0),
            _ => {}
        }
        let mut outcome = (Code::Done, 0);
        for k in 0..N {
            let carry_out = |flight: &mut Flight<'_, _>| {
                let is_on = flight.mode != Mode::ShutDown;
                is_on.then(|| (flight.carry_out_for_vehicle(function, from), flight.detail))
            };
            if let Some(own) = self.with_head(k, carry_out).flatten().filter(|_| outcome.0 == Code::Done) {
                outcome = own;
            }
        }
        outcome
    }
}

impl<B: Board> Flight<'_, B> {
    /// Carries out a telecommand whose rate, attitude and Sun are in the axes of the vehicle.
    fn carry_out_for_vehicle(&mut self, function: Function, mut from: Reader<'_>) -> Code {
        self.detail = 0;
        // A telecommand may copy what it does not change.
        self.check_operations();
        self.check_memory(None);
        let now_us = self.board.now_us();
        let (from, q) = (&mut from, self.vehicle_from_camera());
        let clock = &self.buffers.line.clock;
        let values = match function {
            Function::SetKnown => read_prior(from),
            Function::Navigate => read_navigation(from, clock, now_us),
            Function::SetAttitude => {
                let read = read_attitude(from, clock, now_us);
                let seen = |it: TimedAttitude| Some(TimedAttitude { values: it.values.seen_by(q?), ..it });
                // A head without a mount cannot use the attitude, and the one that it has would be out of date.
                return self.set_attitude(read.map(|attitude| attitude.and_then(seen)));
            }
            _ => return self.carry_out(function, from),
        };
        let turned = |values: Values| {
            let rate_rad_s = values.prior.rate_rad_s.zip(q).map(|(rate, q)| turned_back(q, rate));
            Values { prior: Prior { rate_rad_s, ..values.prior }, ..values }
        };
        self.set_known(values.map(turned))
    }
}
