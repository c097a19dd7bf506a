//! Pictures out of anybody's MCAP, as an input.

use std::collections::BTreeSet;
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use mcap::McapError;
use mcap::sans_io::linear_reader::LinearReaderOptions;

use crate::cdr;
use crate::container::MAX_RECORD_BYTES;
use crate::error::Error;
use crate::frame::EncodedImage;
use crate::messages;

/// One picture of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct InputImage {
    /// Time in seconds: that of the message's header for ROS 2, else the log time.
    pub time_s: f64,
    /// The picture, or why it cannot be read.
    pub image: Result<EncodedImage, String>,
}

/// Gives the pictures of one topic of an MCAP in file order, with the memory of a chunk.
///
/// Understood are `foxglove.CompressedImage` and `foxglove.RawImage` in protobuf, and ROS 2's `sensor_msgs/msg/Image`
/// and `sensor_msgs/msg/CompressedImage` in CDR; chunks uncompressed or in zstd. A file that was cut off gives what is
/// whole.
pub struct ImageReader {
    messages: mcap::io::MessageReader<BufReader<File>>,
    path: PathBuf,
    topic: Option<String>,
    others: BTreeSet<String>,
    done: bool,
    broken: Option<String>,
}

impl std::fmt::Debug for ImageReader {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ImageReader").field("path", &self.path).field("topic", &self.topic).finish_non_exhaustive()
    }
}

impl ImageReader {
    /// Opens an MCAP. Without a `topic`, the topic of the first picture is taken.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn open(path: impl AsRef<Path>, topic: Option<&str>) -> Result<Self, Error> {
        let path = path.as_ref();
        let file = File::open(path).map_err(|source| Error::Read { path: path.to_path_buf(), source })?;
        let options = LinearReaderOptions::default()
            .with_skip_end_magic(true)
            .with_prevalidate_chunk_crcs(true)
            .with_record_length_limit(MAX_RECORD_BYTES as usize);
        Ok(Self {
            messages: mcap::io::MessageReader::new_with_options(BufReader::with_capacity(1 << 16, file), options),
            path: path.to_path_buf(),
            topic: topic.map(str::to_owned),
            others: BTreeSet::new(),
            done: false,
            broken: None,
        })
    }

    /// After the last picture: why the recording ended before its end, cut off or damaged; `None` of a whole one.
    pub fn broken(&self) -> Option<&str> {
        self.broken.as_deref()
    }

    /// The topic that is read, once it is known.
    pub fn topic(&self) -> Option<&str> {
        self.topic.as_deref()
    }

    /// Topics with pictures that were passed over so far.
    pub fn other_topics(&self) -> impl Iterator<Item = &str> {
        self.others.iter().map(String::as_str)
    }
}

/// What befell a recording of which the end is missing.
const CUT_OFF: &str = "was cut off";

/// Whether the file ends as a recording that was closed.
fn ends_as_mcap(path: &Path) -> bool {
    let last = || -> std::io::Result<[u8; 8]> {
        let mut file = File::open(path)?;
        let mut last = [0; 8];
        file.seek(SeekFrom::End(-8))?;
        file.read_exact(&mut last)?;
        Ok(last)
    };
    last().is_ok_and(|last| last == *mcap::MAGIC)
}

/// Which decoder a channel's pictures need; `None` for other messages.
pub(crate) fn decoder(schema: &str, encoding: &str) -> Option<fn(&str, &[u8]) -> Decoded> {
    match (schema, encoding) {
        ("foxglove.CompressedImage" | "foxglove.RawImage", "protobuf") => {
            Some(|schema, data| messages::parse_image(schema, data).map(|image| (image, None)))
        }
        ("sensor_msgs/msg/Image" | "sensor_msgs/msg/CompressedImage", "cdr") => {
            Some(|schema, data| cdr::parse_image(schema, data).map(|(image, time_s)| (image, Some(time_s))))
        }
        _ => None,
    }
}
pub(crate) type Decoded = Result<(EncodedImage, Option<f64>), String>;

impl Iterator for ImageReader {
    type Item = Result<InputImage, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        while !self.done {
            let Some(message) = self.messages.next() else {
                self.done = true;
                // Cut off between two records.
                self.broken = (!ends_as_mcap(&self.path)).then(|| CUT_OFF.to_owned());
                return None;
            };
            let message = match message {
                Ok(message) => message,
                Err(e) => {
                    self.done = true;
                    // What was whole has been given.
                    self.broken = match e {
                        McapError::BadMagic => return Some(Err(Error::NotMcap { path: self.path.clone() })),
                        McapError::UnexpectedEof | McapError::UnexpectedEoc => Some(CUT_OFF.to_owned()),
                        _ if !ends_as_mcap(&self.path) => Some(CUT_OFF.to_owned()),
                        e => Some(format!("is damaged ({e})")),
                    };
                    return None;
                }
            };
            let channel = &message.channel;
            let schema = channel.schema.as_ref().map_or("", |s| s.name.as_str());
            let Some(decode) = decoder(schema, &channel.message_encoding) else { continue };
            if *self.topic.get_or_insert_with(|| channel.topic.clone()) != channel.topic {
                self.others.insert(channel.topic.clone());
                continue;
            }
            let log_time_s = message.log_time as f64 * 1e-9;
            return Some(Ok(match decode(schema, &message.data) {
                Ok((image, time_s)) => InputImage { time_s: time_s.unwrap_or(log_time_s), image: Ok(image) },
                Err(reason) => InputImage { time_s: log_time_s, image: Err(reason) },
            }));
        }
        None
    }
}
