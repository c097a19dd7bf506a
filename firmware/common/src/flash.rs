//! The two copies of the parameters: `copy1.bin` and `copy2.bin` of the host. `cut.bin` has one word: power is cut
//! after this number of bytes was written.

use core::ffi::CStr;

use crate::host::{File, exit};

/// The memory of the parameters.
#[derive(Debug)]
pub struct Flash {
    /// Bytes that can still be written before power is cut.
    power: Option<u32>,
}

impl Flash {
    /// Makes the memory.
    pub fn open() -> Self {
        let mut word = [0; 4];
        let cut = File::open(c"cut.bin").is_some_and(|mut file| file.read(&mut word));
        Self { power: cut.then(|| u32::from_le_bytes(word)) }
    }
    /// Reads copy 1 or 2. Erased flash reads as 0xFF.
    pub fn read_copy(&mut self, copy: u8, into: &mut [u8]) {
        into.fill(0xFF);
        if let Some(mut file) = File::open(name(copy)) {
            // A file that is shorter than the buffer fills only its beginning.
            let _ = file.read(into);
        }
    }
    /// Writes copy 1 or 2. Returns false if the host refuses.
    pub fn write_copy(&mut self, copy: u8, bytes: &[u8]) -> bool {
        let Some(mut file) = File::create(name(copy)) else { return false };
        // A flash is written in small pieces, and power can be cut between any two of them.
        for chunk in bytes.chunks(8) {
            if let Some(left) = &mut self.power {
                match left.checked_sub(chunk.len() as u32) {
                    Some(rest) => *left = rest,
                    None => exit(99),
                }
            }
            if !file.write(chunk) {
                return false;
            }
        }
        true
    }
}

fn name(copy: u8) -> &'static CStr {
    if copy == 1 { c"copy1.bin" } else { c"copy2.bin" }
}
