//! The flight loop: modes, pictures, telecommands, telemetry.

use core::cell::RefCell;

use hzn_core::body::Last;
use hzn_core::image::{Grey, Layout};
use hzn_core::observer::Observer;
use hzn_core::pixel::Pixel;
use hzn_core::status::Status;
use hzn_core::{Prior, Sensor, Workspace};

use crate::answer::PictureAnswer;
use crate::board::{Board, Shot};
use crate::bytes::{Reader, Writer};
use crate::messages::{Acknowledge, Code, EdgePart, Event, EventRecord, Exposure, Function, Housekeeping, Mode};
use crate::packet::{self, Apid, Inbox, MAX_BYTES, Packet};
use crate::parameters::{Parameters, Refused};
use crate::store;
use crate::table::{self, TableError};

/// A telecommand is broken if no byte arrives for this time before it is complete.
const COMMAND_TIMEOUT_US: u64 = 1_000_000;
/// Most pixels of an edge in one packet.
const EDGE_PIXELS: usize = 200;

/// The line for telemetry, with a sequence count for each APID.
#[derive(Debug)]
struct Line {
    out: [u8; MAX_BYTES],
    sequences: [u16; Apid::ALL.len()],
}

impl Line {
    fn send<B: Board>(&mut self, board: &mut B, apid: Apid, user: impl FnOnce(&mut Writer<'_>)) {
        let place = Apid::ALL.iter().zip(&mut self.sequences).find(|(a, _)| **a == apid);
        let sequence = place.map_or(0, |(_, n)| {
            let now = *n;
            *n = n.wrapping_add(1);
            now
        });
        let time_us = board.now_us();
        if let Some(bytes) = packet::write(&mut self.out, apid, sequence, time_us, user).and_then(|n| self.out.get(..n))
        {
            board.send(bytes);
        }
    }
}

/// The lists that a picture needs; keep them in a `static`. They are those of `hzn run --flight`, except that at most
/// 608 points are kept per edge. The default `candidates.keep_points` needs no more; `keep_points = 0` (all) also means
/// 608 here.
pub type Lists = Workspace<f32, 2048, 76, 512>;

/// The memory of the flight software in addition to the lists of a picture; keep it in a `static`.
#[derive(Debug)]
pub struct Buffers {
    line: Line,
    inbox: Inbox,
    table: [u8; table::MAX_BYTES],
    edge: Longest,
}

impl Default for Buffers {
    fn default() -> Self {
        Self::new()
    }
}

impl Buffers {
    /// Makes buffers of all zeros.
    pub const fn new() -> Self {
        Self {
            line: Line { out: [0; MAX_BYTES], sequences: [0; Apid::ALL.len()] },
            inbox: Inbox::new(),
            table: [0; table::MAX_BYTES],
            edge: Longest::NONE,
        }
    }
}

/// The flight software.
#[derive(Debug)]
pub struct Flight<'a, B> {
    board: B,
    buffers: &'a mut Buffers,
    workspace: &'a mut Lists,
    sensor: Sensor<f32>,
    housekeeping_every: u16,
    known: Prior<f32>,
    /// The last answer, and the time when its picture was exposed, µs since the start.
    last: Option<(Last<f32>, u64)>,
    mode: Mode,
    state: Housekeeping,
    /// Number of pictures since the last housekeeping packet.
    since: u16,
    /// Whether a command asked for the next picture to be processed.
    once: bool,
    /// Whether a command asked for the edges of the next picture.
    dump: bool,
    /// Time when the last byte arrived, µs since the start.
    heard_us: u64,
}

impl<'a, B: Board> Flight<'a, B> {
    /// Loads the parameters, runs the self-checks and waits in standby, or in safe mode if a check fails. `None` cannot
    /// occur: stored parameters are checked, and a test shows that the defaults are valid.
    // Not inlined, like the other large functions, so that each can use the same part of the stack.
    #[inline(never)]
    pub fn start(mut board: B, buffers: &'a mut Buffers, workspace: &'a mut Lists) -> Option<Self> {
        let loaded = store::load(&mut board, &mut buffers.table);
        let sensor = Sensor::new(&loaded.parameters.sensor).ok()?;
        let state = Housekeeping {
            parameter_copy: loaded.copy,
            parameter_generation: loaded.generation,
            last_status: u8::MAX,
            ..Housekeeping::default()
        };
        let mut flight = Self {
            board,
            buffers,
            workspace,
            sensor,
            housekeeping_every: loaded.parameters.housekeeping_every,
            known: Prior::default(),
            last: None,
            mode: Mode::Standby,
            state,
            since: 0,
            once: false,
            dump: false,
            heard_us: 0,
        };
        flight.event(Event::Started, u32::from(loaded.copy), loaded.generation);
        if flight.board.was_watchdog_reset() {
            flight.event(Event::Watchdog, 0, 0);
        }
        for (copy, broken) in (1u32..).zip(&loaded.broken) {
            let why = match broken {
                None => continue,
                Some(TableError::Header) => 1,
                Some(TableError::Checksum) => 2,
                Some(TableError::Refused(_)) => 3,
            };
            flight.event(Event::CopyBroken, copy, why);
        }
        if loaded.copy == 0 {
            flight.event(Event::Defaults, 0, 0);
        }
        flight.check(loaded.copy != 0);
        flight.housekeeping();
        Some(flight)
    }

