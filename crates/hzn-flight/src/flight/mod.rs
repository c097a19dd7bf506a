//! The flight loop: modes, pictures, telecommands, telemetry.
//!
//! | part | idea |
//! |---|---|
//! | `self_check` | the checks at the start |
//! | `recovery` | counts of resets, detection of lift-off |
//! | `mode_changes` | the mode after a reset, at lift-off, at the end of the flight |
//! | `listen` | the telecommand that arrives, and its acknowledgement |
//! | `uplink`, `admission` | the line that it comes from, and whether its sender may command |
//! | `telecommands` | the functions of telecommands |
//! | `parameter_commands` | the functions that read and change parameters |
//! | `pictures` | the way of a picture to its science packet |
//! | `memory` | bits that changed in memory |
//! | `science` | the packets of a picture, within the bit budget |
//! | `clock` | the time of packets, and its correlation |
//! | `validity` | time and expiry of values from navigation |
//! | `navigation` | position, velocity and rate |
//! | `attitude` | attitude and Sun |
//! | `known` | what of them is known at an exposure |
//! | `prior` | the prior of a picture from these values, until they expire |
//! | `camera_watch` | pictures that do not come |
//! | `longest_edge` | the packets of the edge that a command asks for |
//! | `reports` | limits of what is sent, flags of housekeeping |
//! | `housekeeping` | housekeeping and events are sent |
//! | `line` | packets on the line, with their counts |
//! | [`rig`] | several of these loops, one for each head, and their joint answer |

use hzn_core::Sensor;
use hzn_twice::KeptTwice;

use crate::board::Board;
use crate::messages::{Event, Housekeeping, Mode};
use crate::operations::Operations;
use crate::store::{self, Loaded};
use crate::table;
pub use crate::view::Lists;
use crate::view::LongestEdge;

mod admission;
mod attitude;
mod budget;
mod camera_watch;
mod clock;
mod housekeeping;
mod known;
mod line;
mod listen;
mod longest_edge;
mod memory;
mod mode_changes;
mod navigation;
mod parameter_commands;
mod pictures;
mod prior;
mod recovery;
mod reports;
pub mod rig;
mod science;
mod self_check;
mod telecommands;
mod uplink;
mod validity;

use budget::BitBudget;
use camera_watch::CameraWatch;
use known::Known;
use line::Line;
use recovery::Recovery;
use reports::Limiter;
use uplink::Uplink;

/// The memory of the flight software in addition to the lists of a picture; keep it in a `static`.
#[derive(Debug)]
pub struct Buffers {
    uplink: Uplink,
    own: HeadBuffers,
}

impl Default for Buffers {
    fn default() -> Self {
        Self::new()
    }
}

impl Buffers {
    /// Makes buffers of all zeros.
    pub const fn new() -> Self {
        Self { uplink: Uplink::new(), own: HeadBuffers::new() }
    }
}

/// The same for a head of a [`rig`], which listens for all of its heads.
#[derive(Debug)]
pub struct HeadBuffers {
    line: Line,
    /// A table of parameters on its way from or to memory, or parameters that wait for their commit.
    // One memory for both saves 4 KB. A table that passes through it removes the parameters that wait.
    table: [u8; table::MAX_BYTES],
    edge: LongestEdge,
}

impl Default for HeadBuffers {
    fn default() -> Self {
        Self::new()
    }
}

impl HeadBuffers {
    /// Makes buffers of all zeros.
    pub const fn new() -> Self {
        Self { line: Line::new(), table: [0; table::MAX_BYTES], edge: LongestEdge::NONE }
    }
}

/// The flight software.
#[derive(Debug)]
pub struct Flight<'a, B> {
    /// What the first turn reports: why copies 1 and 2 of the parameters cannot be used.
    start: Option<[u32; 2]>,
    board: B,
    buffers: &'a mut HeadBuffers,
    /// `None` in a rig, which listens for its heads.
    uplink: Option<&'a mut Uplink>,
    /// `None` if a rig lends the lists for each turn, because its heads share them.
    workspace: Option<&'a mut Lists>,
    // Kept twice, because they are used for the whole flight: every answer after a flipped bit would be wrong.
    sensor: KeptTwice<Sensor<f32>>,
    operations: KeptTwice<Operations>,
    /// Whether the parameters in use differ from the stored ones.
    is_not_stored: bool,
    /// Checksum of the stored parameters; `None` if the defaults are in use, which are not stored.
    stored: Option<u32>,
    /// Number of parameters that are kept for a commit; they are in the buffer of the table.
    staged: u16,
    known: KeptTwice<Known>,
    /// Whether events said that the values from navigation have expired, and the attitude.
    has_expired: (bool, bool),
    mode: Mode,
    state: Housekeeping,
    recovery: Recovery,
    camera: CameraWatch,
    limiter: Limiter,
    budget: BitBudget,
    /// Number of the last picture, from 1.
    number: u32,
    /// Whether the next picture does not follow the last answer, so that its limb is not tracked.
    is_gap: bool,
    /// Number of pictures since the last housekeeping packet, and its time.
    since_housekeeping: u16,
    housekeeping_us: u64,
    /// What the last telecommand was refused for, as in [`crate::messages::Acknowledge::detail`].
    detail: u16,
    /// Whether the board could keep the last answer.
    keeps_answers: bool,
    /// Whether a command asked for the next picture to be processed.
    process_once: bool,
    /// Whether a command asked for the edges of the next picture.
    dump_edges: bool,
}

