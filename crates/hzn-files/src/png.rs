//! PNG files without colour profiles and texts.
//!
//! No answer needs them, and they may be compressed: a file of 1 MB can contain 1 GB of profile, which every thread
//! would decompress. The decoder cannot skip them, so they are left out before it reads.

use std::io::{self, Read, Seek, SeekFrom};

/// First bytes of a PNG.
const SIGNATURE: [u8; 8] = *b"\x89PNG\r\n\x1a\n";
/// Length and kind, which every chunk of a PNG begins with, in bytes.
const HEAD: usize = 8;
/// Checksum at the end of every chunk, in bytes.
const CHECKSUM: u64 = 4;

/// A file, or bytes in memory.
pub trait Contents: Read + Seek {}
impl<R: Read + Seek> Contents for R {}

/// Contents of a file. If the file is a PNG, chunks with a colour profile or a text are left out. The contents are
/// behind a pointer, so that all decoders are compiled once; a buffer reads through it 8 KiB at a time.
pub struct WithoutProfiles<'a> {
    contents: Box<dyn Contents + 'a>,
    is_png: bool,
    /// Beginning of a chunk that is not left out, and the part of it that is still to be read.
    head: [u8; HEAD],
    unread: std::ops::Range<usize>,
    /// Number of bytes up to the next chunk.
    left: u64,
    /// Number of bytes that were read, without those that are left out.
    position: u64,
}

impl<'a> WithoutProfiles<'a> {
    /// Reads the first bytes, which show whether the file is a PNG.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn new(mut contents: Box<dyn Contents + 'a>) -> io::Result<Self> {
        let mut start = [0; SIGNATURE.len()];
        let len = read_up_to(&mut contents, &mut start)?;
        contents.rewind()?;
        let is_png = start.get(..len) == Some(&SIGNATURE);
        Ok(Self { contents, is_png, head: [0; HEAD], unread: 0..0, left: SIGNATURE.len() as u64, position: 0 })
    }

    /// Reads the beginning of the next chunk that is not left out. At the end of the file there is none.
    fn next_chunk(&mut self) -> io::Result<()> {
        loop {
            let len = read_up_to(&mut self.contents, &mut self.head)?;
            let [a, b, c, d, kind @ ..] = self.head;
            let length = u64::from(u32::from_be_bytes([a, b, c, d])) + CHECKSUM;
            if len == HEAD && [b"iCCP", b"iTXt", b"tEXt", b"zTXt"].contains(&&kind) {
                self.contents.seek(SeekFrom::Current(length as i64))?;
            } else {
                // If the file is truncated within a head, the decoder says so.
                (self.unread, self.left) = (0..len, if len == HEAD { length } else { 0 });
                return Ok(());
            }
        }
    }
}

impl std::fmt::Debug for WithoutProfiles<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("WithoutProfiles").field("is_png", &self.is_png).finish_non_exhaustive()
    }
}

impl Read for WithoutProfiles<'_> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        if !self.is_png {
            return self.contents.read(out);
        }
        if self.unread.is_empty() && self.left == 0 {
            self.next_chunk()?;
        }
        let len = if self.unread.is_empty() {
            let len = Read::by_ref(&mut self.contents).take(self.left).read(out)?;
            self.left -= len as u64;
            len
        } else {
            let len = self.head.get(self.unread.clone()).unwrap_or_default().read(out)?;
            self.unread.start += len;
            len
        };
        self.position += len as u64;
        Ok(len)
    }
}

/// A decoder of a PNG returns at most to the start of the file.
impl Seek for WithoutProfiles<'_> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match to {
            _ if !self.is_png => return self.contents.seek(to),
            SeekFrom::Current(0) => {}
            SeekFrom::Start(0) => {
                self.contents.rewind()?;
                (self.unread, self.left, self.position) = (0..0, SIGNATURE.len() as u64, 0);
            }
            _ => return Err(io::ErrorKind::Unsupported.into()),
        }
        Ok(self.position)
    }
}

/// Reads until `out` is full or the file ends, and returns the number of bytes.
fn read_up_to(contents: &mut impl Read, mut out: &mut [u8]) -> io::Result<usize> {
    let asked = out.len() as u64;
    Ok(io::copy(&mut contents.take(asked), &mut out)? as usize)
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    #[test]
    fn only_the_four_kinds_of_chunks_are_left_out() {
        let chunk =
            |kind: &[u8; 4], data: &[u8]| [&(data.len() as u32).to_be_bytes()[..], kind, data, b"sums"].concat();
        let kept = [SIGNATURE.to_vec(), chunk(b"eXIf", b"exposure"), chunk(b"IDAT", b"pixels"), chunk(b"IEND", b"")];
        let [start, exif, pixels, end] = &kept;
        let texts = [b"iCCP", b"iTXt", b"tEXt", b"zTXt"].map(|kind| chunk(kind, &[9; 300])).concat();
        let file = [start, &texts, exif, pixels, &texts, end].map(Vec::as_slice).concat();
        let mut read = Vec::new();
        let mut reader = WithoutProfiles::new(Box::new(Cursor::new(&file))).unwrap();
        reader.read_to_end(&mut read).unwrap();
        assert_eq!(read, kept.concat());
        assert_eq!(reader.stream_position().unwrap(), read.len() as u64);
        // The file is truncated at each byte. All that precedes the end is read, and nothing is read twice. If the head
        // of a chunk is truncated, its kind is unknown, so the part of the head is read, too.
        for len in SIGNATURE.len()..file.len() {
            let mut reader = WithoutProfiles::new(Box::new(Cursor::new(&file[..len]))).unwrap();
            reader.read_to_end(&mut Vec::new()).unwrap();
            reader.rewind().unwrap();
            let mut part = Vec::new();
            reader.read_to_end(&mut part).unwrap();
            assert!(read.starts_with(&part[..part.len().saturating_sub(HEAD - 1)]), "{len}");
        }
    }

    #[test]
    fn other_files_are_read_whole() {
        for file in [&b"P5 1 1 255 x"[..], b"", b"\x89PNG"] {
            let mut read = Vec::new();
            let mut reader = WithoutProfiles::new(Box::new(Cursor::new(file))).unwrap();
            reader.read_to_end(&mut read).unwrap();
            assert_eq!(read, file);
            assert_eq!(reader.seek(SeekFrom::End(0)).unwrap(), file.len() as u64);
        }
    }
}
