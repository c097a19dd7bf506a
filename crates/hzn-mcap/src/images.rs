//! Reads pictures from MCAP files of any writer, as an input.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use crate::camera_info::{self, CameraInfo};
use crate::cdr;
use crate::container::{Channel, Chunk, ChunkFault, Inflation, MAGIC, Message, Op, Record, Scanner, Schemas};
use crate::error::Error;
use crate::frame::EncodedImage;
use crate::header::{Decoded, Header};
use crate::messages;
use crate::stamp::Stamp;

/// One picture of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct InputImage {
    /// Time in seconds: of the message's header for ROS 2, else the log time.
    pub time_s: f64,
    /// The same time in whole nanoseconds; `None` for times before 0.
    pub stamp: Option<Stamp>,
    /// The picture, or the reason why it cannot be read.
    pub image: Result<EncodedImage, String>,
}

impl InputImage {
    /// Creates a picture from its message. The log time stands for a time that the message does not have.
    pub(crate) fn new(decoded: Decoded, log_time_ns: u64) -> Self {
        let (image, header) = match decoded {
            Ok((image, header)) => (Ok(image), header),
            Err(why) => (Err(why), Header::default()),
        };
        let ns = match header.time {
            // A time before 0 has no stamp.
            Some((s, ns)) => u64::try_from(s).ok().map(|s| s * 1_000_000_000 + u64::from(ns)),
            None => Some(log_time_ns),
        };
        let stamp = ns.map(|ns| Stamp::new(ns, &header.frame_id));
        let before_0 = || header.time.map_or(0.0, |(s, ns)| f64::from(s) + f64::from(ns) * 1e-9);
        Self { time_s: stamp.as_ref().map_or_else(before_0, Stamp::time_s), stamp, image }
    }
}

/// Iterates over the pictures of one topic of an MCAP in file order. It needs the memory of one chunk.
///
/// It reads `foxglove.CompressedImage` and `foxglove.RawImage` in protobuf, and ROS 2's `sensor_msgs/msg/Image` and
/// `sensor_msgs/msg/CompressedImage` in CDR. Chunks may be uncompressed or compressed with zstd or LZ4. A file that
/// was cut off gives all complete pictures.
pub struct ImageReader {
    scanner: Scanner<BufReader<File>>,
    path: PathBuf,
    topic: Option<String>,
    others: BTreeSet<String>,
    /// The first calibration of each topic.
    cameras: BTreeMap<String, CameraInfo>,
    schemas: Schemas,
    channels: BTreeMap<u16, Channel>,
    inflation: Inflation,
    /// Pictures of the chunk that was read last.
    ready: VecDeque<InputImage>,
    done: bool,
    broken: Option<String>,
}

impl std::fmt::Debug for ImageReader {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ImageReader").field("path", &self.path).field("topic", &self.topic).finish_non_exhaustive()
    }
}

impl ImageReader {
    /// Opens an MCAP. Without a `topic`, the topic of the first picture is used.
    ///
    /// # Errors
    /// The file cannot be read or is not an MCAP.
    pub fn open(path: impl AsRef<Path>, topic: Option<&str>) -> Result<Self, Error> {
        let path = path.as_ref();
        let read = |source| Error::Read { path: path.to_path_buf(), source };
        let file = File::open(path).map_err(read)?;
        let scanner = Scanner::try_new(BufReader::with_capacity(1 << 16, file)).map_err(read)?;
        Ok(Self {
            scanner: scanner.ok_or_else(|| Error::NotMcap { path: path.to_path_buf() })?,
            path: path.to_path_buf(),
            topic: topic.map(str::to_owned),
            others: BTreeSet::new(),
            cameras: BTreeMap::new(),
            schemas: Schemas::default(),
            channels: BTreeMap::new(),
            inflation: Inflation::default(),
            ready: VecDeque::new(),
            done: false,
            broken: None,
        })
    }

    /// Returns why the recording ended early (cut off, damaged, or compressed with an unknown method); `None` for a
    /// complete one. Valid after the last picture.
    pub fn broken(&self) -> Option<&str> {
        self.broken.as_deref()
    }

    /// Returns the topic that is read; `None` if it is not known yet.
    pub fn topic(&self) -> Option<&str> {
        self.topic.as_deref()
    }

    /// Returns the topics with pictures that were skipped so far.
    pub fn other_topics(&self) -> impl Iterator<Item = &str> {
        self.others.iter().map(String::as_str)
    }

