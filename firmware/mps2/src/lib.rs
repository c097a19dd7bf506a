//! The code that all images for the MPS2 boards share. Only this crate has addresses of the board.
//!
//! | module | idea |
//! |---|---|
//! | [`board`] | external memory, timer, serial line, watchdog |
//! | [`cases`] | the files of the images that measure the sensor |
//! | [`host`] | files of the computer that emulates the board, by semihosting |
//! | [`port`] | the board for the flight software |
//! | [`watermark`] | the largest use of the stack |

#![no_std]

pub mod board;
pub mod cases;
pub mod host;
pub mod port;
pub mod watermark;

use core::panic::PanicInfo;

unsafe extern "C" {
    /// Is not defined anywhere: an image that can panic does not link.
    safe fn panic_path_is_linked() -> !;
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    panic_path_is_linked()
}

/// Ends the run with the status 102 after a fault. Without a handler a fault would be an endless loop.
///
/// # Safety
/// Only the processor may call it.
#[cortex_m_rt::exception]
unsafe fn HardFault(_: &cortex_m_rt::ExceptionFrame) -> ! {
    host::exit(102)
}
