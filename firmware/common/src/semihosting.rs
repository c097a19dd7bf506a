//! A call of the emulator: the number of an operation, and the address of the words that it reads (Arm, "Semihosting
//! for AArch32 and AArch64"; RISC-V, "RISC-V Semihosting").

/// Opens a file: name, mode, length of the name. Returns a handle, or the largest number.
pub(crate) const OPEN: usize = 0x01;
/// Writes: handle, bytes, their number. Returns how many were not written.
pub(crate) const WRITE: usize = 0x05;
/// Reads: handle, buffer, its length. Returns how many bytes were not filled.
pub(crate) const READ: usize = 0x06;
/// Ends the emulation: reason, status.
pub(crate) const EXIT_EXTENDED: usize = 0x20;
/// Mode "rb" of [`OPEN`].
pub(crate) const READ_BINARY: usize = 1;
/// Mode "w+b" of [`OPEN`].
pub(crate) const REWRITE_BINARY: usize = 7;

/// Calls the emulator.
///
/// # Safety
/// The words must be those of the operation: addresses of memory that it may read or write.
#[cfg(target_arch = "arm")]
pub(crate) unsafe fn call<const WORDS: usize>(operation: usize, words: &[usize; WORDS]) -> usize {
    // SAFETY: the caller keeps the contract of the operation.
    unsafe { cortex_m_semihosting::syscall(operation, words) }
}

/// Calls the emulator.
///
/// # Safety
/// The words must be those of the operation: addresses of memory that it may read or write.
#[cfg(target_arch = "riscv32")]
pub(crate) unsafe fn call<const WORDS: usize>(operation: usize, words: &[usize; WORDS]) -> usize {
    let result;
    // SAFETY: the caller keeps the contract of the operation. The two shifts around the break, which write no register,
    // mark it as a call; all three must have their long form and lie in one page.
    unsafe {
        core::arch::asm!(
            ".balign 16",
            ".option push",
            ".option norvc",
            "slli x0, x0, 0x1f",
            "ebreak",
            "srai x0, x0, 7",
            ".option pop",
            inout("a0") operation => result,
            in("a1") words.as_ptr(),
        );
    }
    result
}