    /// Returns the mode.
    pub fn mode(&self) -> Mode {
        self.mode
    }
    /// Returns the board.
    pub fn board(&mut self) -> &mut B {
        &mut self.board
    }

    /// Runs the self-checks of camera, memory and parameters. Default parameters fail the check: a sensor that was not
    /// configured is of no use, so the computer enters safe mode.
    fn check(&mut self, parameters: bool) {
        let camera = self.board.camera_answers();
        let memory = holds(&mut self.buffers.line.out, |_| ());
        let failed = u8::from(!camera) | u8::from(!memory) << 1 | u8::from(!parameters) << 2;
        self.state.self_check = failed;
        if failed != 0 {
            self.event(Event::SelfCheck, u32::from(failed), 0);
            self.enter(Mode::Safe);
        }
    }

    /// Runs one turn of the loop, with at most one telecommand and one picture. Call it for ever.
    pub fn turn(&mut self) {
        self.board.feed_watchdog();
        if self.mode == Mode::ShutDown {
            return;
        }
        if self.board.power_fails() {
            self.enter(Mode::ShutDown);
            return;
        }
        if self.mode == Mode::Standby && self.board.lift_off() {
            self.enter(Mode::Flight);
        }
        self.listen();
        let wanted = self.mode == Mode::Flight || self.mode == Mode::Standby && self.once;
        if wanted && let Some(shot) = self.board.next_shot() {
            self.once = false;
            self.picture(shot);
        }
    }

    fn listen(&mut self) {
        let now = self.board.now_us();
        while let Some(byte) = self.board.receive() {
            self.heard_us = now;
            self.buffers.inbox.push(byte);
            if self.command() {
                return;
            }
        }
        if self.buffers.inbox.is_waiting() {
            if self.command() {
                return;
            }
            if self.buffers.inbox.is_waiting() && now.saturating_sub(self.heard_us) > COMMAND_TIMEOUT_US {
                self.buffers.inbox.give_up();
                self.answer(0, 0, Code::Broken);
            }
        }
    }

