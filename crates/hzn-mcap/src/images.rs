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
use crate::header::Decoded;
use crate::messages;
use crate::stamp::Stamp;
use crate::summary;

/// One picture of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct InputImage {
    /// Time in seconds, of the clock of the recording's pictures ([`ImageReader::clock`]); `None` if the stamps of the
    /// others count and this one is 0. A picture whose header cannot be read has the log time, and the reason says so.
    pub time_s: Option<f64>,
    /// The same time in whole nanoseconds; `None` for times before 0.
    pub stamp: Option<Stamp>,
    /// The picture, or the reason why it cannot be read.
    pub image: Result<EncodedImage, String>,
}

/// The origin of the times of a recording's pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Clock {
    /// The stamps in the headers of the messages, for messages of ROS 2.
    Stamps,
    /// The log times: the messages have no stamps that count.
    Log,
    /// The log times, because the stamps are 0: the driver of the camera does not fill them in.
    LogInsteadOfZeros,
}

impl InputImage {
    /// Creates a picture from its message.
    pub(crate) fn new(decoded: Decoded, log_time_ns: u64, clock: Clock) -> Self {
        let Decoded { image, header } = decoded;
        let is_stamped = clock == Clock::Stamps;
        let Some(header) = header else {
            let also = "the header cannot be read either, so the time is that of the log";
            let image = image.map_err(|why| if is_stamped { format!("{why}; {also}") } else { why });
            let stamp = Stamp::new(log_time_ns, "");
            return Self { time_s: Some(stamp.time_s()), stamp: Some(stamp), image };
        };
        let ns = match header.stamp() {
            // A time before 0 has no stamp.
            Some((s, ns)) if is_stamped => u64::try_from(s).ok().map(|s| s * 1_000_000_000 + u64::from(ns)),
            None if is_stamped => None,
            _ => Some(log_time_ns),
        };
        let stamp = ns.map(|ns| Stamp::new(ns, &header.frame_id));
        let has_time = header.time.is_some() || !is_stamped;
        Self { time_s: has_time.then(|| time_s(header.time, log_time_ns, clock)).flatten(), stamp, image }
    }
}

/// Returns the time of a picture in seconds. `stamp` is that of its header, also one of 0; `None` without a header that
/// has one.
pub(crate) fn time_s(stamp: Option<(i32, u32)>, log_time_ns: u64, clock: Clock) -> Option<f64> {
    match stamp {
        Some((0, 0)) if clock == Clock::Stamps => None,
        Some((s, ns)) if clock == Clock::Stamps => Some(f64::from(s) + f64::from(ns) * 1e-9),
        _ => Some(Stamp::new(log_time_ns, "").time_s()),
    }
}

/// Number of pictures whose stamps are all 0 after which no stamp is expected. A driver that waits for the clock of a
/// simulation sends a few of them.
const ZEROS: usize = 16;

