//! Decoded pictures, and the reading of picture files with limits.

use std::io::Cursor;
use std::path::Path;

use hzn_core::config::Input;
use hzn_core::image::{Channel, ImageError, ImageView, Layout};
use image::metadata::Orientation;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};

use super::{pages, turn};

/// Longest side of a picture that is read, in pixels.
pub const MAX_SIDE_PX: u32 = 20_000;
/// Largest decoded picture, in bytes.
pub const MAX_BYTES: u64 = 512 << 20;

/// If at least this many upper bits are unused, this is not by chance.
const UNUSED_BITS: u32 = 2;

/// Samples of a picture, packed.
#[derive(Debug, Clone)]
pub enum Samples {
    /// 8 bits.
    Bytes(Vec<u8>),
    /// 9 to 16 bits.
    Words(Vec<u16>),
}

/// A picture in memory.
#[derive(Debug, Clone)]
pub struct Picture {
    /// The samples.
    pub samples: Samples,
    /// Their arrangement.
    pub layout: Layout,
    /// Time of exposure from EXIF, in seconds since 1970. EXIF has no time zone: UTC is assumed.
    pub exif_time_s: Option<f64>,
    /// The turn that is needed to show the picture upright, as the camera recorded it.
    pub orientation: Orientation,
    /// Number of pictures in the file; this is the first of them.
    pub pages: u32,
}

impl Picture {
    /// Makes a picture that does not come from a file.
    pub fn new(samples: Samples, layout: Layout) -> Self {
        Self { samples, layout, exif_time_s: None, orientation: Orientation::NoTransforms, pages: 1 }
    }

    /// Returns the picture with the number of bits and the turn that the sensor's `[input]` sets.
    ///
    /// # Errors
    /// A sample has more bits.
    pub fn told(mut self, input: &Input) -> Result<Self, String> {
        if let (Some(most), Some(bits)) = (self.largest_word(), input.bits) {
            if u32::from(most) >> bits > 0 {
                let needed = 16 - most.leading_zeros();
                return Err(format!(
                    "a sample of {most} has more bits than input.bits = {bits} (from sensor.toml or from the other \
                     pictures): set bits = {needed} or more in [input] of sensor.toml"
                ));
            }
            self.layout.bits = bits;
        }
        let turn = turn::needed(input.orient, self.orientation);
        Ok(turn::turned(self, turn))
    }

    /// Returns whether [`Self::told`] turns the picture.
    pub fn is_turned(&self, input: &Input) -> bool {
        turn::needed(input.orient, self.orientation) != Orientation::NoTransforms
    }

    /// Returns in words how the picture is to be turned for display, if the camera recorded a turn.
    pub fn to_be_turned(&self) -> Option<&'static str> {
        (self.orientation != Orientation::NoTransforms).then(|| turn::in_words(self.orientation))
    }

    /// Returns the largest sample of a picture of words, without the transparency channel.
    pub fn largest_word(&self) -> Option<u16> {
        let Samples::Words(words) = &self.samples else { return None };
        let channels = usize::from(self.layout.channels.max(1));
        let bright = if channels.is_multiple_of(2) { channels - 1 } else { channels };
        words.chunks_exact(channels).flat_map(|pixel| pixel.iter().take(bright)).copied().max()
    }

    /// Returns advice for a picture without an answer whose upper bits are all unused, if the number of bits is not
    /// known.
    pub fn unused_bits(&self) -> Option<String> {
        let most = self.largest_word()?;
        if self.layout.bits == 16 { unused_bits(most) } else { None }
    }

    /// Returns a view of the picture for the pipeline.
    ///
    /// # Errors
    /// The picture does not have this channel.
    pub fn view(&self, channel: Channel) -> Result<ImageView<'_>, ImageError> {
        match &self.samples {
            Samples::Bytes(data) => ImageView::from_bytes(data, self.layout, channel),
            Samples::Words(data) => ImageView::from_words(data, self.layout, channel),
        }
    }

    /// Returns the picture as 8-bit RGB, to draw on. Pictures of more than 8 bits are scaled down.
    pub fn to_rgb(&self) -> image::RgbImage {
        let (w, h, n) = (self.layout.width, self.layout.height, usize::from(self.layout.channels));
        let shift = self.layout.bits.saturating_sub(8);
        let byte = |i: usize| match &self.samples {
            Samples::Bytes(d) => d.get(i).copied().unwrap_or(0),
            Samples::Words(d) => d.get(i).map_or(0, |&v| (v >> shift) as u8),
        };
        image::RgbImage::from_fn(w, h, |x, y| {
            let at = (y as usize * w as usize + x as usize) * n;
            image::Rgb(if n >= 3 { [byte(at), byte(at + 1), byte(at + 2)] } else { [byte(at); 3] })
        })
    }

    /// Returns the picture as PNG bytes, grey or colour, 8 or 16 bits. Words of 9 to 15 bits keep their counts.
    ///
    /// # Errors
    /// The message of the encoder.
    pub fn to_png(&self) -> Result<Vec<u8>, String> {
        use image::ExtendedColorType as C;
        use image::codecs::png::{CompressionType, FilterType, PngEncoder};
        let mut out = Vec::new();
        let color = match (self.layout.channels, &self.samples) {
            (1, Samples::Bytes(_)) => C::L8,
            (2, Samples::Bytes(_)) => C::La8,
            (3, Samples::Bytes(_)) => C::Rgb8,
            (_, Samples::Bytes(_)) => C::Rgba8,
            (1, Samples::Words(_)) => C::L16,
            (2, Samples::Words(_)) => C::La16,
            (3, Samples::Words(_)) => C::Rgb16,
            (_, Samples::Words(_)) => C::Rgba16,
        };
        let words;
        let data = match &self.samples {
            Samples::Bytes(d) => d.as_slice(),
            Samples::Words(d) => {
                words = d.iter().flat_map(|w| w.to_ne_bytes()).collect::<Vec<u8>>();
                &words
            }
        };
        let encoder = PngEncoder::new_with_quality(&mut out, CompressionType::Fast, FilterType::Sub);
        image::ImageEncoder::write_image(encoder, data, self.layout.width, self.layout.height, color)
            .map_err(|e| e.to_string())?;
        Ok(out)
    }
}

