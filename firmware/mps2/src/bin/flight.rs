//! The flight software on the MPS2 boards.
//!
//! Line: UART 0. Clock: timer 0. Watchdog: the board's, two seconds. What these boards lack, the machine that emulates
//! them stands in for, by files in its working folder: `frames.bin` is the camera (for each picture "FRAM", its length,
//! pictures lost before it, one spare word, little-endian; then its bytes; "HANG" instead is a camera that never comes
//! back), `copy1.bin` and `copy2.bin` are the flash. With `cut.bin` (one word) power is cut after so many bytes written
//! to flash.

#![no_std]
#![no_main]

use cortex_m_rt::entry;
use hzn_flight::flight::{Buffers, Flight, Lists};
use hzn_flight::messages::Mode;
use hzn_mps2::host::exit;
use hzn_mps2::port::Mps2;
use static_cell::ConstStaticCell;

static WORKSPACE: ConstStaticCell<Lists> = ConstStaticCell::new(Lists::new());
static BUFFERS: ConstStaticCell<Buffers> = ConstStaticCell::new(Buffers::new());

#[entry]
fn main() -> ! {
    let parts = (Mps2::take(), BUFFERS.try_take(), WORKSPACE.try_take());
    let (Some(board), Some(buffers), Some(workspace)) = parts else { exit(1) };
    let Some(mut flight) = Flight::start(board, buffers, workspace) else { exit(1) };
    while flight.mode() != Mode::ShutDown {
        flight.turn();
    }
    // Power would be cut now.
    exit(0)
}
