//! Files and the end of the program, by semihosting: the computer that emulates the board carries them out.

use cortex_m_semihosting::{debug, nr, syscall};

const EXIT_EXTENDED: usize = 0x20;

/// Ends the emulation with a status.
pub fn exit(status: u32) -> ! {
    let block = [0x20026, status as usize]; // ADP_Stopped_ApplicationExit
    // SAFETY: SYS_EXIT_EXTENDED reads the two words.
    unsafe { cortex_m_semihosting::syscall(EXIT_EXTENDED, &block) };
    // An emulator may not know the extended form.
    loop {
        debug::exit(if status == 0 { debug::EXIT_SUCCESS } else { debug::EXIT_FAILURE });
    }
}

/// An open file.
#[derive(Debug)]
pub struct File {
    handle: usize,
}

impl File {
    /// Opens a file for reading. `name` ends with a zero byte.
    pub fn open(name: &core::ffi::CStr) -> Option<Self> {
        Self::open_with_mode(name, nr::open::R_BINARY)
    }
    /// Creates a file for writing, or empties it.
    pub fn create(name: &core::ffi::CStr) -> Option<Self> {
        Self::open_with_mode(name, nr::open::RW_TRUNC_BINARY)
    }
    fn open_with_mode(name: &core::ffi::CStr, mode: usize) -> Option<Self> {
        // SAFETY: SYS_OPEN reads the name; its length is passed.
        let handle = unsafe { syscall!(OPEN, name.as_ptr(), mode, name.count_bytes()) };
        (handle != usize::MAX).then_some(Self { handle })
    }
    /// Fills the buffer. Returns false if the file ends before.
    pub fn read(&mut self, buffer: &mut [u8]) -> bool {
        // SAFETY: SYS_READ writes at most the given number of bytes to the buffer.
        unsafe { syscall!(READ, self.handle, buffer.as_mut_ptr(), buffer.len()) == 0 }
    }
    /// Appends bytes. Returns false if the file cannot take them.
    pub fn write(&mut self, bytes: &[u8]) -> bool {
        // SAFETY: SYS_WRITE reads the given number of bytes.
        unsafe { syscall!(WRITE, self.handle, bytes.as_ptr(), bytes.len()) == 0 }
    }
}
