//! The program in flash.

unsafe extern "C" {
    /// Begin of the vector table, which is the begin of the image.
    static __vector_table: u8;
    /// End of the constants in flash; the initial values of variables follow.
    static __sidata: u8;
    static __sdata: u8;
    static __edata: u8;
}

/// Returns the program image in flash, as `objcopy -O binary` writes it.
pub fn bytes() -> &'static [u8] {
    let (begin, constants_end) = (&raw const __vector_table, &raw const __sidata);
    let variables = (&raw const __edata as usize).saturating_sub(&raw const __sdata as usize);
    let length = (constants_end as usize).saturating_sub(begin as usize) + variables;
    // SAFETY: the linker places the image in flash without gaps that are not mapped, and nothing writes to it.
    unsafe { core::slice::from_raw_parts(begin, length) }
}
