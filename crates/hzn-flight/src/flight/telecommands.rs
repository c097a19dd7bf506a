//! Telecommands: their bytes are collected, carried out and acknowledged.

use hzn_core::{Prior, Sensor};

use super::Flight;
use crate::board::Board;
use crate::bytes::Reader;
use crate::messages::{Acknowledge, Code, Event, Function, Housekeeping, Mode};
use crate::packet::{Apid, MAX_BYTES, Packet};
use crate::parameters::{Parameters, Refused};
use crate::store;

/// A telecommand is broken if no byte arrives for this time before it is complete.
const COMMAND_TIMEOUT_US: u64 = 1_000_000;

impl<B: Board> Flight<'_, B> {
    /// Takes the bytes that have arrived, and handles at most one telecommand.
    pub(super) fn listen(&mut self) {
        let now = self.board.now_us();
        while let Some(byte) = self.board.receive() {
            self.last_byte_us = now;
            self.buffers.inbox.push(byte);
            if self.handle_command() {
                return;
            }
        }
        if self.buffers.inbox.is_waiting() {
            if self.handle_command() {
                return;
            }
            if self.buffers.inbox.is_waiting() && now.saturating_sub(self.last_byte_us) > COMMAND_TIMEOUT_US {
                self.buffers.inbox.give_up();
                self.acknowledge(0, 0, Code::Broken);
            }
        }
    }

    /// Carries out and acknowledges the telecommand that has arrived. Returns whether there was one.
    #[inline(never)]
    fn handle_command(&mut self) -> bool {
        // The packet is copied out of the inbox, because the command may use every buffer.
        let mut user = [0; MAX_BYTES];
        let next = self.buffers.inbox.next(|packet| {
            let Packet { apid, sequence, user: data, .. } = packet?;
            let room = user.get_mut(..data.len())?;
            room.copy_from_slice(data);
            Some((apid, sequence, data.len()))
        });
        match next {
            None => false,
            Some(None) => {
                self.acknowledge(0, 0, Code::Broken);
                true
            }
            Some(Some((apid, sequence, len))) => {
                let mut from = Reader::new(user.get(..len).unwrap_or_default());
                let number = from.u8().unwrap_or(0);
                let code = match Function::from_number(number) {
                    Some(function) if apid == Apid::Command as u16 => self.carry_out(function, &mut from),
                    _ => Code::Unknown,
                };
                self.acknowledge(number, sequence, code);
                true
            }
        }
    }

    fn acknowledge(&mut self, function: u8, sequence: u16, code: Code) {
        if code == Code::Done {
            self.state.commands = self.state.commands.saturating_add(1);
        } else {
            self.state.rejected = self.state.rejected.saturating_add(1);
            self.send_event(Event::CommandRejected, code as u32, u32::from(function));
        }
        let record = Acknowledge { function, sequence, code: code as u8 };
        self.send(Apid::Acknowledge, |out| record.write(out));
    }

    fn carry_out(&mut self, function: Function, from: &mut Reader<'_>) -> Code {
        match function {
            Function::SetMode => self.set_mode(from),
            Function::SetParameters => self.set_parameters(from),
            Function::ReadParameters => self.read_parameters(from),
            Function::SetKnown => self.set_prior(from),
            // The other functions have no arguments.
            Function::ProcessOnce | Function::DumpEdges | Function::ResetCounters if !from.rest().is_empty() => {
                Code::Arguments
            }
            Function::ProcessOnce if self.mode != Mode::Standby => Code::Mode,
            Function::ProcessOnce => {
                self.process_once = true;
                Code::Done
            }
            Function::DumpEdges => {
                self.dump_edges = true;
                Code::Done
            }
            Function::ResetCounters => {
                self.reset_counters();
                Code::Done
            }
        }
    }

    fn set_mode(&mut self, from: &mut Reader<'_>) -> Code {
        let Some(mode) = from.u8().and_then(Mode::from_number) else { return Code::Arguments };
        if !from.rest().is_empty() {
            return Code::Arguments;
        }
        // The operator may leave safe mode even after a failed self-check.
        self.enter_mode(mode);
        Code::Done
    }

    fn reset_counters(&mut self) {
        self.state = Housekeeping {
            self_check: self.state.self_check,
            parameter_copy: self.state.parameter_copy,
            parameter_generation: self.state.parameter_generation,
            last_status: self.state.last_status,
            ..Housekeeping::default()
        };
    }

    /// Sets the prior of the pictures that follow.
    fn set_prior(&mut self, from: &mut Reader<'_>) -> Code {
        let Some(prior) = read_prior(from) else { return Code::Arguments };
        if self.sensor.expect(&prior).is_err() {
            return Code::Refused;
        }
        self.prior = prior;
        Code::Done
    }

    fn parameters(&self) -> Parameters {
        Parameters { sensor: self.sensor.config().clone(), housekeeping_every: self.housekeeping_every }
    }

    /// Sets all parameters, or none.
    #[inline(never)]
    fn set_parameters(&mut self, from: &mut Reader<'_>) -> Code {
        let Some(count) = from.u8() else { return Code::Arguments };
        let mut parameters = self.parameters();
        for _ in 0..count {
            let (Some(id), Some(value)) = (from.u16(), from.f64()) else { return Code::Arguments };
            match parameters.set(id, value) {
                Ok(()) => {}
                Err(Refused::Unknown(_)) => return Code::UnknownParameter,
                Err(_) => return Code::Refused,
            }
        }
        if !from.rest().is_empty() {
            return Code::Arguments;
        }
        if parameters.check().is_err() {
            return Code::Refused;
        }
        let Ok(sensor) = Sensor::new(&parameters.sensor) else { return Code::Refused };
        self.sensor = sensor;
        self.housekeeping_every = parameters.housekeeping_every;
        let (copy, generation) = (self.state.parameter_copy, self.state.parameter_generation);
        match store::save(&mut self.board, &parameters, copy, generation, &mut self.buffers.table) {
            Ok((copy, generation)) => {
                (self.state.parameter_copy, self.state.parameter_generation) = (copy, generation);
                self.state.self_check &= !4;
                self.send_event(Event::Stored, u32::from(copy), generation);
                Code::Done
            }
            Err(copy) => {
                self.send_event(Event::StoreFailed, u32::from(copy), 0);
                Code::NotStored
            }
        }
    }

    #[inline(never)]
    fn read_parameters(&mut self, from: &mut Reader<'_>) -> Code {
        let Some(count) = from.u8() else { return Code::Arguments };
        if from.rest().len() != 2 * usize::from(count) || count > 96 {
            return Code::Arguments;
        }
        let parameters = self.parameters();
        let ids = *from;
        for _ in 0..count {
            if from.u16().and_then(|id| parameters.get(id)).is_none() {
                return Code::UnknownParameter;
            }
        }
        self.send(Apid::Parameters, |out| {
            out.u8(count);
            let mut ids = ids;
            while let Some(id) = ids.u16() {
                out.u16(id);
                out.f64(parameters.get(id).unwrap_or(f64::NAN));
            }
        });
        Code::Done
    }
}

/// Reads the arguments of [`Function::SetKnown`]. Returns `None` if they are cut off or too long.
fn read_prior(from: &mut Reader<'_>) -> Option<Prior<f32>> {
    let (altitude_m, position_m) = (from.f32()?, from.floats()?);
    let rate_rad_s = if from.rest().is_empty() { None } else { known_vector(from.floats()?) };
    let prior = Prior {
        altitude_m: (!altitude_m.is_nan()).then_some(altitude_m),
        position_m: known_vector(position_m),
        rate_rad_s,
        ..Prior::default()
    };
    from.rest().is_empty().then_some(prior)
}

/// Returns a vector; `None` if one of its numbers is NaN, which means that it is not known.
fn known_vector(v: [f32; 3]) -> Option<[f32; 3]> {
    (!v.iter().any(|x| x.is_nan())).then_some(v)
}