/// Returns advice if samples of 16 bits reach no more than `most`, and the number of bits is not known.
pub fn unused_bits(most: u16) -> Option<String> {
    let bits = (16 - most.leading_zeros()).max(8);
    (bits + UNUSED_BITS <= 16).then(|| {
        format!(
            "the largest sample is {most} of 65535: if the camera has fewer bits than the file, set bits = {bits} in \
             [input] of sensor.toml"
        )
    })
}

/// Returns the format of picture data, from their first bytes.
pub fn format_of(bytes: &[u8]) -> Option<ImageFormat> {
    image::guess_format(bytes).ok()
}

/// Returns width and height in pixels from the header of a picture file.
pub(super) fn size_of(path: &Path) -> Option<(u32, u32)> {
    size_in(std::io::BufReader::new(std::fs::File::open(path).ok()?))
}

/// Returns the time of exposure, if the camera wrote it into the file. `None` if the header cannot be read.
pub(super) fn exif_of(path: &Path) -> Option<Option<f64>> {
    let mut decoder = ImageReader::open(path).ok()?.with_guessed_format().ok()?.into_decoder().ok()?;
    Some(decoder.exif_metadata().ok().flatten().and_then(super::exif::time_s))
}

/// Returns the lens data from the file's EXIF. `None` if the header cannot be read or there is no EXIF.
pub(super) fn lens_of(path: &Path) -> Option<hzn_calib::start::Exif> {
    let mut decoder = ImageReader::open(path).ok()?.with_guessed_format().ok()?.into_decoder().ok()?;
    decoder.exif_metadata().ok().flatten().and_then(super::exif::lens)
}

/// Returns the turn that is needed to show a picture upright, as the camera recorded it.
pub(super) fn orientation_of(path: &Path) -> Option<Orientation> {
    ImageReader::open(path).ok()?.with_guessed_format().ok()?.into_decoder().ok()?.orientation().ok()
}

/// Returns whether the samples are words, from the header.
pub(super) fn has_words(contents: impl std::io::Read + std::io::Seek) -> bool {
    let reader = ImageReader::new(std::io::BufReader::new(contents)).with_guessed_format();
    reader.ok().and_then(|reader| reader.into_decoder().ok()).is_some_and(|decoder| {
        let color = decoder.color_type();
        color.bytes_per_pixel() > color.channel_count()
    })
}

/// Returns whether the header gives a white value below 65535, as a PNM can. The decoder then scales the samples to all
/// 16 bits.
pub(super) fn tells_its_scale(path: &Path) -> bool {
    use image::codecs::pnm::PnmDecoder;
    let Ok(file) = std::fs::File::open(path) else { return false };
    let decoder = PnmDecoder::new(std::io::BufReader::new(file));
    decoder.is_ok_and(|d| d.into_inner().1.maximal_sample() < u32::from(u16::MAX))
}

/// Returns width and height as [`size_of`] does, from the file's contents.
pub(super) fn size_in(contents: impl std::io::BufRead + std::io::Seek) -> Option<(u32, u32)> {
    ImageReader::new(contents).with_guessed_format().ok()?.into_dimensions().ok()
}

/// Reads a whole file, unless it is far too large for a picture.
///
/// # Errors
/// The reason why it cannot be read, for the picture's result.
pub fn read_file(path: &Path) -> Result<Vec<u8>, String> {
    let told = |e: std::io::Error| match e.kind() {
        std::io::ErrorKind::NotFound => match std::fs::read_link(path) {
            Ok(there) => format!("is a link to {}, which does not exist", there.display()),
            Err(_) => "no such file".to_owned(),
        },
        _ => format!("cannot be read: {e}"),
    };
    let meta = std::fs::metadata(path).map_err(told)?;
    if meta.is_dir() {
        return Err("is a folder".into());
    }
    if meta.len() > 2 * MAX_BYTES {
        return Err(format!(
            "file of {} MB is larger than the limit of {} MB",
            meta.len() >> 20,
            (2 * MAX_BYTES) >> 20
        ));
    }
    let bytes = std::fs::read(path).map_err(told)?;
    if bytes.is_empty() { Err("file is empty".into()) } else { Ok(bytes) }
}

