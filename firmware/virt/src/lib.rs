//! The start-up code of the machine, its clock, and the page of flash that has the sensor.

#![no_std]

use core::arch::{asm, global_asm};
use core::sync::atomic::{AtomicBool, Ordering};

use hzn_core::prepared::MAX_BYTES;
use hzn_firmware::{FAULT, host};

// Sets the handler of faults and the stack, paints the stack, clears the variables, and calls `main`.
global_asm!(
    ".section .init",
    ".globl _start",
    "_start:",
    "la t0, 3f",
    "csrw mtvec, t0",
    "la sp, _stack_start",
    "la t0, _stack_end",
    "li t1, 0xCCCCCCCC",
    "1: sw t1, 0(t0)",
    "addi t0, t0, 4",
    "bltu t0, sp, 1b",
    "la t0, _bss_start",
    "la t1, _bss_end",
    "2: sw zero, 0(t0)",
    "addi t0, t0, 4",
    "bltu t0, t1, 2b",
    "j main",
    // The address of a handler is a multiple of four.
    ".balign 4",
    "3: j {fault}",
    ".text",
    fault = sym fault,
);

/// Ends the run after a fault.
extern "C" fn fault() -> ! {
    host::exit(FAULT)
}

unsafe extern "C" {
    static mut _page: [u8; MAX_BYTES];
}

static TAKEN: AtomicBool = AtomicBool::new(false);

/// Takes the page of flash that has the sensor. Returns `None` the second time.
pub fn take_page() -> Option<&'static mut [u8; MAX_BYTES]> {
    if TAKEN.swap(true, Ordering::Relaxed) {
        return None;
    }
    // SAFETY: the linker reserves this memory for the page, and `TAKEN` ensures that it is handed out only once. Every
    // byte is valid.
    unsafe { (&raw mut _page).as_mut() }
}

/// Returns the instructions since the start, modulo 2³².
pub fn instructions() -> u32 {
    let count;
    // SAFETY: this reads a counter.
    unsafe { asm!("csrr {}, minstret", out(reg) count, options(nomem, nostack)) };
    count
}
