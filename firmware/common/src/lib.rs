//! The code that the images for emulated boards share. It has no addresses of a board.
//!
//! | module | idea |
//! |---|---|
//! | [`array`] | the sensor of a thermal array |
//! | [`camera`] | a camera that is a file of the host |
//! | [`flash`] | the memory of the parameters, in files of the host |
//! | [`host`] | files of the computer that emulates the board, by semihosting |
//! | [`image`] | the program in flash |
//! | [`keys`] | the keys of telecommands, in files of the host |
//! | [`watermark`] | the largest use of the stack |

#![no_std]

pub mod array;
pub mod camera;
pub mod flash;
pub mod host;
pub mod image;
pub mod keys;
mod semihosting;
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

/// The status with which a run ends after a fault.
pub const FAULT: u32 = 102;

/// Ends the run with the status [`FAULT`] after a fault. Without a handler a fault would be an endless loop.
///
/// # Safety
/// Only the processor may call it.
#[cfg(target_arch = "arm")]
#[cortex_m_rt::exception]
unsafe fn HardFault(_: &cortex_m_rt::ExceptionFrame) -> ! {
    host::exit(FAULT)
}
