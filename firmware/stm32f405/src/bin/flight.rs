//! The flight software on an STM32F405, as QEMU's machine `netduinoplus2`.
//!
//! The line is USART1 and the clock is timer 2. The camera sends pictures of 640×480 pixels row by row; it and the
//! flash of the parameters are files in the working folder of the emulator ([`hzn_firmware::camera`],
//! [`hzn_firmware::flash`]).

#![no_std]
#![no_main]

use cortex_m_rt::entry;
use hzn_firmware::host::exit;
use hzn_flight::flight::{Buffers, Flight, Lists};
use hzn_flight::messages::Mode;
use hzn_stm32f405::port::{Rows, Stm32F405, WIDTH};
use static_cell::ConstStaticCell;

static WORKSPACE: ConstStaticCell<Lists> = ConstStaticCell::new(Lists::new());
static BUFFERS: ConstStaticCell<Buffers> = ConstStaticCell::new(Buffers::new());
static ROWS: ConstStaticCell<Rows> = ConstStaticCell::new(Rows::new());
static ROW: ConstStaticCell<[u8; WIDTH]> = ConstStaticCell::new([0; WIDTH]);

#[entry]
fn main() -> ! {
    let board = ROWS.try_take().zip(ROW.try_take()).and_then(|(rows, row)| Stm32F405::take(rows, row));
    let (Some(board), Some(buffers), Some(workspace)) = (board, BUFFERS.try_take(), WORKSPACE.try_take()) else {
        exit(1)
    };
    // A reference: moving the flight software would need its size twice on the stack.
    let Some(flight) = &mut Flight::start(board, buffers, workspace) else { exit(1) };
    while flight.mode() != Mode::ShutDown {
        flight.turn();
    }
    // Power would be cut now.
    exit(0)
}
