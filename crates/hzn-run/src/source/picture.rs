//! A decoded picture, and the reading of picture files with limits.

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

/// So many upper bits are not left unused by chance.
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
    /// Time of exposure from EXIF, seconds since 1970 (EXIF has no time zone: taken as UTC).
    pub exif_time_s: Option<f64>,
    /// How the camera says that it is to be turned to be shown.
    pub orientation: Orientation,
    /// Pictures in its file, of which it is the first.
    pub pages: u32,
}

impl Picture {
    /// A picture that is no file.
    pub fn new(samples: Samples, layout: Layout) -> Self {
        Self { samples, layout, exif_time_s: None, orientation: Orientation::NoTransforms, pages: 1 }
    }

    /// With as many bits as a sensor says, and turned as it says.
    ///
    /// # Errors
    /// A sample that has more.
    pub fn told(mut self, input: &Input) -> Result<Self, String> {
        if let (Some(most), Some(bits)) = (self.largest_word(), input.bits) {
            if u32::from(most) >> bits > 0 {
                let needed = 16 - most.leading_zeros();
                return Err(format!(
                    "a sample of {most} has more bits than input.bits = {bits}, which sensor.toml or the other \
                     pictures say: write bits = {needed} or more in [input] of sensor.toml"
                ));
            }
            self.layout.bits = bits;
        }
        let turn = turn::needed(input.orient, self.orientation);
        Ok(turn::turned(self, turn))
    }

    /// Whether [`Self::told`] turns it.
    pub fn is_turned(&self, input: &Input) -> bool {
        turn::needed(input.orient, self.orientation) != Orientation::NoTransforms
    }

    /// How the camera says that it is to be shown, in words, where that is not as it is stored.
    pub fn to_be_turned(&self) -> Option<&'static str> {
        (self.orientation != Orientation::NoTransforms).then(|| turn::in_words(self.orientation))
    }

    /// The largest sample of a picture of words, transparency aside.
    pub fn largest_word(&self) -> Option<u16> {
        let Samples::Words(words) = &self.samples else { return None };
        let channels = usize::from(self.layout.channels.max(1));
        let bright = if channels.is_multiple_of(2) { channels - 1 } else { channels };
        words.chunks_exact(channels).flat_map(|pixel| pixel.iter().take(bright)).copied().max()
    }

    /// What to try when nothing is found and the upper bits of all words are unused, of which nobody has told.
    pub fn unused_bits(&self) -> Option<String> {
        let most = self.largest_word()?;
        if self.layout.bits == 16 { unused_bits(most) } else { None }
    }

    /// The picture for the pipeline.
    ///
    /// # Errors
    /// A channel that the picture does not have.
    pub fn view(&self, channel: Channel) -> Result<ImageView<'_>, ImageError> {
        match &self.samples {
            Samples::Bytes(data) => ImageView::from_bytes(data, self.layout, channel),
            Samples::Words(data) => ImageView::from_words(data, self.layout, channel),
        }
    }

    /// The picture as 8-bit RGB, for drawing on. Pictures of more than 8 bits are scaled down.
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

    /// The picture as PNG bytes, grey or colour, 8 or 16 bits. Words of 9 to 15 bits keep their counts.
    ///
    /// # Errors
    /// What the encoder says.
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

/// What to try where samples of 16 bits reach no more than `most`, and nobody has told how many bits they have.
pub fn unused_bits(most: u16) -> Option<String> {
    let bits = (16 - most.leading_zeros()).max(8);
    (bits + UNUSED_BITS <= 16).then(|| {
        format!(
            "samples reach {most} of 65535: if the camera has fewer bits than the file has room for, say so with bits \
             = {bits} in [input] of sensor.toml"
        )
    })
}

/// The kind of picture that these bytes are, by their first few.
pub fn format_of(bytes: &[u8]) -> Option<ImageFormat> {
    image::guess_format(bytes).ok()
}

/// Width and height in pixels that a picture file's header gives.
pub(super) fn size_of(path: &Path) -> Option<(u32, u32)> {
    size_in(std::io::BufReader::new(std::fs::File::open(path).ok()?))
}

