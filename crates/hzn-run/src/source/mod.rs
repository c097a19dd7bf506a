//! The sources of pictures: folders, globs, single files, headerless files, video, MCAP.
//!
//! A [`Source`] hands out [`Item`]s in the sequence's order without decoding them. The threads decode them.

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

/// One picture before it is decoded.
#[derive(Debug)]
pub struct Item {
    /// The name of the picture in results and in frames.csv.
    pub name: String,
    /// The origin of its time, unless [`Self::time_source`] returns another one.
    pub time: TimeSource,
    /// The prior from the source itself, as a row of frames.csv. A recording of ours has one: the prior of its first
    /// run.
    pub data: Option<FrameData>,
    /// The picture.
    pub payload: Payload,
}

/// The origin of a picture's time. All pictures of a sequence use one clock, because times of two clocks can have
/// different zero points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TimeSource {
    /// frames.csv, or a recording of ours.
    Table,
    /// The container (video, MCAP): time in seconds, if it has one for this picture.
    Container(Option<f64>),
    /// The EXIF time that the camera wrote into the picture.
    Exif,
    /// The picture's number, divided by the number of frames a second.
    Count,
}

impl TimeSource {
    /// Returns the time in seconds, if it is known. `exif` returns the time that the camera wrote into the picture.
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

/// Largest number of pictures whose headers [`Source::sizes`] reads.
const SIZES: usize = 32;

/// A picture on its way from the source to a thread.
#[derive(Debug)]
pub enum Payload {
    /// A picture file.
    File(PathBuf),
    /// A headerless file.
    RawFile(PathBuf, Raw),
    /// The contents of a picture file, from a container.
    Encoded(Vec<u8>),
    /// A picture that is decoded already.
    Decoded(Picture),
    /// A picture that was lost, with the reason.
    Broken(String),
}

/// A sequence of pictures in order.
pub trait Source: Send {
    /// Returns the next picture; `None` at the end. An error ends the sequence.
    fn next(&mut self) -> Option<anyhow::Result<Item>>;
    /// Returns the number of pictures, if it is known before.
    fn total(&self) -> Option<u64>;
    /// Returns names and sizes (width, height in pixels) of some of the pictures, from their headers alone. Pictures
    /// with unreadable headers are left out.
    fn sizes(&self) -> Box<dyn Iterator<Item = (String, (u32, u32))> + '_>;
    /// Returns the file of a picture, if this file can be processed alone with the sensor.toml and frames.csv next to
    /// it.
    fn path(&self, _frame: u64) -> Option<PathBuf> {
        None
    }
    /// Returns the folder in which frames.csv and sensor.toml may lie.
    fn folder(&self) -> PathBuf;
    /// Returns the text of the sensor.toml that the pictures were recorded with. A source that has one also knows the
    /// content of frames.csv ([`Item::data`]).
    fn sensor_toml(&self) -> Option<&str> {
        None
    }
    /// Returns the significant bits of a sample, if they are known before.
    fn bits(&self) -> Option<u8> {
        None
    }
    /// Returns a few pictures from the whole sequence, for properties that only the samples show ([`find_bits`]). The
    /// choice depends only on their places, so the same sequence gives the same pictures.
    fn samples(&self) -> Box<dyn Iterator<Item = Payload> + '_> {
        Box::new(std::iter::empty())
    }
    /// Returns the name of the first picture that is to be shown turned, and the turn in words, as its camera recorded
    /// it.
    fn to_be_turned(&self) -> Option<(String, &'static str)> {
        None
    }
    /// Announces that a colour channel is wanted. Some sources must know this before they read.
    ///
    /// # Errors
    /// The source has no colours.
    fn want_channel(&mut self, _channel: Channel) -> Result<(), Error> {
        Ok(())
    }
    /// Returns notes for the user, for example about files that were left out.
    fn notes(&self) -> Vec<String> {
        Vec::new()
    }
    /// Returns what could not be handed out, after the last picture.
    fn lost(&self) -> Option<String> {
        None
    }
}

impl Item {
    /// Returns the prior of the picture. A frames.csv replaces the prior from the source.
    pub fn known(&mut self, frames: Option<&Frames>) -> Option<FrameData> {
        match frames {
            Some(frames) => frames.get(&self.name).cloned(),
            None => self.data.take(),
        }
    }
    /// Returns the origin of the picture's time. A frames.csv with times, or the source's own data, replaces every
    /// other.
    pub fn time_source(&self, frames: Option<&Frames>) -> TimeSource {
        let timed = frames.map_or(self.data.is_some(), Frames::has_times);
        if timed { TimeSource::Table } else { self.time }
    }
}

impl Payload {
    /// Decodes the picture. With a sensor, the picture must have the sensor's size, and gets the sensor's number of
    /// bits and turn. Also returns the file's own bytes, if they are PNG or JPEG and can be kept unchanged.
    ///
    /// # Errors
    /// The reason why the picture cannot be read, for its result.
    pub fn decode(self, sensor: Option<&Config>) -> Result<(Picture, Option<Vec<u8>>), String> {
        let Some(sensor) = sensor else { return self.decode_as_it_is(None) };
        let own = (u32::from(sensor.camera.width), u32::from(sensor.camera.height));
        // With EXIF, each picture has its own turn, so the stored size is known only after decoding.
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

    /// Returns the largest sample of a picture of 16-bit words. Returns `None` for any other or unreadable picture.
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

/// Opens the inputs, whatever kind they are. `topic` selects one of the topics of an MCAP.
///
/// # Errors
/// An input does not exist, is of an unknown kind, or the mixture of inputs has no order.
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

/// Opens a recording. A recording of ours is processed again as it was recorded. Of any other recording, and of another
/// topic, only the pictures are used.
fn open_recording(path: &Path, topic: Option<&str>) -> Result<Box<dyn Source>, Error> {
    if topic.is_none_or(|topic| topic == hzn_mcap::IMAGE_TOPIC)
        && let Some(ours) = rerun::Rerun::open(path)?
    {
        return Ok(Box::new(ours));
    }
    Ok(Box::new(recording::Recording::open(path, topic)?))
}

/// Returns the EXIF time of exposure of a picture file, in seconds since 1970.
pub fn exif_time_s(path: &Path) -> Option<f64> {
    picture::exif_of(path).flatten()
}

/// Returns the lens data from a picture file's EXIF.
pub fn exif_lens(path: &Path) -> Option<hzn_calib::start::Exif> {
    picture::lens_of(path)
}

/// Returns the picture of a recorded message.
pub fn recorded(image: hzn_mcap::EncodedImage) -> Payload {
    recording::payload(image)
}

/// Checks that an input file exists. Returns the ending of its kind, and whether an unfinished run left it. An
/// unfinished file has the ending of its kind before `.part`.
///
/// # Errors
/// The file does not exist, or is a folder.
pub fn existing(file: &Path) -> Result<(String, bool), Error> {
    if !file.is_file() {
        let what = if file.is_dir() { "is a folder; a file is expected here" } else { "no such file" };
        return Err(unusable(format!("{}: {what}", file.display())));
    }
    let unfinished = ending(file) == "part";
    Ok((if unfinished { ending(&file.with_extension("")) } else { ending(file) }, unfinished))
}

/// Returns the file's ending in lower case, without the dot.
pub fn ending(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}
