//! Line ends of Windows, read as those of Unix.

use std::io::{self, Read};

/// A reader that leaves out each carriage return before a line feed, except within double quotes: a quoted cell keeps
/// its text.
///
/// The CSV reader takes the line feed of `\r\n` for the begin of the next record, so that it counts one line too few.
///
/// ```
/// use std::io::Read;
///
/// let mut text = String::new();
/// hzn_files::unix_lines::UnixLines::new("a\r\nb\rc\r\n\"d\r\n\"\r\n".as_bytes()).read_to_string(&mut text)?;
/// assert_eq!(text, "a\nb\rc\n\"d\r\n\"\n");
/// # Ok::<(), std::io::Error>(())
/// ```
#[derive(Debug)]
pub struct UnixLines<R> {
    inner: R,
    /// The last byte was a carriage return, which is given out only if no line feed follows.
    is_held: bool,
    is_quoted: bool,
}

impl<R: Read> UnixLines<R> {
    /// Reads from another reader.
    pub fn new(inner: R) -> Self {
        Self { inner, is_held: false, is_quoted: false }
    }
}

impl<R: Read> Read for UnixLines<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        // A byte that is held needs a place of its own; the CSV reader asks for many.
        let Some(limit) = buffer.len().checked_sub(1).filter(|limit| *limit > 0) else {
            return Err(io::Error::new(io::ErrorKind::InvalidInput, "a buffer of two bytes is needed"));
        };
        loop {
            let mut bytes = vec![0; limit];
            let n = self.inner.read(&mut bytes)?;
            let mut out = Vec::with_capacity(n + 1);
            for byte in bytes.iter().take(n) {
                if self.is_held && *byte != b'\n' {
                    out.push(b'\r');
                }
                // A doubled quote within a cell ends and begins it again.
                self.is_quoted ^= *byte == b'"';
                self.is_held = *byte == b'\r' && !self.is_quoted;
                if !self.is_held {
                    out.push(*byte);
                }
            }
            if n == 0 && std::mem::take(&mut self.is_held) {
                out.push(b'\r');
            }
            if n == 0 || !out.is_empty() {
                buffer.iter_mut().zip(&out).for_each(|(to, from)| *to = *from);
                return Ok(out.len());
            }
        }
    }
}
