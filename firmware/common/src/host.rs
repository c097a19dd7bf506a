//! Files and the end of the program, by semihosting: the computer that emulates the board carries them out.

use crate::semihosting::{EXIT_EXTENDED, OPEN, READ, READ_BINARY, REWRITE_BINARY, WRITE, call};

/// Ends the emulation with a status.
pub fn exit(status: u32) -> ! {
    let block = [0x20026, status as usize]; // ADP_Stopped_ApplicationExit
    loop {
        // SAFETY: SYS_EXIT_EXTENDED reads the two words.
        unsafe { call(EXIT_EXTENDED, &block) };
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
        Self::open_with_mode(name, READ_BINARY)
    }
    /// Creates a file for writing, or empties it.
    pub fn create(name: &core::ffi::CStr) -> Option<Self> {
        Self::open_with_mode(name, REWRITE_BINARY)
    }
    fn open_with_mode(name: &core::ffi::CStr, mode: usize) -> Option<Self> {
        // SAFETY: SYS_OPEN reads the name; its length is passed.
        let handle = unsafe { call(OPEN, &[name.as_ptr().expose_provenance(), mode, name.count_bytes()]) };
        (handle != usize::MAX).then_some(Self { handle })
    }
    /// Fills the buffer. Returns false if the file ends before.
    pub fn read(&mut self, buffer: &mut [u8]) -> bool {
        // SAFETY: SYS_READ writes at most the given number of bytes to the buffer.
        unsafe { call(READ, &[self.handle, buffer.as_mut_ptr().expose_provenance(), buffer.len()]) == 0 }
    }
    /// Appends bytes. Returns false if the file cannot take them.
    pub fn write(&mut self, bytes: &[u8]) -> bool {
        // SAFETY: SYS_WRITE reads the given number of bytes.
        unsafe { call(WRITE, &[self.handle, bytes.as_ptr().expose_provenance(), bytes.len()]) == 0 }
    }
}
