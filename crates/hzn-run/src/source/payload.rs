//! The picture of an item before it is decoded, and its decoding.

use std::path::PathBuf;

use hzn_core::Config;
use hzn_core::config::Orient;
use hzn_core::image::Layout;
use hzn_core::tone::Tone;
use hzn_files::start::Exif;
use hzn_mcap::{EncodedImage, ImageFormat};

use super::levels::Levels;
use super::memory::Held;
use super::paths::open_file;
use super::picture::{Picture, Samples};
use super::raw::Raw;
use super::tone::{self, FoundTone};
use super::{decode, header};

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

impl Payload {
    /// Returns the picture of a recorded message.
    pub fn from_recorded(image: EncodedImage) -> Self {
        let EncodedImage { format, bytes } = image;
        let raw = |samples, width, height, channels, bits| {
            let layout = Layout::packed(width, height, channels, bits);
            Self::Decoded(Picture::new(samples, layout))
        };
        match format {
            ImageFormat::Png | ImageFormat::Jpeg => Self::Encoded(bytes),
            ImageFormat::Other(name) if name == "webp" => Self::Encoded(bytes),
            ImageFormat::Other(name) => {
                Self::Broken(format!("pictures in {name} are not supported; record PNG, JPEG or WebP"))
            }
            ImageFormat::Mono8 { width, height } => raw(Samples::Bytes(bytes), width, height, 1, 8),
            ImageFormat::Rgb8 { width, height } => raw(Samples::Bytes(bytes), width, height, 3, 8),
            ImageFormat::Mono16 { width, height } => raw(Samples::Words(words(&bytes)), width, height, 1, 16),
            ImageFormat::Rgb16 { width, height } => raw(Samples::Words(words(&bytes)), width, height, 3, 16),
        }
    }

    /// Decodes the picture. With a sensor, the picture must have the sensor's size, and gets the sensor's number of
    /// bits, turn and inversion. Also returns the file's own bytes, if they are PNG or JPEG and can be kept unchanged.
    ///
    /// # Errors
    /// The reason why the picture cannot be read, for its result.
    pub fn decode(self, sensor: Option<&Config>) -> Result<(Picture, Option<Vec<u8>>), String> {
        self.decode_holding(sensor, &mut Held::default())
    }

    /// Decodes the picture as [`Self::decode`] does, when its memory is free. The memory is held until `held` is
    /// dropped, which must not be later than the picture.
    ///
    /// # Errors
    /// The errors are those of [`Self::decode`].
    pub fn decode_holding(
        self,
        sensor: Option<&Config>,
        held: &mut Held,
    ) -> Result<(Picture, Option<Vec<u8>>), String> {
        let Some(sensor) = sensor else { return self.decode_as_stored(None, held) };
        let own = (u32::from(sensor.camera.width), u32::from(sensor.camera.height));
        let (picture, original) = self.decode_as_stored(stored_size(sensor), held)?;
        let is_changed = picture.is_changed(&sensor.input);
        let picture = picture.with_input(&sensor.input)?;
        decode::check_size(picture.layout.width, picture.layout.height, Some(own))?;
        Ok((picture, original.filter(|_| !is_changed)))
    }

    /// Returns what a picture file says about its tone.
    pub fn tone(&self) -> Option<FoundTone> {
        match self {
            Self::File(path) => tone::read(open_file(path).ok()?),
            Self::Encoded(bytes) => tone::read(std::io::Cursor::new(bytes)),
            // Words of a message are the samples of a detector, as those of a file are.
            Self::Decoded(picture) if picture.layout.bits > 8 => {
                Some(FoundTone { tone: Tone::Linear, kind: "of more than 8 bits" })
            }
            Self::Decoded(_) | Self::RawFile(..) | Self::Broken(_) => None,
        }
    }

    /// Returns the lens data from the EXIF of a picture file.
    pub(crate) fn exif_lens(&self) -> Option<Exif> {
        match self {
            Self::File(path) => header::read_lens(open_file(path).ok()?),
            Self::Encoded(bytes) => header::read_lens(std::io::Cursor::new(bytes.clone())),
            Self::RawFile(..) | Self::Decoded(_) | Self::Broken(_) => None,
        }
    }

    /// Returns the levels of a picture of 16-bit words; of one that states its white value, only that. Returns `None`
    /// for any other or unreadable picture.
    pub(super) fn levels(self, sensor: &Config) -> Option<Levels> {
        let white = || Some([u16::MAX].into_iter().collect());
        match &self {
            Self::File(path) if !header::has_words(open_file(path).ok()?) => return None,
            Self::File(path) if header::has_white_value(open_file(path).ok()?) => return white(),
            Self::Encoded(bytes) if !header::has_words(std::io::Cursor::new(bytes)) => return None,
            Self::Encoded(bytes) if header::has_white_value(bytes.as_slice()) => return white(),
            _ => {}
        }
        self.decode_as_stored(stored_size(sensor), &mut Held::default()).ok()?.0.levels()
    }

    fn decode_as_stored(
        self,
        expected: Option<(u32, u32)>,
        held: &mut Held,
    ) -> Result<(Picture, Option<Vec<u8>>), String> {
        let encoded = |bytes: Vec<u8>, held: &mut Held| {
            let picture = decode::decode_holding(&bytes, expected, held)?;
            let keep = matches!(decode::guess_format(&bytes), Some(image::ImageFormat::Png | image::ImageFormat::Jpeg));
            Ok((picture, keep.then_some(bytes)))
        };
        let sized = |picture: Picture| {
            decode::check_size(picture.layout.width, picture.layout.height, expected)?;
            Ok((picture, None))
        };
        match self {
            Self::File(path) => encoded(decode::read_file_holding(&path, held)?, held),
            Self::Encoded(bytes) if bytes.is_empty() => Err("message without picture data".into()),
            Self::Encoded(bytes) => encoded(bytes, held),
            Self::RawFile(path, raw) => {
                let bytes = decode::read_file_holding(&path, held)?;
                // Packed samples become words, which take up to twice as much.
                held.raise(3 * bytes.len() as u64);
                sized(raw.decode(bytes)?)
            }
            Self::Decoded(picture) => sized(picture),
            Self::Broken(why) => Err(why),
        }
    }
}

/// Returns the words of a message, whose lower byte comes first.
fn words(bytes: &[u8]) -> Vec<u16> {
    bytes.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect()
}

/// Returns the size in pixels that the pictures of a sensor have in their files. With EXIF, each picture has its own
/// turn, so the size is known only after decoding.
fn stored_size(sensor: &Config) -> Option<(u32, u32)> {
    let (width, height) = (u32::from(sensor.camera.width), u32::from(sensor.camera.height));
    match sensor.input.orient {
        Orient::Exif => None,
        Orient::Rotate90 | Orient::Rotate270 => Some((height, width)),
        _ => Some((width, height)),
    }
}
