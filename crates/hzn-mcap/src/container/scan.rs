//! Reads records one after the other from a file that may end anywhere.

use std::io::{self, Read, Seek, SeekFrom};

use super::op::{Fields, Op};
use super::{MAGIC, MAX_RECORD_BYTES};

/// One record as it is in the file.
#[derive(Debug)]
pub(crate) struct Record {
    pub(crate) op: u8,
    pub(crate) content: Vec<u8>,
}

/// Reads records in file order with the memory of one record. It ends without an error where the file ends or is not
/// valid any more. [`Scanner::position`] then returns the size of the valid part.
#[derive(Debug)]
pub(crate) struct Scanner<R> {
    source: R,
    position: u64,
    skip_plain_chunks: bool,
}

impl<R: Read + Seek> Scanner<R> {
    /// Checks the magic bytes; `None` if they are missing.
    pub(crate) fn try_new(mut source: R) -> io::Result<Option<Self>> {
        let mut magic = [0; MAGIC.len()];
        match source.read_exact(&mut magic) {
            Ok(()) => {}
            Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => return Ok(None),
            Err(e) => return Err(e),
        }
        Ok((magic == MAGIC).then_some(Self { source, position: MAGIC.len() as u64, skip_plain_chunks: false }))
    }

    /// Skips uncompressed chunks, which have the pictures, without reading them.
    pub(crate) fn skip_plain_chunks(&mut self, skip: bool) {
        self.skip_plain_chunks = skip;
    }

    /// Returns the size of the file up to the end of the last complete record, in bytes.
    pub(crate) fn position(&self) -> u64 {
        self.position
    }

    /// Reads the next record; `None` at the end of the valid part.
    pub(crate) fn next(&mut self) -> io::Result<Option<Record>> {
        loop {
            let mut head = [0; 9];
            if !self.fill(&mut head)? {
                return Ok(None);
            }
            let mut f = Fields(&head);
            let (Some(op), Some(length)) = (f.u8(), f.u64()) else { return Ok(None) };
            // 0 is not a record. 0x89 is the first magic byte at the end of a file, but also a valid number of private
            // records.
            if op == 0 || length > MAX_RECORD_BYTES {
                return Ok(None);
            }
            let mut content = Vec::new();
            if op == Op::CHUNK && self.skip_plain_chunks {
                // Times, sizes and CRC, then the length of the name of the compression: 0 for none.
                let mut start = [0; 32];
                if length < 32 || !self.fill(&mut start)? {
                    return Ok(None);
                }
                if start[28..] == [0; 4] {
                    self.source.seek(SeekFrom::Current(length as i64 - 32))?;
                    self.position += 9 + length;
                    continue;
                }
                content.extend_from_slice(&start);
            }
            let rest = length - content.len() as u64;
            // The stated length may be wrong in a broken file, so no memory is reserved for it.
            (&mut self.source).take(rest).read_to_end(&mut content)?;
            if content.len() as u64 != length {
                return Ok(None);
            }
            self.position += 9 + length;
            return Ok(Some(Record { op, content }));
        }
    }

    fn fill(&mut self, buffer: &mut [u8]) -> io::Result<bool> {
        match self.source.read_exact(buffer) {
            Ok(()) => Ok(true),
            Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => Ok(false),
            Err(e) => Err(e),
        }
    }
}
