//! An index of the pictures and reports in a recording, so that any picture can be shown at once.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use crate::container::{Channel, Chunk, Fields, Inflation, MAGIC, MAX_RECORD_BYTES, Message, Op, Record, Schemas};
use crate::error::Error;
use crate::frame::{CandidateEdge, PicturePrior};
use crate::images::{InputImage, decoder};
use crate::messages;
use crate::row::Row;
use crate::topics::Topic;
use crate::writer::SENSOR_TOML;

/// The place of one picture in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    /// Offset of the chunk's record in the file; `None` for a message outside of chunks.
    chunk: Option<u64>,
    /// Offset of the message's record: in the file, or in the uncompressed records of a compressed chunk.
    message: u64,
    /// Channel of the message.
    channel: u16,
    /// Log time in nanoseconds.
    log_time_ns: u64,
    /// Sequence number.
    sequence: u32,
}

impl Place {
    /// Returns the sequence number of the message; in recordings of hzn it is the index of the frame.
    pub fn sequence(&self) -> u32 {
        self.sequence
    }
    /// Returns the log time in seconds.
    pub fn log_time_s(&self) -> f64 {
        self.log_time_ns as f64 * 1e-9
    }
}

/// An entry of the index. Entries are in the order of the file.
#[derive(Debug, Clone, PartialEq)]
pub enum IndexEntry {
    /// A picture, which is not read yet.
    Picture(Place),
    /// The result of one picture and body.
    Report(Box<Row>, Vec<CandidateEdge>, Box<PicturePrior>),
}

/// Goes through a recording without reading its uncompressed pictures. The recording may be one of hzn, or one of any
/// writer with pictures that [`crate::ImageReader`] can read. Only pictures of the first topic with pictures are found.
/// In a file that was cut off everything complete is found; [`Index::is_complete`] then returns `false`.
#[derive(Debug)]
pub struct Index {
    file: BufReader<File>,
    path: PathBuf,
    position: u64,
    sensor_toml: Option<String>,
    schemas: Schemas,
    /// Channels with pictures.
    pictures: BTreeMap<u16, Channel>,
    reports: Option<u16>,
    complete: bool,
    inflation: Inflation,
    broken_chunks: u64,
}

