//! Where pictures come from: folders, globs, single files, headerless raw, video, MCAP.
//!
//! A [`Source`] hands out [`Item`]s in the sequence's order without decoding them; decoding is left to the threads.

mod bits;
mod exif;
mod files;
mod natural;
mod pages;
pub mod picture;
pub mod raw;
mod recording;
mod rerun;
mod turn;
mod video;

use std::path::{Path, PathBuf};

use hzn_calib::{FrameData, Frames};
use hzn_core::Config;
use hzn_core::config::Orient;
use hzn_core::image::Channel;

pub use bits::{FoundBits, find_bits, with_key};
pub use picture::Picture;
pub use raw::Raw;
pub use rerun::lost as lost_of_recording;

use crate::error::{Error, Remedy, unusable};

/// One frame before it is decoded.
#[derive(Debug)]
pub struct Item {
    /// Its name in results and in frames.csv.
    pub name: String,
    /// Where its time comes from, unless [`Self::time_source`] knows better.
    pub time: TimeSource,
    /// What the source itself knows about it, as a row of frames.csv: a recording of ours, what it was recorded with.
    pub data: Option<FrameData>,
    /// The picture.
    pub payload: Payload,
}

/// Where the time of a picture comes from. All pictures of a sequence go by one clock: times from two would be counted
/// from different instants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TimeSource {
    /// frames.csv, or what a recording of ours says.
    Table,
    /// The container (video, MCAP): seconds, where it has some for this picture.
    Container(Option<f64>),
    /// What the camera wrote into the picture.
    Exif,
    /// The picture's number, at so many frames a second.
    Count,
}

impl TimeSource {
    /// Seconds, where they are known. `exif` is what the camera wrote into the picture.
    pub fn time_s(
        self,
        data: Option<&FrameData>,
        exif: impl FnOnce() -> Option<f64>,
        index: u64,
        fps: f64,
    ) -> Option<f64> {
        match self {
            Self::Table => data.and_then(|d| d.time_s),
            Self::Container(time_s) => time_s,
            Self::Exif => exif(),
            Self::Count => Some(index as f64 / fps),
        }
    }
}

/// Pictures whose headers [`Source::sizes`] reads at most.
const SIZES: usize = 32;

/// A picture on its way to a thread.
#[derive(Debug)]
pub enum Payload {
    /// A picture file.
    File(PathBuf),
    /// A headerless file.
    RawFile(PathBuf, Raw),
    /// A file's contents, from a container.
    Encoded(Vec<u8>),
    /// Decoded already.
    Decoded(Picture),
    /// Lost on the way: the reason.
    Broken(String),
}

/// Frames in order.
pub trait Source: Send {
    /// The next frame; `None` at the end. An error ends the sequence.
    fn next(&mut self) -> Option<anyhow::Result<Item>>;
    /// Number of frames, when it is known before.
    fn total(&self) -> Option<u64>;
    /// Names and sizes (width, height in pixels) of some of the pictures, from their headers alone; those that cannot
    /// be read are left out.
    fn sizes(&self) -> Box<dyn Iterator<Item = (String, (u32, u32))> + '_>;
    /// The file of a frame that can be had by itself, with what lies beside it.
    fn path(&self, _frame: u64) -> Option<PathBuf> {
        None
    }
    /// Folder in which frames.csv and sensor.toml may lie.
    fn folder(&self) -> PathBuf;
    /// Text of the sensor.toml that the pictures were recorded with; a source that has one also knows what frames.csv
    /// said ([`Item::data`]).
    fn sensor_toml(&self) -> Option<&str> {
        None
    }
    /// Significant bits of a sample, when they are known before.
    fn bits(&self) -> Option<u8> {
        None
    }
    /// Pictures from the whole sequence, a few, for what only their samples tell ([`find_bits`]). By their places
    /// alone, so that the same sequence gives the same ones.
    fn samples(&self) -> Box<dyn Iterator<Item = Payload> + '_> {
        Box::new(std::iter::empty())
    }
    /// The first picture that is to be shown turned, and how, as the camera wrote into it.
    fn to_be_turned(&self) -> Option<(String, &'static str)> {
        None
    }
    /// Colours are asked for, which a source may have to be told before it reads.
    ///
    /// # Errors
    /// The source has none.
    fn want_channel(&mut self, _channel: Channel) -> Result<(), Error> {
        Ok(())
    }
    /// Things that the user should know, such as files left out.
    fn notes(&self) -> Vec<String> {
        Vec::new()
    }
    /// After the last frame: what could not be handed out.
    fn lost(&self) -> Option<String> {
        None
    }
}

impl Item {
    /// What is known about it: a frames.csv takes the place of what the source knows.
    pub fn known(&mut self, frames: Option<&Frames>) -> Option<FrameData> {
        match frames {
            Some(frames) => frames.get(&self.name).cloned(),
            None => self.data.take(),
        }
    }
    /// The clock it goes by: a frames.csv with times, or what the source knows, takes the place of every other.
    pub fn time_source(&self, frames: Option<&Frames>) -> TimeSource {
        let timed = frames.map_or(self.data.is_some(), Frames::has_times);
        if timed { TimeSource::Table } else { self.time }
    }
}

