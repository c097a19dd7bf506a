//! Reads records one after the other from a file that may end anywhere.

use std::collections::BTreeSet;
use std::io::{self, Read, Seek, SeekFrom};

use super::op::{Fields, Op};
use super::{MAGIC, MAX_RECORD_BYTES, search};

/// One record as it is in the file.
#[derive(Debug)]
pub(crate) struct Record {
    pub(crate) op: u8,
    pub(crate) content: Vec<u8>,
}

/// Reads records in file order with the memory of one record. Where bytes are missing or damaged, it goes on with the
/// next chunk. It ends without an error where the file ends, or where nothing valid follows. [`Scanner::position`] then
/// returns the size of the valid part.
#[derive(Debug)]
pub(crate) struct Scanner<R> {
    source: R,
    position: u64,
    /// Place of the record that was returned last.
    last: u64,
    /// Bytes that were left out between valid parts.
    lost_bytes: u64,
    /// Channels whose messages are left out.
    skipped: BTreeSet<u16>,
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
        let position = MAGIC.len() as u64;
        let skipped = BTreeSet::new();
        Ok((magic == MAGIC).then_some(Self { source, position, last: position, lost_bytes: 0, skipped }))
    }

    /// Leaves out the messages of a channel. They are not read if they are outside of chunks, or in an uncompressed
    /// chunk that contains nothing else. Any other chunk is read as a whole, because its CRC covers all of it.
    pub(crate) fn skip_channel(&mut self, id: u16) {
        self.skipped.insert(id);
    }

    /// Returns the size of the file up to the end of the last complete record, in bytes.
    pub(crate) fn position(&self) -> u64 {
        self.position
    }

    /// Returns the number of bytes so far that belong to no record.
    pub(crate) fn lost_bytes(&self) -> u64 {
        self.lost_bytes
    }

    /// Returns the number of bytes behind the end of a recording, whose last record was returned just now: another
    /// recording may have been appended.
    pub(crate) fn bytes_after_end(&mut self) -> io::Result<u64> {
        while let Some(record) = self.next_here()? {
            if record.op == Op::FOOTER {
                let end = self.position + MAGIC.len() as u64;
                return Ok(self.source.seek(SeekFrom::End(0))?.saturating_sub(end));
            }
        }
        Ok(0)
    }

    /// Reads the next record; `None` at the end of the valid part.
    pub(crate) fn next(&mut self) -> io::Result<Option<Record>> {
        if let Some(record) = self.next_here()? {
            return Ok(Some(record));
        }
        // If bytes are missing in a record, it reaches into those that follow it.
        let from = self.last + 1;
        let Some(found) = search::next_chunk(&mut self.source, from)? else { return Ok(None) };
        self.source.seek(SeekFrom::Start(found))?;
        self.lost_bytes += found.abs_diff(self.position);
        self.position = found;
        self.next_here()
    }

    /// Reads the record at the position; `None` if there is none.
    fn next_here(&mut self) -> io::Result<Option<Record>> {
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
            if !self.skipped.is_empty() && self.skip_content(op, length)? {
                self.last = self.position;
                self.position += 9 + length;
                continue;
            }
            // The stated length may be wrong in a broken file, so only little memory is reserved for it.
            let mut content = Vec::with_capacity(length.min(1 << 16) as usize);
            (&mut self.source).take(length).read_to_end(&mut content)?;
            if content.len() as u64 != length {
                return Ok(None);
            }
            self.last = self.position;
            self.position += 9 + length;
            return Ok(Some(Record { op, content }));
        }
    }

    /// Goes to the end of a record if it contains only messages that are left out. Otherwise, and if the file ends
    /// before, the source stays at the beginning of the record's content.
    fn skip_content(&mut self, op: u8, length: u64) -> io::Result<bool> {
        let mut read = 0;
        let skip = match op {
            Op::MESSAGE => self.is_skipped(length, &mut read)?,
            Op::CHUNK => self.has_only_skipped(length, &mut read)?,
            _ => false,
        };
        let target = if skip { length } else { 0 };
        self.source.seek_relative(target as i64 - read as i64)?;
        Ok(skip)
    }

    /// Returns whether a message of `length` bytes is left out. `read` counts the bytes by which the source moves.
    fn is_skipped(&mut self, length: u64, read: &mut u64) -> io::Result<bool> {
        let mut channel = [0; 2];
        if length < 2 || !self.fill(&mut channel)? {
            return Ok(false);
        }
        *read += 2;
        Ok(self.skipped.contains(&u16::from_le_bytes(channel)))
    }

    /// Returns whether a chunk of `length` bytes is uncompressed and contains only messages that are left out. `read`
    /// counts the bytes by which the source moves.
    fn has_only_skipped(&mut self, length: u64, read: &mut u64) -> io::Result<bool> {
        // Times, sizes and CRC, the length of the name of the compression (0 for none), and the length of the records.
        let mut start = [0; 40];
        if length < 40 || !self.fill(&mut start)? {
            return Ok(false);
        }
        *read += 40;
        if start[28..32] != [0; 4] {
            return Ok(false);
        }
        while *read < length {
            let mut head = [0; 9];
            if !self.fill(&mut head)? {
                return Ok(false);
            }
            *read += 9;
            let mut f = Fields(&head);
            let (Some(Op::MESSAGE), Some(size)) = (f.u8(), f.u64()) else { return Ok(false) };
            let before = *read;
            if size > length.saturating_sub(before) || !self.is_skipped(size, read)? {
                return Ok(false);
            }
            self.source.seek_relative(size as i64 - 2)?;
            *read = before + size;
        }
        Ok(*read == length)
    }

    fn fill(&mut self, buffer: &mut [u8]) -> io::Result<bool> {
        match self.source.read_exact(buffer) {
            Ok(()) => Ok(true),
            Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => Ok(false),
            Err(e) => Err(e),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::container::{ChunkBuilder, Container};

    /// A file that counts the bytes that are read from it.
    struct Counted {
        file: io::Cursor<Vec<u8>>,
        bytes: u64,
    }

    impl Read for Counted {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            let n = self.file.read(buffer)?;
            self.bytes += n as u64;
            Ok(n)
        }
    }

    impl Seek for Counted {
        fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
            self.file.seek(to)
        }
    }

    const REPORT: u16 = 1;
    const PICTURE: u16 = 2;
    const PICTURE_BYTES: usize = 100_000;

    fn push(chunk: &mut ChunkBuilder, channel: u16, bytes: usize) {
        chunk.push(channel, 0, 0, |data| data.resize(data.len() + bytes, 7));
    }

    /// Reads all records of a file without the pictures. Returns the kinds of the records and the number of bytes read.
    fn scan(file: Vec<u8>) -> (Vec<u8>, u64) {
        let counted = Counted { file: io::Cursor::new(file), bytes: 0 };
        let mut scanner = Scanner::try_new(counted).unwrap().unwrap();
        scanner.skip_channel(PICTURE);
        let mut kinds = Vec::new();
        while let Some(record) = scanner.next().unwrap() {
            kinds.push(record.op);
        }
        (kinds, scanner.source.bytes)
    }

    /// Returns a file with chunks of five pictures and, if `apart` is false, of their reports.
    fn file(chunks: usize, apart: bool) -> Vec<u8> {
        let mut out = Container::try_new(Vec::new(), "hzn").unwrap();
        for _ in 0..chunks {
            let (mut pictures, mut reports) = (ChunkBuilder::default(), ChunkBuilder::default());
            for _ in 0..5 {
                push(&mut pictures, PICTURE, PICTURE_BYTES);
                push(if apart { &mut reports } else { &mut pictures }, REPORT, 100);
            }
            out.chunk(&pictures.take(false).unwrap()).unwrap();
            if apart {
                out.chunk(&reports.take(true).unwrap()).unwrap();
            }
        }
        out.finish().unwrap()
    }

    #[test]
    fn chunks_of_pictures_are_not_read() {
        let (kinds, bytes) = scan(file(20, true));
        let chunks = kinds.iter().filter(|op| **op == Op::CHUNK).count();
        assert_eq!(chunks, 20, "the chunks with reports");
        // Of a picture only the head of its message is read, and its two entries in indexes.
        let size = file(20, true).len() as u64;
        assert!(size > 100 * PICTURE_BYTES as u64 && bytes < 25_000, "{bytes} of {size} bytes");
    }

    #[test]
    fn a_chunk_with_other_messages_is_read_as_a_whole() {
        let (kinds, bytes) = scan(file(2, false));
        assert_eq!(kinds.iter().filter(|op| **op == Op::CHUNK).count(), 2);
        assert!(bytes > 10 * PICTURE_BYTES as u64, "{bytes}");
    }

    #[test]
    fn messages_outside_of_chunks_are_left_out_too() {
        let mut out = Container::try_new(Vec::new(), "hzn").unwrap();
        for channel in [PICTURE, REPORT, PICTURE, PICTURE, REPORT] {
            let mut content = channel.to_le_bytes().to_vec();
            content.resize(22 + if channel == PICTURE { PICTURE_BYTES } else { 100 }, 0);
            out.copy(&Record { op: Op::MESSAGE, content }).unwrap();
        }
        let (kinds, bytes) = scan(out.finish().unwrap());
        assert_eq!(kinds.iter().filter(|op| **op == Op::MESSAGE).count(), 2);
        assert!(bytes < 1_000, "{bytes}");
    }

    #[test]
    fn a_hole_costs_the_chunks_that_it_touches() {
        let whole = file(20, true);
        let (kinds, _) = scan(whole.clone());
        for (at, bytes) in [(3 * PICTURE_BYTES, 5_000), (7 * PICTURE_BYTES, 70_000), (21 * PICTURE_BYTES + 777, 1)] {
            let holed = [&whole[..at], &whole[at + bytes..]].concat();
            let mut scanner = Scanner::try_new(io::Cursor::new(holed)).unwrap().unwrap();
            let mut chunks = 0;
            while let Some(record) = scanner.next().unwrap() {
                let parsed = super::super::Chunk::parse(&record, &mut super::super::Inflation::default());
                chunks += usize::from(record.op == Op::CHUNK && parsed.is_ok());
            }
            // Of the 40 chunks with pictures or reports, the one with the hole is lost, and at most the next.
            assert!((38..40).contains(&chunks), "{chunks}");
            assert!(scanner.lost_bytes() < 6 * PICTURE_BYTES as u64, "{}", scanner.lost_bytes());
        }
        assert!(kinds.contains(&Op::DATA_END));
    }

    #[test]
    fn bytes_after_the_end_are_counted() {
        let (first, second) = (file(2, true), file(1, true));
        for (whole, rest) in [(first.clone(), 0), ([&first[..], &second].concat(), second.len() as u64)] {
            let mut scanner = Scanner::try_new(io::Cursor::new(whole)).unwrap().unwrap();
            while scanner.next().unwrap().is_some_and(|record| record.op != Op::DATA_END) {}
            assert_eq!(scanner.bytes_after_end().unwrap(), rest);
        }
    }

    #[test]
    fn a_cut_file_ends_before_the_record_that_is_cut() {
        let whole = file(1, true);
        let (kinds, _) = scan(whole.clone());
        for n in [60, 70, 79, 80, 100, 150, PICTURE_BYTES, whole.len() - 700] {
            let (cut, _) = scan(whole[..n].to_vec());
            assert!(cut.len() < kinds.len() && kinds.starts_with(&cut), "cut at {n}: {cut:?}");
        }
    }
}
