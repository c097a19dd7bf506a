//! MCAP recordings of other programs, with image topics.

use std::path::{Path, PathBuf};

use hzn_mcap::{Clock, EncodedImage, ImageFormat, ImageReader};

use super::header;
use super::item::{Item, TimeSource};
use super::payload::Payload;
use super::sequence::{MAX_SIZES_READ, Source};
use crate::error::{Error, unusable};

/// Step between the pictures of [`Source::samples`]. A recording does not say how many pictures it has, so the samples
/// come from its beginning.
pub(super) const SAMPLE_EVERY: usize = 16;

/// Pictures of one topic. They are named after the recording: `flight.mcap#000012`.
pub(super) struct Recording {
    reader: ImageReader,
    path: PathBuf,
    name: String,
    /// Whether the topic was told.
    is_told: bool,
    /// The first picture. It is read early, so that a recording without pictures is refused at once.
    first: Option<Item>,
    index: u64,
}

impl Recording {
    /// Opens a recording; `clock` is that of the recordings before it in its bag.
    pub(super) fn open(path: &Path, topic: Option<&str>, clock: Option<Clock>) -> Result<Self, Error> {
        let reader = ImageReader::open(path, topic).map_err(unusable)?.with_clock(clock);
        let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let mut recording =
            Self { reader, path: path.to_owned(), name, is_told: topic.is_some(), first: None, index: 0 };
        recording.first = match recording.read() {
            Some(Ok(item)) => Some(item),
            Some(Err(e)) => return Err(unusable(e)),
            None => {
                let others: Vec<&str> = recording.reader.other_topics().collect();
                let what = match (topic, others.is_empty()) {
                    (Some(topic), false) => {
                        format!("no pictures on topic {topic}; there are some on {}", others.join(", "))
                    }
                    (Some(topic), true) => format!("no pictures on topic {topic}, nor on any other"),
                    (None, _) => {
                        "no pictures in this recording (supported are foxglove.CompressedImage and RawImage in \
                         protobuf, sensor_msgs/msg/Image and CompressedImage in CDR)"
                            .to_owned()
                    }
                };
                let broken = recording.reader.broken().map(|why| format!("; it {why}")).unwrap_or_default();
                return Err(unusable(format!("{}: {what}{broken}", path.display())));
            }
        };
        Ok(recording)
    }

    /// Returns the topic that is read.
    pub(super) fn topic(&self) -> Option<&str> {
        self.reader.topic()
    }

    /// Returns the clock of the pictures.
    pub(super) fn clock(&self) -> Option<Clock> {
        self.reader.clock()
    }

    /// Returns a reader of the same pictures from their beginning.
    fn again(&self) -> Option<ImageReader> {
        Some(ImageReader::open(&self.path, self.topic()).ok()?.with_clock(self.clock()))
    }

    fn frame_name(&self, index: u64) -> String {
        format!("{}#{index:06}", self.name)
    }

    fn read(&mut self) -> Option<Result<Item, Error>> {
        let image = match self.reader.next()? {
            Ok(image) => image,
            Err(e) => return Some(Err(Error::failed(e))),
        };
        let name = self.frame_name(self.index);
        self.index += 1;
        let payload = match image.image {
            Ok(image) => Payload::from_recorded(image),
            Err(why) => Payload::Broken(why),
        };
        let time = TimeSource::Container(image.time_s);
        Some(Ok(Item { name, time, stamp: image.stamp, data: None, payload }))
    }
}

/// Returns width and height in pixels, if they are known without decoding.
pub(super) fn known_size(image: &EncodedImage) -> Option<(u32, u32)> {
    match image.format {
        // Of the other formats, the header of a WebP is known.
        ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::Other(_) => {
            header::read_size_from(std::io::Cursor::new(&image.bytes))
        }
        ImageFormat::Mono8 { width, height }
        | ImageFormat::Rgb8 { width, height }
        | ImageFormat::Rgb16 { width, height }
        | ImageFormat::Mono16 { width, height } => Some((width, height)),
    }
}

impl Source for Recording {
    fn next(&mut self) -> Option<Result<Item, Error>> {
        match self.first.take() {
            Some(item) => Some(Ok(item)),
            None => self.read(),
        }
    }
    fn total(&self) -> Option<u64> {
        None
    }
    fn sizes(&self) -> Box<dyn Iterator<Item = (String, (u32, u32))> + '_> {
        let Some(reader) = self.again() else { return Box::new(std::iter::empty()) };
        let images = reader.map_while(Result::ok).take(MAX_SIZES_READ);
        Box::new(images.enumerate().filter_map(|(i, m)| Some((self.frame_name(i as u64), known_size(&m.image.ok()?)?))))
    }
    fn folder(&self) -> PathBuf {
        self.path.parent().map(Path::to_owned).unwrap_or_default()
    }
    fn files(&self) -> Vec<PathBuf> {
        vec![self.path.clone()]
    }
    fn samples(&self) -> Box<dyn Iterator<Item = Payload> + '_> {
        let Some(reader) = self.again() else { return Box::new(std::iter::empty()) };
        let images = reader.map_while(Result::ok).step_by(SAMPLE_EVERY);
        Box::new(images.map(|m| m.image.map_or_else(Payload::Broken, Payload::from_recorded)))
    }
    fn describe_loss(&self) -> Option<String> {
        let why = self.reader.broken()?;
        Some(format!("{}: {why}; the pictures before that were processed", self.path.display()))
    }
    fn notes(&self) -> Vec<String> {
        let topics: Vec<&str> = self.reader.other_topics().collect();
        // Whoever named the topic knows that there are others.
        let topic = self.topic().filter(|_| !self.is_told && !topics.is_empty());
        let others = topic.map(|topic| {
            let others = topics.join(", ");
            format!("the pictures are those of {topic}; other topics with pictures: {others} (--topic chooses one)")
        });
        others.into_iter().chain(describe_clock(&self.reader)).collect()
    }
}

/// Says that the stamps of the pictures are 0, so that their times are those of the log.
pub fn describe_clock(reader: &ImageReader) -> Option<String> {
    let topic = reader.topic().filter(|_| reader.clock() == Some(Clock::LogInsteadOfZeros))?;
    Some(format!(
        "the stamps in the headers of {topic} are 0, so the times are those of the log: each is later than the \
         exposure by the time that the picture took to the recorder. Let the driver of the camera fill in the stamps, \
         or give a frames.csv with time_s"
    ))
}