impl Index {
    /// Opens a recording and reads the records before its first message.
    ///
    /// # Errors
    /// The file cannot be read or is not an MCAP.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, Error> {
        let path = path.as_ref().to_path_buf();
        let read = |source| Error::Read { path: path.clone(), source };
        let mut file = BufReader::with_capacity(1 << 13, File::open(&path).map_err(read)?);
        let mut magic = [0; MAGIC.len()];
        if !fill(&mut file, &mut magic).map_err(read)? || magic != MAGIC {
            return Err(Error::NotMcap { path });
        }
        let mut index = Self {
            file,
            path: path.clone(),
            position: MAGIC.len() as u64,
            sensor_toml: None,
            schemas: Schemas::default(),
            pictures: BTreeMap::new(),
            reports: None,
            complete: false,
            inflation: Inflation::default(),
            broken_chunks: 0,
        };
        while let Some((op, length)) = index.read_head().map_err(read)? {
            if matches!(op, Op::CHUNK | Op::MESSAGE | Op::DATA_END) {
                index.file.seek_relative(-9).map_err(read)?;
                break;
            }
            let Some(content) = index.read_content(length).map_err(read)? else { break };
            index.read_declaration(op, &content);
        }
        Ok(index)
    }

    /// Returns the text of the attached sensor.toml if it is before the first message, as in recordings of hzn.
    pub fn sensor_toml(&self) -> Option<&str> {
        self.sensor_toml.as_deref()
    }
    /// Returns whether the recording was closed properly; valid at the end.
    pub fn is_complete(&self) -> bool {
        self.complete
    }
    /// Returns the number of chunks with damaged contents so far.
    pub fn broken_chunks(&self) -> u64 {
        self.broken_chunks
    }

    /// Returns whether a channel with reports was found so far.
    pub fn has_reports(&self) -> bool {
        self.reports.is_some()
    }
    /// Returns the number of channels with pictures that were found so far.
    pub fn channels(&self) -> usize {
        self.pictures.len()
    }

    /// Returns the entries of the next part of the file, which may be empty; `None` at the end.
    ///
    /// # Errors
    /// The file cannot be read, or a report cannot be decoded.
    pub fn next_part(&mut self) -> Result<Option<Vec<IndexEntry>>, Error> {
        let mut found = Vec::new();
        let more = self.step(&mut found).map_err(|source| Error::Read { path: self.path.clone(), source })??;
        Ok(more.then_some(found))
    }

    fn step(&mut self, found: &mut Vec<IndexEntry>) -> io::Result<Result<bool, Error>> {
        let Some((op, length)) = self.read_head()? else { return Ok(Ok(false)) };
        match op {
            Op::DATA_END => {
                self.complete = true;
                Ok(Ok(false))
            }
            Op::CHUNK => self.read_chunk(length, found),
            Op::MESSAGE => {
                let start = self.position;
                let Some(content) = self.read_content(length)? else { return Ok(Ok(false)) };
                let message = Message::parse(&content);
                Ok(message.map_or(Ok(()), |m| self.add_message(&m, None, start, found)).map(|()| true))
            }
            _ => {
                let Some(content) = self.read_content(length)? else { return Ok(Ok(false)) };
                self.read_declaration(op, &content);
                Ok(Ok(true))
            }
        }
    }

    fn read_chunk(&mut self, length: u64, found: &mut Vec<IndexEntry>) -> io::Result<Result<bool, Error>> {
        // Times, sizes and CRC, the name of the compression and the length of the records.
        let mut head = [0; 40];
        if length < 40 || !fill(&mut self.file, &mut head)? {
            return Ok(Ok(false));
        }
        if head.get(28..32) == Some(&[0; 4]) {
            return self.read_plain_chunk(length, found);
        }
        self.file.seek_relative(-40)?;
        self.read_compressed_chunk(length, found)
    }

    /// Reads a compressed chunk as a whole.
    fn read_compressed_chunk(&mut self, length: u64, found: &mut Vec<IndexEntry>) -> io::Result<Result<bool, Error>> {
        let start = self.position;
        let Some(content) = self.read_content(length)? else { return Ok(Ok(false)) };
        let Ok((chunk, plain)) = Chunk::parse(&Record { op: Op::CHUNK, content }, &mut self.inflation) else {
            self.broken_chunks += 1;
            return Ok(Ok(true));
        };
        for (op, _, content) in &chunk.index.declared {
            self.read_declaration(*op, content);
        }
        let mut rest = Fields(&plain);
        while let Some((offset, op, content)) = next_record(&mut rest, plain.len()) {
            if op == Op::MESSAGE
                && let Some(m) = Message::parse(content)
                && let Err(e) = self.add_message(&m, Some(start), offset, found)
            {
                return Ok(Err(e));
            }
        }
        Ok(Ok(true))
    }

    /// Reads the heads of the records in an uncompressed chunk, and the data of its reports. The first 40 bytes of the
    /// chunk are read already.
    fn read_plain_chunk(&mut self, length: u64, found: &mut Vec<IndexEntry>) -> io::Result<Result<bool, Error>> {
        let start = self.position;
        let end = start + 9 + length;
        let mut offset = start + 9 + 40;
        let is_whole = self.file.get_ref().metadata()?.len() >= end;
        while is_whole && offset + 9 <= end {
            let mut head = [0; 9];
            if !fill(&mut self.file, &mut head)? {
                break;
            }
            let mut f = Fields(&head);
            let (Some(op), Some(length)) = (f.u8(), f.u64()) else { break };
            if op == 0 || length > end - offset - 9 {
                self.broken_chunks += 1;
                break;
            }
            let mut skip = length;
            if op == Op::MESSAGE && length >= 22 {
                let mut head = [0; 22];
                if !fill(&mut self.file, &mut head)? {
                    break;
                }
                skip -= 22;
                let Some(m) = Message::parse(&head) else { break };
                let mut data = Vec::new();
                if self.reports == Some(m.channel) {
                    data.resize(skip as usize, 0);
                    skip = 0;
                    if !fill(&mut self.file, &mut data)? {
                        break;
                    }
                }
                if let Err(e) = self.add_message(&Message { data: &data, ..m }, Some(start), offset, found) {
                    return Ok(Err(e));
                }
            } else if matches!(op, Op::SCHEMA | Op::CHANNEL) {
                let mut content = vec![0; length as usize];
                if !fill(&mut self.file, &mut content)? {
                    break;
                }
                self.read_declaration(op, &content);
                skip = 0;
            }
            self.file.seek_relative(skip as i64)?;
            offset += 9 + length;
        }
        self.file.seek(SeekFrom::Start(end))?;
        self.position = end;
        Ok(Ok(is_whole))
    }

    fn add_message(
        &mut self,
        m: &Message<'_>,
        chunk: Option<u64>,
        at: u64,
        found: &mut Vec<IndexEntry>,
    ) -> Result<(), Error> {
        if self.reports == Some(m.channel) {
            let broken = |e: serde_json::Error| Error::Decode {
                path: self.path.clone(),
                detail: format!("report of frame {}: {e}", m.sequence),
            };
            let (row, candidates, prior) = messages::parse_report(m.data).map_err(broken)?;
            found.push(IndexEntry::Report(Box::new(row), candidates, Box::new(prior)));
        } else if self.pictures.contains_key(&m.channel) {
            let (channel, log_time_ns, sequence) = (m.channel, m.log_time_ns, m.sequence);
            found.push(IndexEntry::Picture(Place { chunk, message: at, channel, log_time_ns, sequence }));
        }
        Ok(())
    }

    /// Creates a reader for the pictures found so far and for later ones on the same channels.
    ///
    /// # Errors
    /// The file cannot be opened again.
    pub fn pictures(&self) -> Result<Pictures, Error> {
        let file = File::open(&self.path).map_err(|source| Error::Read { path: self.path.clone(), source })?;
        Ok(Pictures { file, path: self.path.clone(), channels: self.pictures.clone() })
    }

    /// Reads a record outside of chunks, or one that a chunk declares.
    fn read_declaration(&mut self, op: u8, content: &[u8]) {
        if let Some((id, channel)) = self.schemas.declare(op, content) {
            if channel.topic == Topic::Report.name() && channel.schema == Topic::Report.schema().0 {
                self.reports = Some(id);
            } else if decoder(&channel.schema, &channel.encoding).is_some()
                && self.pictures.values().all(|first| first.topic == channel.topic)
            {
                self.pictures.insert(id, channel);
            }
        }
        if op == Op::ATTACHMENT {
            let text = Fields(content).attached(SENSOR_TOML).map(|data| String::from_utf8_lossy(data).into_owned());
            self.sensor_toml = self.sensor_toml.take().or(text);
        }
    }

    /// Reads kind and length of the record at `position`.
    fn read_head(&mut self) -> io::Result<Option<(u8, u64)>> {
        let mut head = [0; 9];
        if !fill(&mut self.file, &mut head)? {
            return Ok(None);
        }
        let mut f = Fields(&head);
        let (Some(op), Some(length)) = (f.u8(), f.u64()) else { return Ok(None) };
        Ok((op != 0 && length <= MAX_RECORD_BYTES).then_some((op, length)))
    }

    /// Reads the content of the record after its head; `None` if the file ends before.
    fn read_content(&mut self, length: u64) -> io::Result<Option<Vec<u8>>> {
        let mut content = Vec::new();
        // The stated length may be wrong in a broken file, so no memory is reserved for it.
        (&mut self.file).take(length).read_to_end(&mut content)?;
        self.position += 9 + length;
        Ok((content.len() as u64 == length).then_some(content))
    }
}

