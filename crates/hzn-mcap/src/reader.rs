//! Reads frames from a recording, one batch at a time, also from broken files.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use crate::container::{Chunk, ChunkFault, Fields, Inflation, Message, Op, Record, Scanner, Schemas};
use crate::drawing;
use crate::error::Error;
use crate::frame::FrameRecord;
use crate::messages;
use crate::stamp::Stamp;
use crate::topics::Topic;
use crate::waiting::Waiting;
use crate::writer::SENSOR_TOML;

/// The parts of each frame that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Contents {
    /// Everything.
    #[default]
    All,
    /// Everything except the pictures. They are skipped without being read where the file allows it: in chunks of
    /// pictures without compression, as hzn writes them, and outside of chunks.
    WithoutImages,
}

/// Size of the buffer while the pictures are skipped. Between them only heads of records are read, so a larger buffer
/// would be filled with the beginnings of pictures.
const HEADS_BYTES: usize = 64;

/// Iterates over the frames of a recording in the order in which they were written. It needs the memory of one batch of
/// frames, or of one chunk if other programs wrote larger ones. A file that was cut off gives every finished frame;
/// [`Reader::is_complete`] then returns `false`.
#[derive(Debug)]
pub struct Reader {
    scanner: Scanner<BufReader<File>>,
    path: PathBuf,
    sensor_toml: Option<String>,
    /// Texts of the other attached `.toml` files, by name: those of a rig.
    files: BTreeMap<String, String>,
    metadata: BTreeMap<String, String>,
    /// The first record after the head of the file.
    peeked: Option<Record>,
    /// Topics by channel id, because the ids of other writers may differ, and the place in `heads`.
    topics: BTreeMap<u16, (Topic, usize)>,
    /// Names of the heads of a rig. The first one is empty: what belongs to no head.
    heads: Vec<String>,
    schemas: Schemas,
    contents: Contents,
    waiting: Waiting,
    ready: VecDeque<FrameRecord>,
    complete: bool,
    inflation: Inflation,
    broken_chunks: u64,
    /// Whether the last record was a chunk that cannot be read.
    is_broken: bool,
    bytes_after_end: u64,
    unknown_compression: Option<String>,
    /// Channels with the topic of the reports, but with another schema.
    foreign_reports: BTreeSet<u16>,
    unread_reports: u64,
    done: bool,
}

impl Reader {
    /// Opens a recording and reads its sensor.toml.
    ///
    /// # Errors
    /// The file cannot be read or is not an MCAP.
    pub fn open(path: impl AsRef<Path>, contents: Contents) -> Result<Self, Error> {
        let path = path.as_ref();
        let read = |source| Error::Read { path: path.to_path_buf(), source };
        let file = File::open(path).map_err(read)?;
        let capacity = if contents == Contents::All { 1 << 16 } else { HEADS_BYTES };
        let scanner = Scanner::try_new(BufReader::with_capacity(capacity, file)).map_err(read)?;
        let mut reader = Self {
            scanner: scanner.ok_or_else(|| Error::NotMcap { path: path.to_path_buf() })?,
            path: path.to_path_buf(),
            sensor_toml: None,
            files: BTreeMap::new(),
            metadata: BTreeMap::new(),
            peeked: None,
            topics: BTreeMap::new(),
            heads: vec![String::new()],
            schemas: Schemas::default(),
            contents,
            waiting: Waiting::default(),
            ready: VecDeque::new(),
            complete: false,
            inflation: Inflation::default(),
            broken_chunks: 0,
            is_broken: false,
            bytes_after_end: 0,
            unknown_compression: None,
            foreign_reports: BTreeSet::new(),
            unread_reports: 0,
            done: false,
        };
        while let Some(record) = reader.scanner.next().map_err(read)? {
            match record.op {
                Op::CHUNK | Op::DATA_END | Op::MESSAGE => {
                    reader.peeked = Some(record);
                    break;
                }
                _ => reader.read_declaration(&record),
            }
        }
        Ok(reader)
    }

