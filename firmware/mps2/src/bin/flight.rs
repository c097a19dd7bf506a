//! The flight software on the MPS2 boards.
//!
//! The line is UART 0, the clock is timer 0, and the watchdog is that of the board, with two seconds.
//!
//! These boards have no camera and no flash. Files in the working folder of the emulator stand for them
//! ([`hzn_firmware::camera`], [`hzn_firmware::flash`]).

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
    // A reference: moving the flight software would need its size twice on the stack.
    let Some(flight) = &mut Flight::start(board, buffers, workspace) else { exit(1) };
    while flight.mode() != Mode::ShutDown {
        flight.turn();
    }
    // Power would be cut now.
    exit(0)
}
