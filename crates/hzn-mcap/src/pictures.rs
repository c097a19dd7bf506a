//! Reads pictures of a recording by their places.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::PathBuf;

use crate::container::{Channel, Chunk, Fields, Inflation, MAX_RECORD_BYTES, Message, Record};
use crate::error::Error;
use crate::header::Decoded;
use crate::images::{Clock, InputImage, decoder, time_s};
use crate::summary::fill;

/// The place of one picture in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    /// Offset of the chunk's record in the file; `None` for a message outside of chunks.
    pub(crate) chunk: Option<u64>,
    /// Offset of the message's record: in the file, or in the uncompressed records of a compressed chunk.
    pub(crate) message: u64,
    /// Channel of the message.
    pub(crate) channel: u16,
    /// Log time in nanoseconds.
    pub(crate) log_time_ns: u64,
    /// Sequence number.
    pub(crate) sequence: u32,
    /// The stamp of a picture of ROS 2, also one of 0; `None` for other messages, and if the header cannot be read.
    pub(crate) stamp: Option<(i32, u32)>,
}

impl Place {
    /// Returns the sequence number of the message; in recordings of hzn it is the index of the frame.
    pub fn sequence(&self) -> u32 {
        self.sequence
    }
    /// Returns log time in nanoseconds and sequence number. Both are the same for all messages of a frame. Other
    /// writers may leave out the sequence number.
    pub fn frame(&self) -> (u64, u32) {
        (self.log_time_ns, self.sequence)
    }
    /// Returns the time of the picture in seconds, of the clock of the recording's pictures ([`crate::Index::clock`]).
    /// It is that of [`InputImage::time_s`].
    pub fn time_s(&self, clock: Clock) -> Option<f64> {
        time_s(self.stamp, self.log_time_ns, clock)
    }
}

/// Returns the next of some uncompressed records: its offset, kind and content.
pub(crate) fn next_record<'a>(rest: &mut Fields<'a>, size: usize) -> Option<(u64, u8, &'a [u8])> {
    let offset = (size - rest.0.len()) as u64;
    let (op, length) = (rest.u8()?, rest.u64()?);
    Some((offset, op, rest.bytes(usize::try_from(length).ok()?)?))
}

/// Reads pictures of a recording in any order.
#[derive(Debug)]
pub struct Pictures {
    pub(crate) file: File,
    pub(crate) path: PathBuf,
    pub(crate) channels: BTreeMap<u16, Channel>,
}

impl Pictures {
    /// Reads the picture at a place. Its time is its own stamp, or the log time if it has none.
    ///
    /// # Errors
    /// The file cannot be read. A picture that cannot be decoded is no error of this function: `image` then has the
    /// reason.
    pub fn read(&mut self, place: &Place) -> Result<InputImage, Error> {
        let read = |source| Error::Read { path: self.path.clone(), source };
        let message = match place.chunk {
            None => read_record(&mut self.file, place.message).map_err(read)?.map(|r| r.content),
            Some(at) => read_message_in_chunk(&mut self.file, at, place.message).map_err(read)?,
        };
        let broken = |why: &str| InputImage::new(Decoded::without_header(why), place.log_time_ns, Clock::Log);
        let Some(message) = message.as_deref().and_then(Message::parse) else {
            return Ok(broken("the recording does not contain the picture any more, or is damaged at its place"));
        };
        let channel = self.channels.get(&place.channel);
        let Some((channel, decode)) = channel.and_then(|c| Some((c, decoder(&c.schema, &c.encoding)?))) else {
            return Ok(broken("is on a channel without pictures"));
        };
        let decoded = decode(&channel.schema, message.data);
        let is_stamped = decoded.header.as_ref().is_some_and(|header| header.stamp().is_some());
        Ok(InputImage::new(decoded, place.log_time_ns, if is_stamped { Clock::Stamps } else { Clock::Log }))
    }
}

fn read_record(file: &mut File, at: u64) -> io::Result<Option<Record>> {
    file.seek(SeekFrom::Start(at))?;
    let mut head = [0; 9];
    if !fill(file, &mut head)? {
        return Ok(None);
    }
    let mut f = Fields(&head);
    let (Some(op), Some(length)) = (f.u8(), f.u64()) else { return Ok(None) };
    if length > MAX_RECORD_BYTES {
        return Ok(None);
    }
    let mut content = Vec::new();
    file.take(length).read_to_end(&mut content)?;
    Ok((content.len() as u64 == length).then_some(Record { op, content }))
}

/// Returns the content of a message. `message` is its offset in the file, or in the uncompressed records of the chunk
/// at `chunk` if that is compressed.
fn read_message_in_chunk(file: &mut File, chunk: u64, message: u64) -> io::Result<Option<Vec<u8>>> {
    file.seek(SeekFrom::Start(chunk + 9 + 28))?;
    let mut length = [0; 4];
    if !fill(file, &mut length)? {
        return Ok(None);
    }
    if length == [0; 4] {
        return Ok(read_record(file, message)?.map(|r| r.content));
    }
    // One chunk is read at a time, so only the limit of a chunk matters.
    let parsed = read_record(file, chunk)?.and_then(|r| Chunk::parse(&r, &mut Inflation::default()).ok());
    let Some((_, plain)) = parsed else { return Ok(None) };
    let mut rest = Fields(plain.get(message as usize..).unwrap_or_default());
    Ok(next_record(&mut rest, plain.len()).map(|(_, _, content)| content.to_vec()))
}