impl<'a, B: Board> Flight<'a, B> {
    /// Loads the parameters. The first turn runs the self-checks and waits in standby, or in safe mode if a check
    /// fails. `None` cannot occur: stored parameters are checked, and a test shows that the defaults are valid.
    ///
    /// Keep the flight software where it is: it has two sensors, 15 KB, and a copy needs that much of the stack.
    // Not inlined, like the other large functions, so that each can use the same part of the stack.
    #[inline(never)]
    pub fn start(board: B, buffers: &'a mut Buffers, workspace: &'a mut Lists) -> Option<Self> {
        let Buffers { uplink, own } = buffers;
        Self::start_with(board, own, Some(uplink), Some(workspace))
    }

    #[inline(always)]
    fn start_with(
        mut board: B,
        buffers: &'a mut HeadBuffers,
        uplink: Option<&'a mut Uplink>,
        workspace: Option<&'a mut Lists>,
    ) -> Option<Self> {
        let recovery = Recovery::begin(&mut board);
        let loaded = store::load(&mut board, &mut buffers.table, recovery.choice());
        Self::new(board, buffers, (uplink, workspace), recovery, &loaded)
    }

    /// Sends the events of the start, runs the self-checks and enters the first mode.
    #[inline(never)]
    fn begin(&mut self, broken: [u32; 2]) {
        self.report_start(broken);
        self.run_self_checks(self.state.parameter_copy != 0);
        self.enter_first_mode();
        self.send_housekeeping();
    }

    /// Makes the flight software with the parameters that were loaded.
    #[inline(never)]
    fn new(
        mut board: B,
        buffers: &'a mut HeadBuffers,
        (uplink, workspace): (Option<&'a mut Uplink>, Option<&'a mut Lists>),
        recovery: Recovery,
        loaded: &Loaded,
    ) -> Option<Self> {
        let image = board.image();
        let state = Housekeeping {
            parameter_copy: loaded.copy,
            parameter_generation: loaded.generation,
            last_status: u8::MAX,
            build: image.build,
            image_crc: image.crc,
            starts: recovery.starts,
            watchdog_resets: recovery.watchdog_resets,
            ..Housekeeping::default()
        };
        buffers.line.set_base(loaded.parameters.operations.base());
        board.note_sensor(&loaded.parameters.sensor);
        // Before the sensor is made, whose two copies would otherwise wait on the stack.
        let (start, stored) = (Some(loaded.broken_codes()), loaded.digest());
        Some(Self {
            start,
            sensor: KeptTwice::new(Sensor::new(&loaded.parameters.sensor).ok()?),
            board,
            buffers,
            uplink,
            workspace,
            operations: KeptTwice::new(loaded.parameters.operations.clone()),
            is_not_stored: loaded.copy == 0,
            stored,
            staged: 0,
            known: KeptTwice::new(Known::default()),
            has_expired: (false, false),
            mode: Mode::Standby,
            state,
            recovery,
            camera: CameraWatch::new(),
            limiter: Limiter::new(),
            budget: BitBudget::new(),
            number: 0,
            is_gap: true,
            since_housekeeping: 0,
            housekeeping_us: 0,
            detail: 0,
            keeps_answers: true,
            process_once: false,
            dump_edges: false,
        })
    }

    /// Sends the events of the start. `broken` says why copies 1 and 2 of the parameters cannot be used; 0: they can.
    fn report_start(&mut self, broken: [u32; 2]) {
        let (copy, generation) = (self.state.parameter_copy, self.state.parameter_generation);
        self.send_event(Event::Started, u32::from(copy), generation);
        if self.recovery.watchdog_resets > 0 {
            self.send_event(Event::Watchdog, u32::from(self.recovery.watchdog_resets), 0);
        }
        for (copy, why) in (1u32..).zip(broken).filter(|(_, why)| *why > 0) {
            self.send_event(Event::CopyBroken, copy, why);
        }
        if copy == 0 {
            self.send_event(Event::Defaults, 0, 0);
        }
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
        // Nothing else feeds it, so that any part of a turn that hangs ends in a reset.
        self.board.feed_watchdog();
        // First of all, because nothing may end this mode: a repair, for example, can start safe mode.
        if self.mode == Mode::ShutDown {
            return;
        }
        if let Some(broken) = self.start.take() {
            self.begin(broken);
        }
        // The copies are made here, because a move may change the unused bytes between fields.
        self.sensor.complete();
        self.known.complete();
        // Before they act: a wrong `boot.shut_down_after_s`, for example, would end the flight in this turn.
        self.check_operations();
        let now_us = self.board.now_us();
        let pulse_us = self.board.pulse_us();
        // Before `listen`, so that a telecommand `time` finds the last pulse.
        self.buffers.line.clock.note_pulse(pulse_us);
        // Before `listen`, so that no telecommand writes parameters while power is being cut.
        if self.follow_vehicle(now_us) {
            return;
        }
        // Before the picture, so that a prior or a mode that has just come holds for it.
        self.listen();
        let wanted = self.mode == Mode::Flight || self.mode == Mode::Standby && self.process_once;
        if wanted {
            match self.board.next_picture() {
                Some(picture) => {
                    self.process_once = false;
                    self.camera.note(&picture, now_us);
                    self.process_picture(picture);
                }
                None => self.watch_camera(now_us),
            }
        }
        self.report_by_time(now_us);
    }

    fn enter_mode(&mut self, mode: Mode) {
        if mode == self.mode {
            return;
        }
        let from = core::mem::replace(&mut self.mode, mode);
        // A request for a picture would otherwise act when standby returns.
        self.process_once = false;
        let now_us = self.board.now_us();
        // Pictures were perhaps not taken in the mode before, so their period is not known.
        self.camera.start(now_us);
        self.is_gap = true;
        self.send_event(Event::ModeChanged, from as u32, mode as u32);
        self.send_housekeeping();
    }
}