    /// Carries out the telecommand that has arrived. Returns whether there was one.
    #[inline(never)]
    fn command(&mut self) -> bool {
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
                self.answer(0, 0, Code::Broken);
                true
            }
            Some(Some((apid, sequence, len))) => {
                let mut from = Reader::new(user.get(..len).unwrap_or_default());
                let number = from.u8().unwrap_or(0);
                let code = match Function::numbered(number) {
                    Some(function) if apid == Apid::Command as u16 => self.carry_out(function, &mut from),
                    _ => Code::Unknown,
                };
                self.answer(number, sequence, code);
                true
            }
        }
    }

    fn answer(&mut self, function: u8, sequence: u16, code: Code) {
        if code == Code::Done {
            self.state.commands = self.state.commands.saturating_add(1);
        } else {
            self.state.rejected = self.state.rejected.saturating_add(1);
            self.event(Event::CommandRejected, code as u32, u32::from(function));
        }
        let record = Acknowledge { function, sequence, code: code as u8 };
        self.send(Apid::Acknowledge, |out| record.write(out));
    }

    fn carry_out(&mut self, function: Function, from: &mut Reader<'_>) -> Code {
        let done = |from: &Reader<'_>| if from.rest().is_empty() { None } else { Some(Code::Arguments) };
        match function {
            Function::SetMode => {
                let Some(mode) = from.u8().and_then(Mode::numbered) else { return Code::Arguments };
                if let Some(code) = done(from) {
                    return code;
                }
                // The operator may leave safe mode even after a failed self-check.
                self.enter(mode);
                Code::Done
            }
            Function::SetParameters => self.set_parameters(from),
            Function::ReadParameters => self.read_parameters(from),
            Function::ProcessOnce | Function::DumpEdges | Function::ResetCounters if done(from).is_some() => {
                Code::Arguments
            }
            Function::ProcessOnce if self.mode != Mode::Standby => Code::Mode,
            Function::ProcessOnce => {
                self.once = true;
                Code::Done
            }
            Function::DumpEdges => {
                self.dump = true;
                Code::Done
            }
            Function::ResetCounters => {
                self.state = Housekeeping {
                    self_check: self.state.self_check,
                    parameter_copy: self.state.parameter_copy,
                    parameter_generation: self.state.parameter_generation,
                    last_status: self.state.last_status,
                    ..Housekeeping::default()
                };
                Code::Done
            }
            Function::SetKnown => {
                let mut number = || from.f32();
                let (Some(h), Some(x), Some(y), Some(z)) = (number(), number(), number(), number()) else {
                    return Code::Arguments;
                };
                let rate = if from.rest().is_empty() { None } else { Some([from.f32(), from.f32(), from.f32()]) };
                if let Some(code) = done(from) {
                    return code;
                }
                let given = |v: f32| (!v.is_nan()).then_some(v);
                let all = |v: [Option<f32>; 3]| match v.map(|v| v.and_then(given)) {
                    [Some(x), Some(y), Some(z)] => Some([x, y, z]),
                    _ => None,
                };
                // A rate has three numbers; if it is cut off, the command is refused.
                if rate.is_some_and(|r| r.iter().any(Option::is_none)) {
                    return Code::Arguments;
                }
                let position_m = all([Some(x), Some(y), Some(z)]);
                let rate_rad_s = rate.and_then(all);
                let known = Prior { altitude_m: given(h), position_m, rate_rad_s, ..Prior::default() };
                if self.sensor.expect(&known).is_err() {
                    return Code::Refused;
                }
                self.known = known;
                Code::Done
            }
        }
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
                self.event(Event::Stored, u32::from(copy), generation);
                Code::Done
            }
            Err(copy) => {
                self.event(Event::StoreFailed, u32::from(copy), 0);
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

    fn enter(&mut self, mode: Mode) {
        if mode == self.mode {
            return;
        }
        let from = core::mem::replace(&mut self.mode, mode);
        self.once = false;
        self.event(Event::ModeChanged, from as u32, mode as u32);
        self.housekeeping();
    }

    #[inline(never)]
    fn picture(&mut self, shot: Shot) {
        if shot.lost > 0 {
            self.state.lost = self.state.lost.saturating_add(shot.lost);
            self.event(Event::Overrun, shot.lost, 0);
        }
        let camera = self.sensor.camera();
        let layout = Layout::packed(camera.width().into(), camera.height().into(), 1, 8);
        let expected_bytes = usize::from(camera.width()) * usize::from(camera.height());
        if shot.bytes != expected_bytes {
            self.state.refused = self.state.refused.saturating_add(1);
            self.event(Event::WrongSize, shot.bytes as u32, expected_bytes as u32);
            return;
        }
        let age_s = |exposure_us: u64| shot.exposure_us.saturating_sub(exposure_us) as f32 * 1e-6;
        let last = self.last.map(|(last, exposure_us)| Last { age_s: age_s(exposure_us), ..last });
        let expected = match self.sensor.expect(&Prior { last, ..self.known }) {
            Ok(expected) => expected,
            Err(_) => {
                self.state.refused = self.state.refused.saturating_add(1);
                self.event(Event::KnownRefused, 0, 0);
                return;
            }
        };
        let number = self.state.pictures.wrapping_add(1);
        let start = self.board.now_us();
        let wanted = core::mem::take(&mut self.dump);
        let bytes = self.board.picture().get(..expected_bytes).unwrap_or_default();
        let Ok(picture) = Grey::try_new(bytes, layout) else { return };
        self.buffers.edge.forget();
        let watch = Watch { wanted, longest: RefCell::new(&mut self.buffers.edge) };
        let report = self.sensor.process(self.workspace, &picture, &expected, &watch);
        if let Some(s) = &report.solution {
            let last = Last { axis: s.axis, sigma_rad: s.covariance.sigma_max_rad(), age_s: 0.0 };
            self.last = Some((last, shot.exposure_us));
        }
        let done_us = self.board.now_us();
        let calculation_us = u32::try_from(done_us.saturating_sub(start)).unwrap_or(u32::MAX);
        let state = &mut self.state;
        state.pictures = number;
        state.answers = state.answers.saturating_add(u32::from(report.status == Status::Ok));
        state.last_status = report.status as u8;
        state.last_us = calculation_us;
        state.longest_us = state.longest_us.max(calculation_us);
        let config = self.sensor.config();
        let told = self.known.altitude_m.or(config.body.altitude_km.map(|h| (h * 1000.0) as f32));
        let exposure = Exposure {
            picture: number,
            exposure_us: shot.exposure_us,
            done_us,
            calculation_us,
            body: Parameters::body_number(config),
            altitude_m: told.unwrap_or(f32::NAN),
        };
        let answer = PictureAnswer::from_report(&report);
        self.send(Apid::Science, |out| {
            exposure.write(out);
            answer.write(out);
        });
        if wanted {
            self.send_edge(number);
        }
        self.since = self.since.saturating_add(1);
        if self.since >= self.housekeeping_every {
            self.housekeeping();
        }
    }

    fn send_edge(&mut self, picture: u32) {
        let Buffers { line, edge, .. } = &mut *self.buffers;
        let pixels = edge.pixels.get(..edge.len).unwrap_or_default();
        for (part, pixels) in pixels.chunks(EDGE_PIXELS).enumerate() {
            let head = EdgePart {
                picture,
                candidate: edge.candidate,
                stride: edge.stride,
                first: (part * EDGE_PIXELS) as u16,
                total: edge.len as u16,
                count: pixels.len() as u16,
            };
            line.send(&mut self.board, Apid::Edge, |out| {
                head.write(out);
                for p in pixels {
                    out.u16(p.x);
                    out.u16(p.y);
                }
            });
        }
    }

    fn housekeeping(&mut self) {
        self.since = 0;
        self.state.mode = self.mode as u8;
        self.state.stack_bytes = self.board.stack_bytes();
        let state = self.state;
        self.send(Apid::Housekeeping, |out| state.write(out));
    }

    fn event(&mut self, event: Event, a: u32, b: u32) {
        let record = EventRecord { number: event as u16, severity: event.severity() as u8, a, b };
        self.send(Apid::Event, |out| record.write(out));
    }

    fn send(&mut self, apid: Apid, user: impl FnOnce(&mut Writer<'_>)) {
        self.buffers.line.send(&mut self.board, apid, user);
    }
}

/// Most pixels of an edge that are sent.
const LISTED: usize = 512;

/// The longest edge of a picture, thinned to fit.
#[derive(Debug)]
struct Longest {
    length: u32,
    candidate: u32,
    stride: u32,
    pixels: [Pixel; LISTED],
    len: usize,
}

impl Longest {
    const NONE: Self = Self { length: 0, candidate: 0, stride: 0, pixels: [Pixel { x: 0, y: 0 }; LISTED], len: 0 };

    fn forget(&mut self) {
        (self.length, self.len) = (0, 0);
    }
}

/// Keeps the longest edge if it is wanted. There is only one type of observer, so that the pipeline is linked once.
struct Watch<'a> {
    wanted: bool,
    longest: RefCell<&'a mut Longest>,
}