    /// Returns the text of the attached sensor.toml.
    pub fn sensor_toml(&self) -> Option<&str> {
        self.sensor_toml.as_deref()
    }
    /// Returns the text of another attached file whose name ends in `.toml`, such as the `rig.toml` of a rig.
    pub fn file(&self, name: &str) -> Option<&str> {
        self.files.get(name).map(String::as_str)
    }
    /// Returns the metadata `hzn`: versions and settings of the run.
    pub fn metadata(&self) -> &BTreeMap<String, String> {
        &self.metadata
    }
    /// Returns whether the recording was closed properly; valid after the last frame.
    pub fn is_complete(&self) -> bool {
        self.complete
    }
    /// Returns the number of chunks so far that cannot be read; their frames are missing. They are damaged, unless
    /// [`Self::unknown_compression`] has a name.
    pub fn broken_chunks(&self) -> u64 {
        self.broken_chunks
    }
    /// Returns the number of bytes behind the end of the recording, which are not read; valid after the last frame.
    /// Programs that append files leave a second recording there.
    pub fn bytes_after_end(&self) -> u64 {
        self.bytes_after_end
    }
    /// Returns the name of a compression that hzn does not know, if chunks so far have one.
    pub fn unknown_compression(&self) -> Option<&str> {
        self.unknown_compression.as_deref()
    }
    /// Returns the number of messages so far that are on the topic of the reports, but have another schema.
    pub fn unread_reports(&self) -> u64 {
        self.unread_reports
    }

    /// Reads a record outside of chunks, or one that a chunk declares.
    fn read_declaration(&mut self, record: &Record) {
        if let Some((id, channel)) = self.schemas.declare(record.op, &record.content) {
            let found = Topic::with_head(&channel);
            let topic = found.map(|(topic, _)| topic);
            if let Some((topic, head)) = found {
                let head = self.place_of_head(head);
                self.topics.insert(id, (topic, head));
            }
            if self.contents == Contents::WithoutImages && matches!(topic, Some(Topic::Image | Topic::RawImage)) {
                self.scanner.skip_channel(id);
            }
            if topic.is_none() && channel.topic == Topic::Report.name() {
                self.foreign_reports.insert(id);
            }
        }
        let f = Fields(&record.content);
        match record.op {
            Op::ATTACHMENT => {
                if let Some((name, data)) = f.attachment() {
                    let text = || String::from_utf8_lossy(data).into_owned();
                    match name {
                        SENSOR_TOML => drop(self.sensor_toml.get_or_insert_with(text)),
                        // Other programs attach files of any size.
                        _ if name.ends_with(".toml") => drop(self.files.entry(name.to_owned()).or_insert_with(text)),
                        _ => {}
                    }
                }
            }
            Op::METADATA => {
                let mut f = f;
                if let (Some("hzn"), Some(map)) = (f.text(), f.map()) {
                    self.metadata = map;
                }
            }
            _ => {}
        }
    }

    /// Returns the place of a head in `heads`, to which it is added if it is new.
    fn place_of_head(&mut self, name: &str) -> usize {
        self.heads.iter().position(|known| known == name).unwrap_or_else(|| {
            self.heads.push(name.to_owned());
            self.heads.len() - 1
        })
    }

    /// Assembles frames from the messages of a chunk.
    fn read_chunk(&mut self, record: &Record) -> Result<(), Error> {
        let (chunk, plain) = match Chunk::parse(record, &mut self.inflation) {
            Ok(read) => read,
            Err(fault) => {
                self.broken_chunks += 1;
                self.is_broken = true;
                if let ChunkFault::Compression(name) = fault {
                    self.unknown_compression.get_or_insert(name);
                }
                return Ok(());
            }
        };
        for (op, _, content) in chunk.index.declared {
            self.read_declaration(&Record { op, content });
        }
        Chunk::messages(&plain).try_for_each(|message| self.read_message(&message))
    }

