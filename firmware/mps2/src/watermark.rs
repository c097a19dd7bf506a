//! How much stack was used: cortex-m-rt paints it before `main` (feature `paint-stack`).

unsafe extern "C" {
    static mut _stack_end: u32;
    static mut _stack_start: u32;
}

/// Bytes between the start of the stack and the deepest word that was ever written.
pub fn stack_bytes() -> u32 {
    let (end, start) = (&raw mut _stack_end, &raw mut _stack_start);
    let mut at = end;
    // SAFETY: reads words between the linker's symbols `_stack_end` and `_stack_start`, which is RAM.
    while at < start && unsafe { at.read_volatile() } == cortex_m_rt::STACK_PAINT_VALUE {
        at = at.wrapping_add(1);
    }
    (start as usize - at as usize) as u32
}
