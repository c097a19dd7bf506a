//! The functions of telecommands. Those that read and change parameters are in `parameter_commands`.

use super::Flight;
use super::attitude::read_attitude;
use super::navigation::{read_navigation, read_prior};
use super::parameter_commands::Keep;
use crate::board::Board;
use crate::bytes::Reader;
use crate::cuc::Cuc;
use crate::messages::{Code, Event, Function, Housekeeping, Mode};

impl<B: Board> Flight<'_, B> {
    pub(super) fn carry_out(&mut self, function: Function, from: &mut Reader<'_>) -> Code {
        match function {
            Function::SetMode => self.set_mode(from),
            Function::SetParameters => self.set_parameters(from, Keep::Stored),
            Function::TryParameters => self.set_parameters(from, Keep::UntilReset),
            Function::StageParameters => self.stage_parameters(from),
            Function::CommitParameters => self.commit_parameters(from),
            Function::ReadParameters => self.read_parameters(from),
            Function::SetKnown => self.set_known(read_prior(from)),
            Function::Navigate => {
                let now_us = self.board.now_us();
                let read = read_navigation(from, &self.buffers.line.clock, now_us);
                self.set_known(read)
            }
            Function::SetAttitude => {
                let now_us = self.board.now_us();
                let read = read_attitude(from, &self.buffers.line.clock, now_us);
                self.set_attitude(read)
            }
            Function::SetTime => self.set_time(from),
            // The other functions have no arguments.
            _ if !from.rest().is_empty() => Code::Arguments,
            Function::ProcessOnce if self.mode != Mode::Standby => Code::Mode,
            Function::ProcessOnce => {
                // Only a request, because the picture is taken after the telecommands of a turn.
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
            Function::Ping => Code::Done,
            Function::Report => {
                self.send_housekeeping();
                Code::Done
            }
            Function::ArmShutDown => {
                let now_us = self.board.now_us();
                self.recovery.arm(now_us);
                Code::Done
            }
        }
    }

    fn set_mode(&mut self, from: &mut Reader<'_>) -> Code {
        let Some(mode) = from.u8().and_then(Mode::from_number) else { return Code::Arguments };
        if !from.rest().is_empty() {
            return Code::Arguments;
        }
        let now_us = self.board.now_us();
        // Two telecommands are needed, because only a reset ends this mode.
        if mode == Mode::ShutDown && !self.recovery.is_armed(now_us) {
            return Code::NotArmed;
        }
        // The operator may leave safe mode even after a failed self-check.
        self.enter_mode(mode);
        Code::Done
    }

    /// Keeps what a telecommand is refused for, and returns the code.
    pub(super) fn refuse(&mut self, code: Code, detail: u16) -> Code {
        self.detail = detail;
        code
    }

    fn set_time(&mut self, from: &mut Reader<'_>) -> Code {
        let (Some(time), Some(at_pulse @ 0..=1), []) = (from.u64(), from.u8(), from.rest()) else {
            return Code::Arguments;
        };
        let Some(time) = Cuc::from_bytes(time.to_be_bytes()) else { return Code::Arguments };
        let now_us = self.board.now_us();
        match self.buffers.line.clock.correlate(time, at_pulse == 1, now_us) {
            Ok(change_us) => {
                let change_ms = change_us.and_then(|us| u32::try_from(us / 1000).ok()).unwrap_or(u32::MAX);
                self.send_event(Event::ClockSet, (time.us / 1_000_000) as u32, change_ms);
                Code::Done
            }
            Err(code) => code,
        }
    }

    /// Sets the counters to zero. What is no counter stays.
    fn reset_counters(&mut self) {
        // The number of the last picture goes on, so that no number means two pictures.
        self.state = Housekeeping {
            pictures: 0,
            answers: 0,
            lost: 0,
            refused: 0,
            commands: 0,
            rejected: 0,
            last_us: 0,
            longest_us: 0,
            repairs: 0,
            foreign: 0,
            broken: 0,
            withheld: 0,
            decimated: 0,
            stuck: 0,
            ..self.state
        };
    }
}