    /// Adds a part to its frame; a report finishes the frame.
    fn read_message(&mut self, m: &Message<'_>) -> Result<(), Error> {
        let Some(&(topic, head)) = self.topics.get(&m.channel) else {
            self.unread_reports += u64::from(self.foreign_reports.contains(&m.channel));
            return Ok(());
        };
        let broken = |what: &str, e: String| Error::Decode {
            path: self.path.clone(),
            detail: format!("{what} of frame {}: {e}", m.sequence),
        };
        match topic {
            Topic::Image | Topic::RawImage if self.contents == Contents::WithoutImages => {}
            Topic::Image | Topic::RawImage => {
                let schema = if topic == Topic::Image { "foxglove.CompressedImage" } else { "foxglove.RawImage" };
                let image = messages::parse_image(schema, m.data).image.map_err(|e| broken("picture", e))?;
                self.waiting.add_to(m, head).images.push_back(image);
            }
            Topic::Annotations => {
                let a = drawing::parse(m.data).map_err(|e| broken("annotations", e.to_string()))?;
                self.waiting.add_to(m, head).annotations.push_back(a);
            }
            Topic::Transform => {
                let t = messages::parse_transform(m.data).map_err(|e| broken("attitude", e.to_string()))?;
                self.waiting.add_to(m, head).attitudes.extend(t);
            }
            Topic::Log => {
                let line = messages::parse_log(m.data).map_err(|e| broken("message", e.to_string()))?;
                self.waiting.add_to(m, head).log.push(line);
            }
            Topic::Report => {
                let (row, candidates, prior) =
                    messages::parse_report(m.data).map_err(|e| broken("report", e.to_string()))?;
                let stamp = Some(Stamp::new(m.log_time_ns, "")).filter(|stamp| stamp.is_at(row.time_s));
                let mut frame = FrameRecord { stamp, candidates, prior, ..FrameRecord::new(row) };
                // All reports are on one topic, with the name of the head in them.
                let head = frame.row.head.as_ref().and_then(|head| self.heads.iter().position(|known| known == head));
                self.waiting.take(m, head.unwrap_or(0), |parts| {
                    frame.image = parts.images.pop_front();
                    frame.annotations = parts.annotations.pop_front().unwrap_or_default();
                    frame.attitude = parts.attitudes.pop_front();
                    frame.log = std::mem::take(&mut parts.log);
                });
                self.ready.push_back(frame);
            }
            Topic::Calibration | Topic::Axis | Topic::AxisVector | Topic::AxisCovariance => {}
        }
        Ok(())
    }

    fn step(&mut self) -> Result<bool, Error> {
        let read = |source| Error::Read { path: self.path.clone(), source };
        let lost_bytes = self.scanner.lost_bytes();
        let record = match self.peeked.take() {
            Some(record) => Some(record),
            None => self.scanner.next().map_err(read)?,
        };
        // A chunk that reaches into a gap was counted already.
        let is_gap = self.scanner.lost_bytes() > lost_bytes && !self.is_broken;
        self.broken_chunks += u64::from(is_gap);
        self.is_broken = false;
        let Some(record) = record else { return Ok(false) };
        match record.op {
            Op::CHUNK => self.read_chunk(&record)?,
            Op::MESSAGE => {
                if let Some(message) = Message::parse(&record.content) {
                    self.read_message(&message)?;
                }
            }
            Op::DATA_END => {
                self.complete = true;
                self.bytes_after_end = self.scanner.bytes_after_end().map_err(read)?;
                return Ok(false);
            }
            _ => self.read_declaration(&record),
        }
        Ok(true)
    }
}

impl Iterator for Reader {
    type Item = Result<FrameRecord, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some(frame) = self.ready.pop_front() {
                return Some(Ok(frame));
            }
            if self.done {
                return None;
            }
            match self.step() {
                Ok(true) => {}
                Ok(false) => self.done = true,
                Err(e) => {
                    self.done = true;
                    return Some(Err(e));
                }
            }
        }
    }
}
