//! Counts the instructions that the bytes of a line cost the flight software.
//!
//! The file `line.bin` has the bytes. They arrive at 115 200 bits a second, at most 256 for each turn of the loop. The
//! file `cost.bin` gets three numbers of 32 bits: the ticks of all turns, the most for one turn, and the ticks of as
//! many turns without a byte.

#![no_std]
#![no_main]

use cortex_m_rt::entry;
use hzn_flight::board::{Board, Picture};
use hzn_flight::flight::{Buffers, Flight, Lists};
use hzn_flight::view::Viewer;
use hzn_mps2::board::{self, Timer};
use hzn_mps2::host::{File, exit};
use static_cell::ConstStaticCell;

static WORKSPACE: ConstStaticCell<Lists> = ConstStaticCell::new(Lists::new());
static BUFFERS: ConstStaticCell<Buffers> = ConstStaticCell::new(Buffers::new());

/// Bytes that arrive for each turn, and their time.
const BYTES: usize = 256;
const TURN_US: u64 = 22_222;
/// Number of turns after the last byte. They take two seconds; an incomplete packet is given up after one.
const TURNS_AFTER: u32 = 90;

/// A board that is a line and nothing else.
struct Wire {
    /// Bytes that have arrived.
    arrived: core::slice::Iter<'static, u8>,
    /// Bytes that have not arrived yet.
    coming: &'static [u8],
    now_us: u64,
}

impl Wire {
    /// Lets bytes arrive, if all earlier ones were taken.
    fn let_arrive(&mut self) {
        if self.arrived.as_slice().is_empty() {
            let (now, later) = self.coming.split_at_checked(BYTES).unwrap_or((self.coming, &[]));
            (self.arrived, self.coming) = (now.iter(), later);
        }
    }
    fn is_silent(&self) -> bool {
        self.arrived.as_slice().is_empty() && self.coming.is_empty()
    }
}

impl Board for Wire {
    fn now_us(&mut self) -> u64 {
        self.now_us
    }
    fn receive(&mut self) -> Option<u8> {
        self.arrived.next().copied()
    }
    fn send(&mut self, _bytes: &[u8]) {}
    fn lift_off(&mut self) -> bool {
        false
    }
    fn power_fails(&mut self) -> bool {
        false
    }
    fn was_watchdog_reset(&mut self) -> bool {
        false
    }
    fn feed_watchdog(&mut self) {}
    fn camera_answers(&mut self) -> bool {
        true
    }
    fn next_picture(&mut self) -> Option<Picture> {
        None
    }
    fn show(&mut self, _viewer: &mut Viewer<'_>) {}
    fn read_copy(&mut self, _copy: u8, into: &mut [u8]) {
        into.fill(0xFF);
    }
    fn write_copy(&mut self, _copy: u8, _bytes: &[u8]) -> bool {
        false
    }
    fn stack_bytes(&mut self) -> u32 {
        0
    }
}

/// Runs turns, and adds up what they cost.
struct Meter {
    timer: Timer,
    sum: u32,
    most: u32,
}

impl Meter {
    fn turn(&mut self, flight: &mut Flight<'_, Wire>) {
        let from = self.timer.ticks();
        flight.turn();
        let cost = self.timer.ticks().wrapping_sub(from);
        (self.sum, self.most) = (self.sum.wrapping_add(cost), self.most.max(cost));
        flight.board().now_us += TURN_US;
    }
}

#[entry]
fn main() -> ! {
    exit(match run() {
        Some(()) => 0,
        None => 1,
    })
}

fn run() -> Option<()> {
    let board = board::Board::take()?;
    let [memory, _] = board.frames;
    let mut input = File::open(c"line.bin")?;
    let mut count = [0; 4];
    if !input.read(&mut count) {
        return None;
    }
    let bytes = memory.get_mut(..u32::from_le_bytes(count) as usize)?;
    if !input.read(bytes) {
        return None;
    }
    let wire = Wire { arrived: [].iter(), coming: bytes, now_us: 1 };
    let (buffers, workspace) = (BUFFERS.try_take()?, WORKSPACE.try_take()?);
    let flight = &mut Flight::start(wire, buffers, workspace)?;
    let new_meter = || Meter { timer: board.timer, sum: 0, most: 0 };
    // The first turn checks the sensor.
    new_meter().turn(flight);
    let [mut with_bytes, mut without] = [new_meter(), new_meter()];
    let (mut turns, mut after) = (0u32, 0);
    while after < TURNS_AFTER {
        if flight.board().is_silent() {
            after += 1;
        }
        flight.board().let_arrive();
        with_bytes.turn(flight);
        turns += 1;
    }
    for _ in 0..turns {
        without.turn(flight);
    }
    let mut output = File::create(c"cost.bin")?;
    let numbers = [with_bytes.sum, with_bytes.most, without.sum];
    numbers.iter().all(|n| output.write(&n.to_le_bytes())).then_some(())
}