    /// Returns the calibration of the pictures' camera among those that were read so far, with its topic.
    pub fn camera(&self) -> Option<(&str, &CameraInfo)> {
        let topic = camera_info::topic_of(self.topic()?, self.cameras.keys().map(String::as_str))?;
        self.cameras.get_key_value(topic).map(|(topic, camera)| (topic.as_str(), camera))
    }

    /// Reads the next record. Returns `false` at the end, and sets [`Self::broken`] if the end is not that of a
    /// recording.
    fn step(&mut self) -> std::io::Result<bool> {
        let Some(record) = self.scanner.next()? else {
            let damaged = ends_as_mcap(&self.path);
            self.broken = Some(if damaged { "is damaged (a record is not valid)" } else { CUT_OFF }.to_owned());
            return Ok(false);
        };
        match record.op {
            Op::DATA_END => return Ok(false),
            Op::CHUNK => match Chunk::parse(&record, &mut self.inflation) {
                Ok((chunk, plain)) => {
                    chunk.index.declared.iter().for_each(|(op, _, content)| self.declare(*op, content));
                    Chunk::messages(&plain).for_each(|message| self.add(&message));
                }
                Err(fault) => {
                    self.broken = Some(match fault {
                        ChunkFault::Compression(_) => format!("cannot be read: {fault}"),
                        ChunkFault::Damaged(_) if !ends_as_mcap(&self.path) => CUT_OFF.to_owned(),
                        ChunkFault::Damaged(why) => format!("is damaged ({why})"),
                    });
                    return Ok(false);
                }
            },
            Op::MESSAGE => Message::parse(&record.content).iter().for_each(|message| self.add(message)),
            _ => {
                let Record { op, content } = record;
                self.declare(op, &content);
            }
        }
        Ok(true)
    }

    /// Reads a schema or channel.
    fn declare(&mut self, op: u8, content: &[u8]) {
        if let Some((id, channel)) = self.schemas.declare(op, content) {
            self.channels.insert(id, channel);
        }
    }

    /// Decodes the picture of a message, if the message has one and its topic is wanted.
    fn add(&mut self, message: &Message<'_>) {
        let Some(channel) = self.channels.get(&message.channel) else { return };
        if channel.schema == camera_info::SCHEMA && channel.encoding == "cdr" {
            if !self.cameras.contains_key(&channel.topic)
                && let Some(camera) = cdr::parse_camera_info(message.data)
            {
                self.cameras.insert(channel.topic.clone(), camera);
            }
            return;
        }
        let Some(decode) = decoder(&channel.schema, &channel.encoding) else { return };
        if *self.topic.get_or_insert_with(|| channel.topic.clone()) != channel.topic {
            self.others.insert(channel.topic.clone());
            return;
        }
        self.ready.push_back(InputImage::new(decode(&channel.schema, message.data), message.log_time_ns));
    }
}

/// Reason for a recording whose end is missing.
const CUT_OFF: &str = "was cut off";

/// Returns whether the file ends like a closed recording.
fn ends_as_mcap(path: &Path) -> bool {
    let last = || -> std::io::Result<[u8; 8]> {
        let mut file = File::open(path)?;
        let mut last = [0; 8];
        file.seek(SeekFrom::End(-8))?;
        file.read_exact(&mut last)?;
        Ok(last)
    };
    last().is_ok_and(|last| last == MAGIC)
}

/// Returns the decoder for a channel's pictures; `None` for other messages.
pub(crate) fn decoder(schema: &str, encoding: &str) -> Option<fn(&str, &[u8]) -> Decoded> {
    match (schema, encoding) {
        ("foxglove.CompressedImage" | "foxglove.RawImage", "protobuf") => Some(messages::parse_image),
        ("sensor_msgs/msg/Image" | "sensor_msgs/msg/CompressedImage", "cdr") => Some(cdr::parse_image),
        _ => None,
    }
}

impl Iterator for ImageReader {
    type Item = Result<InputImage, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some(image) = self.ready.pop_front() {
                return Some(Ok(image));
            }
            if self.done {
                return None;
            }
            match self.step() {
                Ok(more) => self.done = !more,
                Err(source) => {
                    self.done = true;
                    return Some(Err(Error::Read { path: self.path.clone(), source }));
                }
            }
        }
    }
}