impl Payload {
    /// The picture, decoded, and the file's own bytes where they are PNG or JPEG and can be kept as they are. A sensor
    /// says which size it must have, how many bits, and how it is turned.
    ///
    /// # Errors
    /// Why it cannot be read, for the record of the frame.
    pub fn decode(self, sensor: Option<&Config>) -> Result<(Picture, Option<Vec<u8>>), String> {
        let Some(sensor) = sensor else { return self.decode_as_it_is(None) };
        let own = (u32::from(sensor.camera.width), u32::from(sensor.camera.height));
        // Each picture says itself how it is turned, so that its size is known only then.
        let stored = match sensor.input.orient {
            Orient::Exif => None,
            Orient::Rotate90 | Orient::Rotate270 => Some((own.1, own.0)),
            _ => Some(own),
        };
        let (picture, original) = self.decode_as_it_is(stored)?;
        let turned = picture.is_turned(&sensor.input);
        let picture = picture.told(&sensor.input)?;
        picture::check_size(picture.layout.width, picture.layout.height, Some(own))?;
        Ok((picture, original.filter(|_| !turned)))
    }

    /// The largest sample of a picture of 16-bit words; `None` of any other, and of one that cannot be read.
    fn largest_word(self) -> Option<u16> {
        match &self {
            Self::File(path) if !picture::has_words(std::fs::File::open(path).ok()?) => return None,
            Self::File(path) if picture::tells_its_scale(path) => return Some(u16::MAX),
            Self::Encoded(bytes) if !picture::has_words(std::io::Cursor::new(bytes)) => return None,
            _ => {}
        }
        self.decode_as_it_is(None).ok()?.0.largest_word()
    }

    fn decode_as_it_is(self, expected: Option<(u32, u32)>) -> Result<(Picture, Option<Vec<u8>>), String> {
        let encoded = |bytes: Vec<u8>| {
            let picture = picture::decode(&bytes, expected)?;
            let keep = matches!(picture::format_of(&bytes), Some(image::ImageFormat::Png | image::ImageFormat::Jpeg));
            Ok((picture, keep.then_some(bytes)))
        };
        let sized = |picture: Picture| {
            picture::check_size(picture.layout.width, picture.layout.height, expected)?;
            Ok((picture, None))
        };
        match self {
            Self::File(path) => encoded(picture::read_file(&path)?),
            Self::Encoded(bytes) if bytes.is_empty() => Err("message without picture data".into()),
            Self::Encoded(bytes) => encoded(bytes),
            Self::RawFile(path, raw) => sized(raw.decode(&picture::read_file(&path)?)?),
            Self::Decoded(picture) => sized(picture),
            Self::Broken(why) => Err(why),
        }
    }
}

/// Opens whatever the arguments name. `topic` chooses among the topics of an MCAP.
///
/// # Errors
/// Nothing there, nothing that is known, or a mixture that has no order.
pub fn open(inputs: &[PathBuf], raw: Option<Raw>, topic: Option<&str>) -> Result<Box<dyn Source>, Error> {
    if let [one] = inputs
        && raw.is_none()
        && one.is_file()
    {
        match ending(one).as_str() {
            "mcap" => return open_recording(one, topic),
            e if video::ENDINGS.contains(&e) => return Ok(Box::new(video::Video::open(one)?)),
            _ => {}
        }
    }
    if topic.is_some() {
        return Err(unusable("only an MCAP has topics").with(Remedy::NoTopic));
    }
    Ok(Box::new(files::Files::open(inputs, raw)?))
}

/// One of our own is processed again as it was recorded; of any other, and of a further topic, there are the pictures.
fn open_recording(path: &Path, topic: Option<&str>) -> Result<Box<dyn Source>, Error> {
    if topic.is_none_or(|topic| topic == hzn_mcap::IMAGE_TOPIC)
        && let Some(ours) = rerun::Rerun::open(path)?
    {
        return Ok(Box::new(ours));
    }
    Ok(Box::new(recording::Recording::open(path, topic)?))
}

/// When the camera exposed a picture file, by its EXIF, seconds since 1970.
pub fn exif_time_s(path: &Path) -> Option<f64> {
    picture::exif_of(path).flatten()
}

/// What the camera wrote of its lens into a picture file's EXIF.
pub fn exif_lens(path: &Path) -> Option<hzn_calib::start::Exif> {
    picture::lens_of(path)
}

/// The picture of a recorded message.
pub fn recorded(image: hzn_mcap::EncodedImage) -> Payload {
    recording::payload(image)
}

/// A file that a command reads: it must be there. Gives the ending of its kind, and whether it is what an unfinished
/// run left: such a file has the ending of its kind before `.part`.
pub fn existing(file: &Path) -> Result<(String, bool), Error> {
    if !file.is_file() {
        let what = if file.is_dir() { "is a folder; a file is expected here" } else { "no such file" };
        return Err(unusable(format!("{}: {what}", file.display())));
    }
    let unfinished = ending(file) == "part";
    Ok((if unfinished { ending(&file.with_extension("")) } else { ending(file) }, unfinished))
}

/// The file's ending in small letters.
pub fn ending(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}