impl Observer<f32> for Watch<'_> {
    fn edge(&self, candidate: u32, border: impl Iterator<Item = Pixel>, stride: u32) {
        if !self.wanted {
            return;
        }
        let Ok(mut longest) = self.longest.try_borrow_mut() else { return };
        let (pixels, _) = border.size_hint();
        let length = (pixels as u32).saturating_mul(stride);
        if length <= longest.length {
            return;
        }
        let every = pixels.div_ceil(LISTED).max(1);
        let list = &mut **longest;
        list.len = 0;
        for (place, pixel) in list.pixels.iter_mut().zip(border.step_by(every)) {
            *place = pixel;
            list.len += 1;
        }
        (list.length, list.candidate, list.stride) = (length, candidate, stride.saturating_mul(every as u32));
    }
}

/// Returns whether memory holds every bit, set and cleared. `meanwhile` changes the memory after each write; tests use
/// it for stuck bits.
fn holds(memory: &mut [u8], meanwhile: impl Fn(&mut [u8])) -> bool {
    [0x55u8, 0xAA].iter().all(|&pattern| {
        memory.fill(pattern);
        meanwhile(core::hint::black_box(&mut *memory));
        core::hint::black_box(&*memory).iter().all(|&b| b == pattern)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bit_that_is_stuck_fails_the_self_check() {
        let mut memory = [0; MAX_BYTES];
        assert!(holds(&mut memory, |_| ()));
        for bit in 0..8 * MAX_BYTES {
            assert!(!holds(&mut memory, |m| m[bit / 8] |= 1 << (bit % 8)), "bit {bit} stuck at 1");
            assert!(!holds(&mut memory, |m| m[bit / 8] &= !(1 << (bit % 8))), "bit {bit} stuck at 0");
        }
    }
}
