//! Pictures without headers from a pipe, one after the other.

use std::io::{self, Read};

use super::samples::Samples;
use super::{Camera, Ended, Next};

/// A pipe. It is read only as fast as pictures are taken, so that the program before it waits and nothing is lost.
#[derive(Debug)]
pub struct Pipe<R> {
    from: R,
    samples: Samples,
    raw: Vec<u8>,
}

impl<R: Read + Send> Pipe<R> {
    /// Makes a source of the pictures that `from` has.
    pub fn new(from: R, samples: Samples) -> Self {
        Self { from, samples, raw: Vec::new() }
    }
}

impl<R: Read + Send> Camera for Pipe<R> {
    fn next(&mut self, into: Option<&mut Vec<u8>>) -> Next {
        let Some(into) = into else { return Next::Nothing };
        let expected = self.samples.bytes();
        let is_plain = self.samples.is_plain();
        let room = if is_plain { &mut *into } else { &mut self.raw };
        room.resize(expected, 0);
        let mut filled = 0;
        while let Some(rest) = room.get_mut(filled..).filter(|rest| !rest.is_empty()) {
            match self.from.read(rest) {
                Ok(0) if filled == 0 => return Next::End(Ended::Whole),
                Ok(0) => return Next::End(Ended::Partial { bytes: filled, expected }),
                Ok(n) => filled += n,
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                Err(e) => return Next::End(Ended::Failed(format!("the pipe cannot be read: {e}"))),
            }
        }
        if !is_plain && let Err(why) = self.samples.convert(&self.raw, into) {
            return Next::End(Ended::Failed(why));
        }
        Next::Picture { lost: 0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pipe_is_cut_into_pictures() {
        let samples = Samples::Raw("4x2:mono8".parse().unwrap());
        let bytes: Vec<u8> = (0..21).collect();
        let mut pipe = Pipe::new(&bytes[..], samples);
        let mut picture = Vec::new();
        assert_eq!(pipe.next(None), Next::Nothing);
        for first in [0, 8] {
            assert_eq!(pipe.next(Some(&mut picture)), Next::Picture { lost: 0 });
            assert_eq!(picture, (first..first + 8).collect::<Vec<u8>>());
        }
        assert_eq!(pipe.next(Some(&mut picture)), Next::End(Ended::Partial { bytes: 5, expected: 8 }));
        let mut whole = Pipe::new(&bytes[..8], samples);
        assert_eq!(whole.next(Some(&mut picture)), Next::Picture { lost: 0 });
        assert_eq!(whole.next(Some(&mut picture)), Next::End(Ended::Whole));
    }
}
