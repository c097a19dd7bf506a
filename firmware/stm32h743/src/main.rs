//! The flight software on an STM32H743 with a camera at the DCMI, by the hardware library stm32h7xx-hal. It was built
//! and linked, but never run: no emulator has this part.
//!
//! | file | idea |
//! |---|---|
//! | `board` | clocks, pins and peripherals |
//! | `camera` | DCMI and DMA |
//! | `line` | the serial line |
//! | `parameters` | two sectors of the flash |
//! | `port` | the board for the flight software |

#![no_std]
#![no_main]

mod board;
mod camera;
mod line;
mod parameters;
mod port;

use core::panic::PanicInfo;

use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, entry, exception};
use hzn_flight::flight::{Buffers, Flight, Lists};
use hzn_flight::messages::Mode;
use static_cell::ConstStaticCell;

static WORKSPACE: ConstStaticCell<Lists> = ConstStaticCell::new(Lists::new());
static BUFFERS: ConstStaticCell<Buffers> = ConstStaticCell::new(Buffers::new());

#[entry]
fn main() -> ! {
    let parts = (port::Stm32H743::take(), BUFFERS.try_take(), WORKSPACE.try_take());
    let (Some(board), Some(buffers), Some(workspace)) = parts else { SCB::sys_reset() };
    // A reference: moving the flight software would need its size twice on the stack.
    let Some(flight) = &mut Flight::start(board, buffers, workspace) else { SCB::sys_reset() };
    while flight.mode() != Mode::ShutDown {
        flight.turn();
    }
    // Power will be cut. The watchdog must not restart the program before.
    loop {
        flight.turn();
    }
}

/// The hardware library can panic. A panic is a reset, which the flight software counts like one by the watchdog.
#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    SCB::sys_reset()
}

/// A fault is a reset, too.
///
/// # Safety
/// Only the processor may call it.
#[exception]
unsafe fn HardFault(_: &ExceptionFrame) -> ! {
    SCB::sys_reset()
}
