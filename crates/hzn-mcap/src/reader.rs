//! Reads frames from a recording, one batch at a time, also from broken files.

use std::collections::{BTreeMap, VecDeque};
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use crate::container::{Chunk, Fields, Inflation, Message, Op, Record, Scanner, Schemas};
use crate::drawing;
use crate::error::Error;
use crate::frame::{Annotations, Attitude, EncodedImage, FrameRecord, LogLine};
use crate::messages;
use crate::topics::Topic;
use crate::writer::SENSOR_TOML;

/// The parts of each frame that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Contents {
    /// Everything.
    #[default]
    All,
    /// Everything except the pictures, which are skipped without being read.
    WithoutImages,
}

/// Iterates over the frames of a recording in the order in which they were written. It needs the memory of one batch of
/// frames. A file that was cut off gives every finished frame; [`Reader::is_complete`] then returns `false`.
#[derive(Debug)]
pub struct Reader {
    scanner: Scanner<BufReader<File>>,
    path: PathBuf,
    sensor_toml: Option<String>,
    metadata: BTreeMap<String, String>,
    /// The first record after the head of the file.
    peeked: Option<Record>,
    /// Topics by channel id, because the ids of other writers may differ.
    topics: BTreeMap<u16, Topic>,
    schemas: Schemas,
    images: Parts<EncodedImage>,
    ready: VecDeque<FrameRecord>,
    complete: bool,
    inflation: Inflation,
    broken_chunks: u64,
    done: bool,
}

/// Parts of frames by their sequence number, in the order of the file.
type Parts<T> = BTreeMap<u32, VecDeque<T>>;

/// Takes the first part of a frame.
fn take_part<T>(parts: &mut Parts<T>, sequence: u32) -> Option<T> {
    let queue = parts.get_mut(&sequence)?;
    let part = queue.pop_front();
    if queue.is_empty() {
        parts.remove(&sequence);
    }
    part
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
        let scanner = Scanner::try_new(BufReader::with_capacity(1 << 16, file)).map_err(read)?;
        let mut scanner = scanner.ok_or_else(|| Error::NotMcap { path: path.to_path_buf() })?;
        scanner.skip_plain_chunks(contents == Contents::WithoutImages);
        let mut reader = Self {
            scanner,
            path: path.to_path_buf(),
            sensor_toml: None,
            metadata: BTreeMap::new(),
            peeked: None,
            topics: BTreeMap::new(),
            schemas: Schemas::default(),
            images: BTreeMap::new(),
            ready: VecDeque::new(),
            complete: false,
            inflation: Inflation::default(),
            broken_chunks: 0,
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
    /// Returns the metadata `hzn`: versions and settings of the run.
    pub fn metadata(&self) -> &BTreeMap<String, String> {
        &self.metadata
    }
    /// Returns whether the recording was closed properly; valid after the last frame.
    pub fn is_complete(&self) -> bool {
        self.complete
    }
    /// Returns the number of chunks with damaged contents so far; their frames are missing.
    pub fn broken_chunks(&self) -> u64 {
        self.broken_chunks
    }

    /// Reads a record outside of chunks, or one that a chunk declares.
    fn read_declaration(&mut self, record: &Record) {
        if let Some((id, channel)) = self.schemas.declare(record.op, &record.content) {
            let is_same = |t: &Topic| t.name() == channel.topic && t.schema().0 == channel.schema;
            self.topics.extend(Topic::ALL.into_iter().find(is_same).map(|topic| (id, topic)));
        }
        let mut f = Fields(&record.content);
        match record.op {
            Op::ATTACHMENT => {
                let text = f.attached(SENSOR_TOML).map(|data| String::from_utf8_lossy(data).into_owned());
                self.sensor_toml = self.sensor_toml.take().or(text);
            }
            Op::METADATA => {
                if let (Some("hzn"), Some(map)) = (f.text(), f.map()) {
                    self.metadata = map;
                }
            }
            _ => {}
        }
    }

    /// Assembles frames from the messages of a chunk.
    fn read_chunk(&mut self, record: &Record) -> Result<(), Error> {
        let Ok((chunk, plain)) = Chunk::parse(record, &mut self.inflation) else {
            self.broken_chunks += 1;
            return Ok(());
        };
        for (op, _, content) in chunk.index.declared {
            self.read_declaration(&Record { op, content });
        }
        let mut annotations = Parts::<Annotations>::new();
        let mut attitudes = Parts::<Attitude>::new();
        let mut logs = Parts::<LogLine>::new();
        for m in Chunk::messages(&plain) {
            let Some(&topic) = self.topics.get(&m.channel) else { continue };
            let broken = |what: &str, e: String| Error::Decode {
                path: self.path.clone(),
                detail: format!("{what} of frame {}: {e}", m.sequence),
            };
            match topic {
                Topic::Image | Topic::RawImage => {
                    let schema = if topic == Topic::Image { "foxglove.CompressedImage" } else { "foxglove.RawImage" };
                    let image = messages::parse_image(schema, m.data).map_err(|e| broken("picture", e))?;
                    self.images.entry(m.sequence).or_default().push_back(image);
                }
                Topic::Annotations => {
                    let a = drawing::parse(m.data).map_err(|e| broken("annotations", e.to_string()))?;
                    annotations.entry(m.sequence).or_default().push_back(a);
                }
                Topic::Transform => {
                    let t = messages::parse_transform(m.data).map_err(|e| broken("attitude", e.to_string()))?;
                    attitudes.entry(m.sequence).or_default().extend(t);
                }
                Topic::Log => {
                    let line = messages::parse_log(m.data).map_err(|e| broken("message", e.to_string()))?;
                    logs.entry(m.sequence).or_default().push_back(line);
                }
                Topic::Report => {
                    let (row, candidates, prior) =
                        messages::parse_report(m.data).map_err(|e| broken("report", e.to_string()))?;
                    self.ready.push_back(FrameRecord {
                        row,
                        candidates,
                        image: take_part(&mut self.images, m.sequence),
                        annotations: take_part(&mut annotations, m.sequence).unwrap_or_default(),
                        attitude: take_part(&mut attitudes, m.sequence),
                        prior,
                        log: logs.remove(&m.sequence).unwrap_or_default().into(),
                    });
                }
                Topic::Calibration | Topic::Axis => {}
            }
        }
        if chunk.compression == "zstd" {
            // Pictures of a batch come before its reports, so the remaining pictures belong to no frame.
            self.images.clear();
        }
        Ok(())
    }

    fn step(&mut self) -> Result<bool, Error> {
        let record = match self.peeked.take() {
            Some(record) => Some(record),
            None => self.scanner.next().map_err(|source| Error::Read { path: self.path.clone(), source })?,
        };
        let Some(record) = record else { return Ok(false) };
        match record.op {
            Op::CHUNK => self.read_chunk(&record)?,
            Op::DATA_END => {
                self.complete = true;
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

/// Counts the reports in the uncompressed records of a chunk; `channel` is the channel of the reports.
pub(crate) fn count_reports(plain: &[u8], channel: u16) -> u64 {
    Chunk::messages(plain).filter(|m: &Message<'_>| m.channel == channel).count() as u64
}
