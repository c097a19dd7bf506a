//! Telecommands that read and change parameters.

use hzn_core::Sensor;

use super::Flight;
use super::self_check::NO_PARAMETERS;
use crate::board::Board;
use crate::bytes::Reader;
use crate::messages::{Code, Event, MAX_READ, ParameterValue};
use crate::operations::Operations;
use crate::packet::Apid;
use crate::parameters::{Parameters, Refused};
use crate::store;
use crate::table;

/// How long new parameters are kept.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Keep {
    UntilReset,
    Stored,
}

/// Bytes of a parameter that waits for the commit: its number and its value.
const ENTRY: usize = 10;

impl<B: Board> Flight<'_, B> {
    fn parameters(&self) -> Parameters {
        Parameters { sensor: self.sensor.get().config().clone(), operations: self.operations.get().clone() }
    }

    /// Sets all parameters, or none.
    #[inline(never)]
    pub(super) fn set_parameters(&mut self, from: &mut Reader<'_>, keep: Keep) -> Code {
        let Some(count) = from.u8().filter(|&count| count > 0) else { return Code::Arguments };
        if from.rest().len() != ENTRY * usize::from(count) {
            return Code::Arguments;
        }
        // The values are set in a copy, so that one that is refused leaves all others as they are.
        let mut parameters = self.parameters();
        match merge(&mut parameters, *from) {
            Ok(()) => self.use_parameters(&parameters, keep),
            Err(refused) => self.refuse_parameter(refused),
        }
    }

    /// Keeps parameters for a commit. They are checked only there, because a mask is complete only with all its
    /// corners.
    pub(super) fn stage_parameters(&mut self, from: &mut Reader<'_>) -> Code {
        let Some(count) = from.u8() else { return Code::Arguments };
        let new = from.rest();
        if new.len() != ENTRY * usize::from(count) {
            return Code::Arguments;
        }
        if count == 0 {
            self.staged = 0;
            return Code::Done;
        }
        let end = ENTRY * usize::from(self.staged);
        let Some(room) = self.buffers.table.get_mut(end..end + new.len()) else { return Code::Refused };
        room.copy_from_slice(new);
        self.staged += u16::from(count);
        Code::Done
    }

    /// Sets and stores the parameters that are kept.
    #[inline(never)]
    pub(super) fn commit_parameters(&mut self, from: &mut Reader<'_>) -> Code {
        let Some(count) = from.u16().filter(|_| from.rest().is_empty()) else { return Code::Arguments };
        // A refused commit removes them, too, because parts of a load are of no use: it is sent again.
        let staged = core::mem::take(&mut self.staged);
        if count == 0 || count != staged {
            return Code::Arguments;
        }
        let entries = self.buffers.table.get(..ENTRY * usize::from(staged)).unwrap_or_default();
        let mut parameters = self.parameters();
        match merge(&mut parameters, Reader::new(entries)) {
            Ok(()) => self.use_parameters(&parameters, Keep::Stored),
            Err(refused) => self.refuse_parameter(refused),
        }
    }

    /// Puts parameters to use.
    fn use_parameters(&mut self, parameters: &Parameters, keep: Keep) -> Code {
        let is_sensor_new = parameters.sensor != *self.sensor.get().config();
        // Only for a change, because making a sensor takes 7.6 million instructions on a Cortex-M4F.
        if is_sensor_new || parameters.operations != *self.operations.get() {
            // Checked before anything is replaced, so that a refusal changes nothing.
            if let Err(refused) = parameters.check() {
                return self.refuse_parameter(refused);
            }
            // Two computers with one base would both carry out what is meant for one, and could not be parted again.
            if self.board.is_base_taken(parameters.operations.base()) {
                return self.refuse(Code::Refused, Operations::APID_BASE);
            }
            if is_sensor_new && !self.renew_sensor(parameters) {
                return Code::Refused;
            }
            self.sensor.complete();
            self.operations.set(parameters.operations.clone());
            self.operations.complete();
            // Parameters that were tried may be the stored ones again.
            self.is_not_stored = self.stored != Some(table::digest(parameters));
        }
        // Memory wears out: it is written only if this changes something.
        if keep == Keep::UntilReset || !self.is_not_stored { Code::Done } else { self.store(parameters) }
    }

    /// Makes the sensor of the parameters. Returns false if they are refused.
    // Not inlined, like the other functions with a sensor on the stack, so that each can use the same part of it.
    #[inline(never)]
    pub(super) fn renew_sensor(&mut self, parameters: &Parameters) -> bool {
        let sensor = Sensor::new(&parameters.sensor);
        let is_accepted = sensor.is_ok();
        if let Ok(sensor) = sensor {
            self.sensor.set(sensor);
            self.is_gap = true;
            self.board.note_sensor(&parameters.sensor);
        }
        is_accepted
    }

    fn refuse_parameter(&mut self, refused: Refused) -> Code {
        let code = if matches!(refused, Refused::Unknown(_)) { Code::UnknownParameter } else { Code::Refused };
        self.refuse(code, refused.number())
    }

    #[inline(never)]
    fn store(&mut self, parameters: &Parameters) -> Code {
        let (copy, generation) = (self.state.parameter_copy, self.state.parameter_generation);
        // The buffer of the table is written.
        self.staged = 0;
        match store::save(&mut self.board, parameters, copy, generation, &mut self.buffers.table) {
            Ok((copy, generation)) => {
                (self.state.parameter_copy, self.state.parameter_generation) = (copy, generation);
                // The self-check failed because nothing was stored, which is no longer so.
                self.state.self_check &= !NO_PARAMETERS;
                (self.stored, self.is_not_stored) = (Some(table::digest(parameters)), false);
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
    pub(super) fn read_parameters(&mut self, from: &mut Reader<'_>) -> Code {
        let Some(count) = from.u8() else { return Code::Arguments };
        if from.rest().len() != 2 * usize::from(count) || count > MAX_READ {
            return Code::Arguments;
        }
        let parameters = self.parameters();
        // All numbers are looked at before the first value is sent, so that a refused telecommand sends none.
        let ids = *from;
        while let Some(id) = from.u16() {
            if parameters.get(id).is_none() {
                return self.refuse(Code::UnknownParameter, id);
            }
        }
        let mut ids = ids;
        while let Some(number) = ids.u16() {
            let value = ParameterValue { number, value: parameters.get(number).unwrap_or(f64::NAN) };
            self.send(Apid::Parameters, |out| value.write(out));
        }
        Code::Done
    }
}

/// Sets parameters to the numbers and values in `from`.
fn merge(parameters: &mut Parameters, mut from: Reader<'_>) -> Result<(), Refused> {
    while let (Some(id), Some(value)) = (from.u16(), from.f64()) {
        parameters.set(id, value)?;
    }
    Ok(())
}
