//! The largest use of the stack. The start-up code paints the stack before `main`: that of cortex-m-rt does (feature
//! `paint-stack`).

unsafe extern "C" {
    static mut _stack_end: u32;
    static mut _stack_start: u32;
}

/// The word with which the stack is painted.
const PAINT: u32 = 0xCCCC_CCCC;
#[cfg(target_arch = "arm")]
const _: () = assert!(PAINT == cortex_m_rt::STACK_PAINT_VALUE);

/// Returns the bytes between the start of the stack and the deepest word that was ever written.
pub fn stack_bytes() -> u32 {
    let (end, start) = (&raw mut _stack_end, &raw mut _stack_start);
    let mut at = end;
    // SAFETY: this reads words between the linker's symbols `_stack_end` and `_stack_start`, which is RAM.
    while at < start && unsafe { at.read_volatile() } == PAINT {
        at = at.wrapping_add(1);
    }
    (start as usize - at as usize) as u32
}
