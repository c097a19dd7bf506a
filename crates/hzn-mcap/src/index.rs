//! An index of the pictures and reports in a recording, so that any picture can be shown at once.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use hzn_files::FrameData;

use crate::cdr;
use crate::container::{
    Channel, Chunk, ChunkFault, Fields, Inflation, MAGIC, MAX_RECORD_BYTES, Message, Op, Record, Schemas,
};
use crate::error::Error;
use crate::frame::CandidateEdge;
use crate::images::{Clock, ImageReader, decoder};
use crate::messages;
use crate::pictures::{Pictures, Place, next_record};
use crate::row::Row;
use crate::summary::{self, fill};
use crate::topics::Topic;
use crate::writer::SENSOR_TOML;

/// Largest part of a message that is read for its stamp: a header and the name of its frame.
const MAX_HEADER_BYTES: u64 = 1024;

/// An entry of the index. Entries are in the order of the file.
#[derive(Debug, Clone, PartialEq)]
pub enum IndexEntry {
    /// A picture, which is not read yet.
    Picture(Place),
    /// The result of one picture and body, with the place of its message.
    Report(Place, Box<Row>, Vec<CandidateEdge>, Box<FrameData>),
}

/// Goes through a recording without reading its uncompressed pictures. The recording may be one of hzn, or one of any
/// writer with pictures that [`crate::ImageReader`] can read. Only the pictures on the topic of the first one are
/// found, as by that reader.
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
    /// The topic of the first picture.
    topic: Option<String>,
    reports: BTreeSet<u16>,
    complete: bool,
    inflation: Inflation,
    broken_chunks: u64,
    unknown_compression: Option<String>,
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
            topic: None,
            reports: BTreeSet::new(),
            complete: false,
            inflation: Inflation::default(),
            broken_chunks: 0,
            unknown_compression: None,
        };
        index.read_summary().map_err(read)?;
        while let Some((op, length)) = index.read_head().map_err(read)? {
            if matches!(op, Op::CHUNK | Op::MESSAGE | Op::DATA_END) {
                index.file.seek_relative(-9).map_err(read)?;
                break;
            }
            let begin = index.position;
            let Some(content) = index.read_content(length).map_err(read)? else {
                index.go_back(begin).map_err(read)?;
                break;
            };
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
    /// Returns the number of chunks so far that cannot be read. They are damaged, unless
    /// [`Self::unknown_compression`] has a name.
    pub fn broken_chunks(&self) -> u64 {
        self.broken_chunks
    }
    /// Returns the name of a compression that hzn does not know, if chunks so far have one.
    pub fn unknown_compression(&self) -> Option<&str> {
        self.unknown_compression.as_deref()
    }

    /// Returns whether a channel with reports was found so far. In a recording that was closed properly, this is known
    /// from the beginning.
    pub fn has_reports(&self) -> bool {
        !self.reports.is_empty()
    }
    /// Returns the number of channels with pictures that were found so far.
    pub fn channels(&self) -> usize {
        self.pictures.len()
    }

    /// Returns the clock of the pictures that were found so far, which [`crate::ImageReader::clock`] has, too.
    ///
    /// # Errors
    /// The file cannot be opened again.
    pub fn clock(&self) -> Result<Clock, Error> {
        let mut images = ImageReader::open(&self.path, self.topic.as_deref())?;
        images.next().transpose()?;
        Ok(images.clock().unwrap_or(Clock::Log))
    }

    /// Returns the entries of the next part of the file, which may be empty; `None` at the end. If another program
    /// still writes the file, a later call goes on with what was added, unless [`Index::is_complete`].
    ///
    /// # Errors
    /// The file cannot be read, or a report cannot be decoded.
    pub fn next_part(&mut self) -> Result<Option<Vec<IndexEntry>>, Error> {
        let mut found = Vec::new();
        let begin = self.position;
        let more = self.step(&mut found).map_err(|source| Error::Read { path: self.path.clone(), source })??;
        if !more && !self.complete {
            self.go_back(begin).map_err(|source| Error::Read { path: self.path.clone(), source })?;
        }
        Ok(more.then_some(found))
    }

    /// Goes back to the beginning of a record that is not whole yet.
    fn go_back(&mut self, to: u64) -> io::Result<()> {
        self.position = to;
        self.file.seek(SeekFrom::Start(to)).map(|_| ())
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
                self.position += 9 + length;
                let is_whole = self.file.get_ref().metadata()?.len() >= self.position;
                if is_whole { self.read_message(length, None, start, found) } else { Ok(Ok(false)) }
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
        let (chunk, plain) = match Chunk::parse(&Record { op: Op::CHUNK, content }, &mut self.inflation) {
            Ok(read) => read,
            Err(fault) => {
                self.broken_chunks += 1;
                if let ChunkFault::Compression(name) = fault {
                    self.unknown_compression.get_or_insert(name);
                }
                return Ok(Ok(true));
            }
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
            match op {
                Op::MESSAGE => match self.read_message(length, Some(start), offset, found)? {
                    Ok(true) => {}
                    Ok(false) => break,
                    Err(e) => return Ok(Err(e)),
                },
                Op::SCHEMA | Op::CHANNEL => {
                    let mut content = vec![0; length as usize];
                    if !fill(&mut self.file, &mut content)? {
                        break;
                    }
                    self.read_declaration(op, &content);
                }
                _ => self.file.seek_relative(length as i64)?,
            }
            offset += 9 + length;
        }
        self.file.seek(SeekFrom::Start(end))?;
        self.position = end;
        Ok(Ok(is_whole))
    }

    /// Reads the head of a message, and the data of a report. The record begins at `at`; its own head is read already.
    /// Returns `false` if the file ends before.
    fn read_message(
        &mut self,
        length: u64,
        chunk: Option<u64>,
        at: u64,
        found: &mut Vec<IndexEntry>,
    ) -> io::Result<Result<bool, Error>> {
        // Channel, sequence number and two times.
        let mut head = [0; 22];
        let Some(rest) = length.checked_sub(22) else {
            self.file.seek_relative(length as i64)?;
            return Ok(Ok(true));
        };
        if !fill(&mut self.file, &mut head)? {
            return Ok(Ok(false));
        }
        let Some(m) = Message::parse(&head) else { return Ok(Ok(false)) };
        let mut data = Vec::new();
        // Of a picture, only its stamp is of interest here.
        let wanted = if self.reports.contains(&m.channel) { rest } else { rest.min(self.header_bytes(m.channel)) };
        (&mut self.file).take(wanted).read_to_end(&mut data)?;
        if data.len() as u64 != wanted {
            return Ok(Ok(false));
        }
        self.file.seek_relative((rest - wanted) as i64)?;
        Ok(self.add_message(&Message { data: &data, ..m }, chunk, at, found).map(|()| true))
    }

    /// Returns the number of bytes at the beginning of a message that may have its stamp.
    fn header_bytes(&self, channel: u16) -> u64 {
        if self.pictures.get(&channel).is_some_and(|channel| channel.encoding == "cdr") { MAX_HEADER_BYTES } else { 0 }
    }

    fn add_message(
        &mut self,
        m: &Message<'_>,
        chunk: Option<u64>,
        at: u64,
        found: &mut Vec<IndexEntry>,
    ) -> Result<(), Error> {
        let (channel, log_time_ns, sequence) = (m.channel, m.log_time_ns, m.sequence);
        let is_stamped = self.header_bytes(channel) > 0;
        let stamp = if is_stamped { cdr::parse_stamp(m.data) } else { None };
        let place = Place { chunk, message: at, channel, log_time_ns, sequence, stamp };
        if self.reports.contains(&m.channel) {
            let broken = |e: serde_json::Error| Error::Decode {
                path: self.path.clone(),
                detail: format!("report of frame {}: {e}", m.sequence),
            };
            let (row, candidates, prior) = messages::parse_report(m.data).map_err(broken)?;
            found.push(IndexEntry::Report(place, Box::new(row), candidates, Box::new(prior)));
        } else if let Some(channel) = self.pictures.get(&m.channel)
            && *self.topic.get_or_insert_with(|| channel.topic.clone()) == channel.topic
        {
            found.push(IndexEntry::Picture(place));
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
            if Topic::of(&channel) == Some(Topic::Report) {
                self.reports.insert(id);
            } else if decoder(&channel.schema, &channel.encoding).is_some() {
                self.pictures.insert(id, channel);
            }
        }
        if op == Op::ATTACHMENT {
            let text = Fields(content).attached(SENSOR_TOML).map(|data| String::from_utf8_lossy(data).into_owned());
            self.sensor_toml = self.sensor_toml.take().or(text);
        }
    }

    /// Finds the channels of the reports in the summary at the end of the file. Other writers may declare them only
    /// when the first reports come, after many pictures.
    fn read_summary(&mut self) -> io::Result<()> {
        let beginning = self.position;
        if let Some(start) = summary::find_start(&mut self.file)? {
            self.file.seek(SeekFrom::Start(start))?;
            self.read_declarations_of_reports()?;
        }
        self.file.seek(SeekFrom::Start(beginning))?;
        self.position = beginning;
        Ok(())
    }

    /// Finds the channels of the reports from here to the footer.
    fn read_declarations_of_reports(&mut self) -> io::Result<()> {
        let mut schemas = Schemas::default();
        while let Some((op, length)) = self.read_head()? {
            match op {
                Op::SCHEMA | Op::CHANNEL => {
                    let Some(content) = self.read_content(length)? else { break };
                    let channel = schemas.declare(op, &content);
                    let reports = channel.filter(|(_, channel)| Topic::of(channel) == Some(Topic::Report));
                    self.reports.extend(reports.map(|(id, _)| id));
                }
                Op::FOOTER => break,
                _ => self.file.seek_relative(length as i64)?,
            }
        }
        Ok(())
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
