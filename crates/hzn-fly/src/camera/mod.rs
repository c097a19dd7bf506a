//! Pictures from a camera, a pipe or a recording, as the flight loop takes them: one byte for each pixel, row by row.

mod capture;
mod device;
mod pipe;
mod recording;
mod samples;
#[cfg(target_os = "linux")]
mod v4l2;

pub use capture::{Capture, FromCamera, Recorded, Shot};
pub use device::{Device, DeviceCamera, OpenDevice};
pub use pipe::Pipe;
pub use recording::Recording;
pub use samples::Samples;
#[cfg(target_os = "linux")]
pub use v4l2::V4l2;

/// What a camera returns.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Next {
    /// The buffer has a picture. Before it, this many pictures were lost.
    Picture {
        /// Pictures that the camera took and nobody read.
        lost: u32,
    },
    /// There is no picture now; ask again.
    Nothing,
    /// There are no more pictures.
    End(Ended),
}

/// Why there are no more pictures.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Ended {
    /// The pipe was closed after a whole picture.
    Whole,
    /// The pipe was closed within a picture.
    Partial {
        /// Bytes of the last picture.
        bytes: usize,
        /// Bytes of a whole picture.
        expected: usize,
    },
    /// The pipe cannot be read.
    Failed(String),
}

/// A source of pictures.
pub trait Camera: Send {
    /// Waits for the next picture and writes its pixels into the buffer, which may have another length. `None` means
    /// that the caller has no buffer: a camera then loses the picture, and a pipe is not read.
    fn next(&mut self, into: Option<&mut Vec<u8>>) -> Next;
}
