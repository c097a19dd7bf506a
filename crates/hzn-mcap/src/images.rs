//! Reads pictures from MCAP files of any writer, as an input.

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
    /// Time in seconds: of the message's header for ROS 2, else the log time.
    pub time_s: f64,
    /// The picture, or the reason why it cannot be read.
    pub image: Result<EncodedImage, String>,
}

/// Iterates over the pictures of one topic of an MCAP in file order. It needs the memory of one chunk.
///
/// It reads `foxglove.CompressedImage` and `foxglove.RawImage` in protobuf, and ROS 2's `sensor_msgs/msg/Image` and
/// `sensor_msgs/msg/CompressedImage` in CDR. Chunks may be uncompressed or compressed with zstd. A file that was cut
/// off gives all complete pictures.
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
    /// Opens an MCAP. Without a `topic`, the topic of the first picture is used.
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

    /// Returns why the recording ended early (cut off or damaged); `None` for a complete one. Valid after the last
    /// picture.
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
    last().is_ok_and(|last| last == *mcap::MAGIC)
}

/// Returns the decoder for a channel's pictures; `None` for other messages.
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
/// A decoded picture with its time in seconds, if the message has one; or the reason why it cannot be decoded.
pub(crate) type Decoded = Result<(EncodedImage, Option<f64>), String>;

impl Iterator for ImageReader {
    type Item = Result<InputImage, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        while !self.done {
            let Some(message) = self.messages.next() else {
                self.done = true;
                // The file may be cut off between two records.
                self.broken = (!ends_as_mcap(&self.path)).then(|| CUT_OFF.to_owned());
                return None;
            };
            let message = match message {
                Ok(message) => message,
                Err(e) => {
                    self.done = true;
                    // All complete pictures were returned before.
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
