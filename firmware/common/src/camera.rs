//! A camera that is the file `frames.bin` of the host.
//!
//! For each picture the file has "FRAM", the length, the number of pictures lost before it and one spare word,
//! little-endian, and then the bytes of the picture. "HANG" in place of "FRAM" stands for a camera that never answers.

use crate::host::File;

/// The beginning of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Header {
    /// Bytes of the picture.
    pub bytes: usize,
    /// Number of pictures lost before it.
    pub lost: u32,
}

/// The camera.
#[derive(Debug)]
pub struct Camera(Option<File>);

impl Camera {
    /// Opens the file. Without a file the camera does not answer.
    pub fn open() -> Self {
        Self(File::open(c"frames.bin"))
    }
    /// Returns whether the camera answers.
    pub fn answers(&self) -> bool {
        self.0.is_some()
    }
    /// Returns the beginning of the next picture, if there is one. Never returns if the camera hangs: only the watchdog
    /// can end this.
    pub fn next_header(&mut self) -> Option<Header> {
        let mut header = [0; 16];
        if !self.0.as_mut()?.read(&mut header) {
            return None;
        }
        let word = |i: usize| header.get(4 * i..).and_then(|h| h.first_chunk()).map_or(0, |w| u32::from_le_bytes(*w));
        let (magic, bytes, lost) = (word(0), word(1) as usize, word(2));
        if magic == u32::from_le_bytes(*b"HANG") {
            loop {
                core::hint::spin_loop();
            }
        }
        (magic == u32::from_le_bytes(*b"FRAM")).then_some(Header { bytes, lost })
    }
    /// Fills the buffer with the next bytes of the picture. Returns false if the file ends before.
    pub fn read(&mut self, into: &mut [u8]) -> bool {
        self.0.as_mut().is_some_and(|file| file.read(into))
    }
}