/// Decodes PNG, JPEG, TIFF, PNM or BMP. Palettes become colour, and CMYK becomes RGB. If a file contains several
/// pictures, the first is decoded. `expected` is the camera's size in pixels: a picture of another size is refused
/// before anything large is decoded.
///
/// # Errors
/// The reason why it cannot be decoded, for the picture's result.
pub fn decode(bytes: &[u8], expected: Option<(u32, u32)>) -> Result<Picture, String> {
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| e.to_string())?;
    let mut limits = image::Limits::no_limits();
    limits.max_alloc = Some(MAX_BYTES);
    reader.limits(limits);
    let format = reader.format().ok_or("is not a picture of a supported format (PNG, JPEG, TIFF, PNM, BMP)")?;
    let mut decoder = reader.into_decoder().map_err(|e| explain(&e, format))?;
    let (width, height) = decoder.dimensions();
    check_size(width, height, expected)?;
    if decoder.total_bytes() > MAX_BYTES {
        return Err(format!(
            "picture of {width}x{height} needs {} MB, above the limit of {} MB",
            decoder.total_bytes() >> 20,
            MAX_BYTES >> 20
        ));
    }
    if format == ImageFormat::Jpeg && jpeg_is_cut(bytes) {
        return Err("JPEG data end before the picture is complete: the file is truncated".into());
    }
    let exif_time_s = decoder.exif_metadata().ok().flatten().and_then(super::exif::time_s);
    let orientation = decoder.orientation().unwrap_or(Orientation::NoTransforms);
    let image = DynamicImage::from_decoder(decoder).map_err(|e| explain(&e, format))?;
    let (samples, channels, bits) = match image {
        DynamicImage::ImageLuma8(i) => (Samples::Bytes(i.into_raw()), 1, 8),
        DynamicImage::ImageLumaA8(i) => (Samples::Bytes(i.into_raw()), 2, 8),
        DynamicImage::ImageRgb8(i) => (Samples::Bytes(i.into_raw()), 3, 8),
        DynamicImage::ImageRgba8(i) => (Samples::Bytes(i.into_raw()), 4, 8),
        DynamicImage::ImageLuma16(i) => (Samples::Words(i.into_raw()), 1, 16),
        DynamicImage::ImageLumaA16(i) => (Samples::Words(i.into_raw()), 2, 16),
        DynamicImage::ImageRgb16(i) => (Samples::Words(i.into_raw()), 3, 16),
        DynamicImage::ImageRgba16(i) => (Samples::Words(i.into_raw()), 4, 16),
        other => {
            return Err(format!("samples of kind {:?} are not supported; use integers of 8 or 16 bits", other.color()));
        }
    };
    let layout = Layout::packed(width, height, channels, bits);
    Ok(Picture { exif_time_s, orientation, pages: pages::count(bytes, format), ..Picture::new(samples, layout) })
}

/// Refuses sizes that are zero, above the limit, or not the camera's size.
pub(crate) fn check_size(width: u32, height: u32, expected: Option<(u32, u32)>) -> Result<(), String> {
    if width == 0 || height == 0 {
        return Err(format!("picture of {width}x{height} has no pixels"));
    }
    if width > MAX_SIDE_PX || height > MAX_SIDE_PX {
        return Err(format!("picture of {width}x{height} is larger than the limit of {MAX_SIDE_PX} px a side"));
    }
    match expected {
        Some((w, h)) if (w, h) != (width, height) => Err(format!(
            "picture is {width}x{height} but the camera is {w}x{h} (camera.width, camera.height in sensor.toml){}",
            if (h, w) == (width, height) { "; input.orient turns pictures" } else { "" }
        )),
        _ => Ok(()),
    }
}

/// Returns whether a JPEG is truncated. JPEG decoders fill missing parts with grey, which would pass as a picture. A
/// scan that began (FF DA) must be followed by an end (FF D9). Neither marker occurs within entropy-coded data.
fn jpeg_is_cut(bytes: &[u8]) -> bool {
    let last = |marker: u8| bytes.windows(2).rposition(|w| *w == [0xff, marker]);
    match (last(0xda), last(0xd9)) {
        (Some(scan), Some(end)) => end < scan,
        (Some(_), None) => true,
        (None, _) => false,
    }
}

fn explain(error: &image::ImageError, format: ImageFormat) -> String {
    let name = format!("{format:?}").to_uppercase();
    let text = error.to_string().replace('\n', " ");
    match error {
        image::ImageError::Limits(_) => format!("{name} needs more memory than the limit of {} MB", MAX_BYTES >> 20),
        image::ImageError::Unsupported(_) => format!("{name} of a kind that is not supported: {text}"),
        image::ImageError::IoError(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => {
            format!("{name} data end before the picture is complete: the file is truncated")
        }
        _ => format!("{name} cannot be decoded: {text}"),
    }
}