/// Returns the next of some uncompressed records: its offset, kind and content.
fn next_record<'a>(rest: &mut Fields<'a>, size: usize) -> Option<(u64, u8, &'a [u8])> {
    let offset = (size - rest.0.len()) as u64;
    let (op, length) = (rest.u8()?, rest.u64()?);
    Some((offset, op, rest.bytes(usize::try_from(length).ok()?)?))
}

fn fill(file: &mut impl Read, buffer: &mut [u8]) -> io::Result<bool> {
    match file.read_exact(buffer) {
        Ok(()) => Ok(true),
        Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => Ok(false),
        Err(e) => Err(e),
    }
}

/// Reads pictures of a recording in any order.
#[derive(Debug)]
pub struct Pictures {
    file: File,
    path: PathBuf,
    channels: BTreeMap<u16, Channel>,
}

impl Pictures {
    /// Reads the picture at a place.
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
        let broken = |why: &str| InputImage { time_s: place.log_time_s(), image: Err(why.to_owned()) };
        let Some(message) = message.as_deref().and_then(Message::parse) else {
            return Ok(broken("the recording does not contain the picture any more, or is damaged at its place"));
        };
        let channel = self.channels.get(&place.channel);
        let Some((channel, decode)) = channel.and_then(|c| Some((c, decoder(&c.schema, &c.encoding)?))) else {
            return Ok(broken("is on a channel without pictures"));
        };
        Ok(match decode(&channel.schema, message.data) {
            Ok((image, time_s)) => {
                InputImage { time_s: time_s.unwrap_or_else(|| place.log_time_s()), image: Ok(image) }
            }
            Err(why) => broken(&why),
        })
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