/// When the camera exposed, if it wrote that into the file; `None` for a file whose header cannot be read.
pub(super) fn exif_of(path: &Path) -> Option<Option<f64>> {
    let mut decoder = ImageReader::open(path).ok()?.with_guessed_format().ok()?.into_decoder().ok()?;
    Some(decoder.exif_metadata().ok().flatten().and_then(super::exif::time_s))
}

/// What the camera wrote of its lens into the file; `None` for a file whose header cannot be read, or without EXIF.
pub(super) fn lens_of(path: &Path) -> Option<hzn_calib::start::Exif> {
    let mut decoder = ImageReader::open(path).ok()?.with_guessed_format().ok()?.into_decoder().ok()?;
    decoder.exif_metadata().ok().flatten().and_then(super::exif::lens)
}

/// How the camera says that a picture is to be turned to be shown.
pub(super) fn orientation_of(path: &Path) -> Option<Orientation> {
    ImageReader::open(path).ok()?.with_guessed_format().ok()?.into_decoder().ok()?.orientation().ok()
}

/// Whether its samples are words, by its header.
pub(super) fn has_words(contents: impl std::io::Read + std::io::Seek) -> bool {
    let reader = ImageReader::new(std::io::BufReader::new(contents)).with_guessed_format();
    reader.ok().and_then(|reader| reader.into_decoder().ok()).is_some_and(|decoder| {
        let color = decoder.color_type();
        color.bytes_per_pixel() > color.channel_count()
    })
}

/// Whether its header says which sample is white, so that it is scaled to all 16 bits when it is decoded: a PNM of
/// less.
pub(super) fn tells_its_scale(path: &Path) -> bool {
    use image::codecs::pnm::PnmDecoder;
    let Ok(file) = std::fs::File::open(path) else { return false };
    let decoder = PnmDecoder::new(std::io::BufReader::new(file));
    decoder.is_ok_and(|d| d.into_inner().1.maximal_sample() < u32::from(u16::MAX))
}

/// As [`size_of`], from the file's contents.
pub(super) fn size_in(contents: impl std::io::BufRead + std::io::Seek) -> Option<(u32, u32)> {
    ImageReader::new(contents).with_guessed_format().ok()?.into_dimensions().ok()
}

/// Reads a whole file, unless it is far too large for a picture.
///
/// # Errors
/// Why it cannot be read, for the record of the frame.
pub fn read_file(path: &Path) -> Result<Vec<u8>, String> {
    let told = |e: std::io::Error| match e.kind() {
        std::io::ErrorKind::NotFound => match std::fs::read_link(path) {
            Ok(there) => format!("is a link to {}, which is not there", there.display()),
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

/// Decodes PNG, JPEG, TIFF, PNM or BMP. Palettes become colour, CMYK becomes RGB, of several pictures in one file the
/// first is taken. `expected` is the camera's size: another one is refused before anything large is decoded.
///
/// # Errors
/// Why it cannot be decoded, for the record of the frame.
pub fn decode(bytes: &[u8], expected: Option<(u32, u32)>) -> Result<Picture, String> {
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| e.to_string())?;
    let mut limits = image::Limits::no_limits();
    limits.max_alloc = Some(MAX_BYTES);
    reader.limits(limits);
    let format = reader.format().ok_or("is no picture that is known here (PNG, JPEG, TIFF, PNM, BMP)")?;
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
        return Err("JPEG data end before the picture does: the file is truncated".into());
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
            return Err(format!("samples of kind {:?} are not supported; use 8 or 16 bit integers", other.color()));
        }
    };
    let layout = Layout::packed(width, height, channels, bits);
    Ok(Picture { exif_time_s, orientation, pages: pages::count(bytes, format), ..Picture::new(samples, layout) })
}

/// Refuses sizes that are not the camera's, zero, or beyond all limits.
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

/// JPEG decoders fill what is missing with grey, which would pass for a picture. A scan that began (FF DA) must be
/// followed by an end (FF D9); neither stands within entropy-coded data.
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
            format!("{name} data end before the picture does: the file is truncated")
        }
        _ => format!("{name} cannot be decoded: {text}"),
    }
}
