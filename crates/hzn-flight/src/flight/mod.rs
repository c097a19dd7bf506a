//! The flight loop: modes, pictures, telecommands, telemetry.
//!
//! | part | idea |
//! |---|---|
//! | `self_check` | the checks at the start |
//! | `telecommands` | telecommands, from the line to their acknowledgement |
//! | `pictures` | the way of a picture to its science packet |
//! | `longest_edge` | the edge that a command asks for |
//! | `line` | packets on the line, with their counts |

use hzn_core::body::Last;
use hzn_core::{Prior, Sensor, Workspace};

use crate::board::Board;
use crate::bytes::Writer;
use crate::messages::{Event, EventRecord, Housekeeping, Mode};
use crate::packet::{Apid, Inbox};
use crate::store;
use crate::table::{self, TableError};

mod line;
mod longest_edge;
mod pictures;
mod self_check;
mod telecommands;

use line::Line;
use longest_edge::LongestEdge;

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
    edge: LongestEdge,
}

impl Default for Buffers {
    fn default() -> Self {
        Self::new()
    }
}

impl Buffers {
    /// Makes buffers of all zeros.
    pub const fn new() -> Self {
        Self { line: Line::new(), inbox: Inbox::new(), table: [0; table::MAX_BYTES], edge: LongestEdge::NONE }
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
    /// The prior of the pictures, from navigation.
    prior: Prior<f32>,
    /// The last answer, and the time when its picture was exposed, µs since the start.
    last: Option<(Last<f32>, u64)>,
    mode: Mode,
    state: Housekeeping,
    /// Number of pictures since the last housekeeping packet.
    since_housekeeping: u16,
    /// Whether a command asked for the next picture to be processed.
    process_once: bool,
    /// Whether a command asked for the edges of the next picture.
    dump_edges: bool,
    /// Time when the last byte arrived, µs since the start.
    last_byte_us: u64,
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
            prior: Prior::default(),
            last: None,
            mode: Mode::Standby,
            state,
            since_housekeeping: 0,
            process_once: false,
            dump_edges: false,
            last_byte_us: 0,
        };
        flight.send_event(Event::Started, u32::from(loaded.copy), loaded.generation);
        if flight.board.was_watchdog_reset() {
            flight.send_event(Event::Watchdog, 0, 0);
        }
        for (copy, broken) in (1u32..).zip(&loaded.broken) {
            let why = match broken {
                None => continue,
                Some(TableError::Header) => 1,
                Some(TableError::Checksum) => 2,
                Some(TableError::Refused(_)) => 3,
            };
            flight.send_event(Event::CopyBroken, copy, why);
        }
        if loaded.copy == 0 {
            flight.send_event(Event::Defaults, 0, 0);
        }
        flight.run_self_checks(loaded.copy != 0);
        flight.send_housekeeping();
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

    /// Runs one turn of the loop, with at most one telecommand and one picture. Call it for ever.
    pub fn turn(&mut self) {
        self.board.feed_watchdog();
        if self.mode == Mode::ShutDown {
            return;
        }
        if self.board.power_fails() {
            self.enter_mode(Mode::ShutDown);
            return;
        }
        if self.mode == Mode::Standby && self.board.lift_off() {
            self.enter_mode(Mode::Flight);
        }
        self.listen();
        let wanted = self.mode == Mode::Flight || self.mode == Mode::Standby && self.process_once;
        if wanted && let Some(picture) = self.board.next_picture() {
            self.process_once = false;
            self.process_picture(picture);
        }
    }

    fn enter_mode(&mut self, mode: Mode) {
        if mode == self.mode {
            return;
        }
        let from = core::mem::replace(&mut self.mode, mode);
        self.process_once = false;
        self.send_event(Event::ModeChanged, from as u32, mode as u32);
        self.send_housekeeping();
    }

    fn send_housekeeping(&mut self) {
        self.since_housekeeping = 0;
        self.state.mode = self.mode as u8;
        self.state.stack_bytes = self.board.stack_bytes();
        let state = self.state;
        self.send(Apid::Housekeeping, |out| state.write(out));
    }

    fn send_event(&mut self, event: Event, a: u32, b: u32) {
        let record = EventRecord { number: event as u16, severity: event.severity() as u8, a, b };
        self.send(Apid::Event, |out| record.write(out));
    }

    fn send(&mut self, apid: Apid, user: impl FnOnce(&mut Writer<'_>)) {
        self.buffers.line.send(&mut self.board, apid, user);
    }
}
