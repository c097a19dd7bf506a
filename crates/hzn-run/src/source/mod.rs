//! The sources of pictures: folders, globs, single files, headerless files, video, MCAP.
//!
//! A [`Source`] hands out [`Item`]s in the sequence's order without decoding them. The threads decode them.

mod arrays;
#[cfg(feature = "recordings")]
mod bag;
mod bits;
#[cfg(feature = "recordings")]
mod calibration;
pub mod decode;
mod exif;
mod files;
mod find_tone;
mod gather;
mod header;
pub(crate) mod identity;
mod input;
mod item;
mod jpeg;
mod levels;
mod limits;
mod memory;
mod natural;
mod one_picture;
mod pages;
mod paths;
mod pattern;
mod payload;
pub mod picture;
mod picture_reader;
pub mod raw;
#[cfg(feature = "recordings")]
mod recording;
#[cfg(feature = "recordings")]
mod rerun;
mod sequence;
mod stream;
mod tone;
mod turn;
mod video;
mod watched;
mod webp;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

pub(crate) use arrays::{FITS_START, FitsHeader, fits_header};
#[cfg(feature = "recordings")]
pub use bag::{conversion, is_bag, recordings as recordings_of_bag};
pub use bits::{FoundBits, find_bits, with_key};
#[cfg(feature = "recordings")]
pub use calibration::{RecordedCamera, find_camera};
pub use find_tone::{describe_mixed_tones, find_tone};
pub use item::{Item, TimeSource};
pub use levels::Levels;
pub use memory::Held;
pub use one_picture::OnePicture;
pub use paths::{check_exists, ending, open_file};
pub use payload::Payload;
pub use picture::Picture;
pub use raw::Raw;
#[cfg(feature = "recordings")]
pub use recording::describe_clock;
#[cfg(feature = "recordings")]
pub use rerun::{describe_loss as describe_recording_loss, describe_rest, describe_unread, recorded_prior};
pub use sequence::Source;
pub use tone::FoundTone;
pub use video::measured;

use crate::error::{Error, Remedy, unusable};

/// Opens the inputs, whatever kind they are. `topic` selects one of the topics of an MCAP.
///
/// # Errors
/// An input does not exist, is of an unknown kind, or the mixture of inputs has no order.
///
/// ```
/// # let folder = tempfile::tempdir()?;
/// for name in ["10.png", "9.png"] {
///     image::GrayImage::new(64, 48).save(folder.path().join(name))?;
/// }
/// let mut source = hzn_run::source::open(&[folder.path().to_path_buf()], None, None)?;
/// let first = source.next().ok_or("no picture")??;
/// assert_eq!(first.name, "9.png"); // the order is that of the numbers in the names
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn open(inputs: &[PathBuf], raw: Option<Raw>, topic: Option<&str>) -> Result<Box<dyn Source>, Error> {
    if let [one] = inputs
        && raw.is_none()
    {
        #[cfg(feature = "recordings")]
        if let Some(source) = open_recorded(one, topic)? {
            return Ok(source);
        }
        if one.is_file() && video::ENDINGS.contains(&ending(one).as_str()) {
            return Ok(Box::new(video::Video::open(one)?));
        }
    }
    if let ([one], Some(raw)) = (inputs, raw)
        && is_stdin(one)
    {
        return Ok(Box::new(stream::Stream::open(std::io::stdin(), raw)?));
    }
    if topic.is_some() {
        return Err(unusable("only an MCAP has topics").with_remedy(Remedy::NoTopic));
    }
    Ok(Box::new(files::Files::open(inputs, raw)?))
}

/// Returns whether a file is a video by its ending.
pub fn is_video(file: &Path) -> bool {
    video::ENDINGS.contains(&ending(file).as_str())
}

/// Returns whether an input is standard input, which carries headerless pictures one after another.
pub fn is_stdin(input: &Path) -> bool {
    input == Path::new("-")
}

/// Opens a folder that grows: the pictures in it, then those that arrive, until `stop` is set. Waits for the first
/// picture.
///
/// # Errors
/// The input is not a folder, or no picture arrived before `stop` was set.
pub fn watch(inputs: &[PathBuf], raw: Option<Raw>, stop: Arc<AtomicBool>) -> Result<Box<dyn Source>, Error> {
    match inputs {
        [folder] if folder.is_dir() => Ok(Box::new(watched::Watched::open(folder, raw, stop)?)),
        _ => Err(unusable("only one folder can be watched for new pictures")),
    }
}

/// Opens a recording or a bag; `None` if the input is neither.
#[cfg(feature = "recordings")]
fn open_recorded(one: &Path, topic: Option<&str>) -> Result<Option<Box<dyn Source>>, Error> {
    if one.is_file() {
        match ending(one).as_str() {
            "mcap" => return open_recording(one, topic).map(Some),
            "db3" | "bag" => {
                return Err(unusable(format!("{}: is a bag of ROS; {}", one.display(), bag::conversion(one))));
            }
            _ => {}
        }
    }
    if is_bag(one) { Ok(Some(Box::new(bag::Bag::open(one, topic)?))) } else { Ok(None) }
}

/// Opens a recording. A recording of ours is processed again as it was recorded. Of any other recording, and of another
/// topic, only the pictures are used.
#[cfg(feature = "recordings")]
fn open_recording(path: &Path, topic: Option<&str>) -> Result<Box<dyn Source>, Error> {
    if topic.is_none_or(|topic| topic == hzn_mcap::IMAGE_TOPIC)
        && let Some(ours) = rerun::Rerun::open(path)?
    {
        return Ok(Box::new(ours));
    }
    Ok(Box::new(recording::Recording::open(path, topic, None)?))
}

/// Returns the EXIF time of exposure of a picture file, in seconds since 1970.
pub fn exif_time_s(path: &Path) -> Option<f64> {
    header::read_exif_time(open_file(path).ok()?)?.ok().flatten()
}

/// Returns the lens data from a picture file's EXIF.
pub fn exif_lens(path: &Path) -> Option<hzn_files::start::Exif> {
    header::read_lens(open_file(path).ok()?)
}