/// Iterates over the pictures of one topic of an MCAP in file order. It needs the memory of one chunk.
///
/// It reads `foxglove.CompressedImage` and `foxglove.RawImage` in protobuf, and ROS 2's `sensor_msgs/msg/Image` and
/// `sensor_msgs/msg/CompressedImage` in CDR. Chunks may be uncompressed or compressed with zstd or LZ4. A file that
/// was cut off gives all complete pictures.
///
/// All pictures have times of one clock: the stamps of ROS 2, unless those of the first 16 pictures are all 0.
pub struct ImageReader {
    scanner: Scanner<BufReader<File>>,
    path: PathBuf,
    topic: Option<String>,
    /// The topics with pictures that are known, with the one that is read.
    topics: BTreeSet<String>,
    /// The first calibration of each topic, or why it cannot be read.
    cameras: BTreeMap<String, Result<CameraInfo, String>>,
    schemas: Schemas,
    channels: BTreeMap<u16, Channel>,
    inflation: Inflation,
    /// Pictures of the chunk that was read last, with their log times in nanoseconds.
    ready: VecDeque<(Decoded, u64)>,
    /// `None` before the first picture.
    clock: Option<Clock>,
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
        let mut file = File::open(path).map_err(read)?;
        // The other topics are known before their first pictures, if the file was closed.
        let channels = summary::read_channels(&mut BufReader::new(&mut file)).map_err(read)?;
        let pictures = channels.into_iter().filter(|channel| decoder(&channel.schema, &channel.encoding).is_some());
        let topics = pictures.map(|channel| channel.topic).collect();
        file.rewind().map_err(read)?;
        let scanner = Scanner::try_new(BufReader::with_capacity(1 << 16, file)).map_err(read)?;
        Ok(Self {
            scanner: scanner.ok_or_else(|| Error::NotMcap { path: path.to_path_buf() })?,
            path: path.to_path_buf(),
            topic: topic.map(str::to_owned),
            topics,
            cameras: BTreeMap::new(),
            schemas: Schemas::default(),
            channels: BTreeMap::new(),
            inflation: Inflation::default(),
            ready: VecDeque::new(),
            clock: None,
            done: false,
            broken: None,
        })
    }

    /// Returns the reader with this clock. The files of one bag have one.
    #[must_use]
    pub fn with_clock(self, clock: Option<Clock>) -> Self {
        Self { clock, ..self }
    }

    /// Returns the clock of the pictures; `None` before the first one.
    pub fn clock(&self) -> Option<Clock> {
        self.clock
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

    /// Returns the other topics with pictures: those that the summary of the recording names, and those that were
    /// skipped so far.
    pub fn other_topics(&self) -> impl Iterator<Item = &str> {
        self.topics.iter().map(String::as_str).filter(|topic| Some(*topic) != self.topic())
    }

    /// Returns the calibration of the pictures' camera among those that were read so far, with its topic; or why it
    /// cannot be read.
    pub fn camera(&self) -> Option<(&str, Result<&CameraInfo, &str>)> {
        let topic = camera_info::topic_of(self.topic()?, self.cameras.keys().map(String::as_str), &self.topics)?;
        let (topic, camera) = self.cameras.get_key_value(topic)?;
        Some((topic.as_str(), camera.as_ref().map_err(String::as_str)))
    }

    /// Returns whether the pictures are rectified, as the name of their topic says.
    pub fn is_rectified(&self) -> bool {
        self.topic().is_some_and(camera_info::is_rectified)
    }

    /// Finds the clock: in the first picture, or with a reader of its own in the first ones.
    fn find_clock(&self, first: &Decoded) -> Clock {
        if let Some(clock) = clock_of(first).filter(|clock| *clock != Clock::LogInsteadOfZeros) {
            return clock;
        }
        let Ok(mut again) = Self::open(&self.path, self.topic()) else { return Clock::Stamps };
        let mut clock = Clock::Log;
        for (decoded, _) in std::iter::from_fn(|| again.next_decoded().and_then(Result::ok)).take(ZEROS) {
            match clock_of(&decoded) {
                Some(Clock::LogInsteadOfZeros) => clock = Clock::LogInsteadOfZeros,
                Some(found) => return found,
                None => {}
            }
        }
        clock
    }

    /// Returns the next picture, with its log time in nanoseconds.
    fn next_decoded(&mut self) -> Option<Result<(Decoded, u64), Error>> {
        loop {
            if let Some(decoded) = self.ready.pop_front() {
                return Some(Ok(decoded));
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
            if !matches!(self.cameras.get(&channel.topic), Some(Ok(_))) {
                self.cameras.insert(channel.topic.clone(), cdr::parse_camera_info(message.data));
            }
            return;
        }
        let Some(decode) = decoder(&channel.schema, &channel.encoding) else { return };
        if *self.topic.get_or_insert_with(|| channel.topic.clone()) != channel.topic {
            self.topics.insert(channel.topic.clone());
            return;
        }
        self.ready.push_back((decode(&channel.schema, message.data), message.log_time_ns));
    }
}

/// Returns the clock that one picture tells; `None` without a readable header.
fn clock_of(decoded: &Decoded) -> Option<Clock> {
    let header = decoded.header.as_ref()?;
    Some(match (header.time, header.stamp()) {
        // Only the messages of ROS have a time.
        (None, _) => Clock::Log,
        (Some(_), None) => Clock::LogInsteadOfZeros,
        (Some(_), Some(_)) => Clock::Stamps,
    })
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
        let decoded = self.next_decoded()?;
        Some(decoded.map(|(decoded, log_time_ns)| {
            let clock = self.clock.unwrap_or_else(|| self.find_clock(&decoded));
            self.clock = Some(clock);
            InputImage::new(decoded, log_time_ns, clock)
        }))
    }
}
