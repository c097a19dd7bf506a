//! Reads and decodes picture files, with limits.

use std::io::{Cursor, Read};
use std::path::Path;

use hzn_core::image::Layout;
use image::metadata::Orientation;
use image::{DynamicImage, ImageDecoder, ImageFormat};

pub(crate) use super::limits::check_size;
pub use super::limits::{MAX_BYTES, MAX_SIDE_PX};
use super::memory::Held;
use super::paths::open_file;
use super::picture::{Picture, Samples};
use super::picture_reader::picture_reader;
use super::{arrays, exif, jpeg, pages};

/// Memory that a decoder needs in addition to samples, in bytes. The header must fit into it.
const SLACK: u64 = 16 << 20;
/// Largest number of scans in a JPEG. An encoder writes about ten. Each takes as long as the whole picture.
const MAX_SCANS: usize = 100;

/// The formats that can be decoded.
const SUPPORTED: &str = if cfg!(feature = "recordings") {
    "PNG, JPEG, TIFF, PNM, BMP, WebP, FITS, NumPy"
} else {
    "PNG, JPEG, FITS, NumPy"
};

/// What helps against samples of a kind that is not supported, for example numbers with 32 bits in a TIFF.
const SAMPLES: &str = "scale its samples to whole numbers of 8 or 16 bits";

/// Returns the format of picture data, from their first bytes.
pub fn guess_format(bytes: &[u8]) -> Option<ImageFormat> {
    image::guess_format(bytes).ok()
}

/// Reads a whole file, unless it is far too large for a picture.
///
/// # Errors
/// The reason why it cannot be read, for the picture's result.
pub fn read_file(path: &Path) -> Result<Vec<u8>, String> {
    read_file_holding(path, &mut Held::default())
}

/// Reads a file as [`read_file`] does, when its memory is free.
pub(super) fn read_file_holding(path: &Path, held: &mut Held) -> Result<Vec<u8>, String> {
    let refuse = |e: std::io::Error| match e.kind() {
        std::io::ErrorKind::NotFound => match std::fs::read_link(path) {
            Ok(there) => format!("is a link to {}, which does not exist", there.display()),
            Err(_) => "no such file".to_owned(),
        },
        std::io::ErrorKind::IsADirectory | std::io::ErrorKind::InvalidInput => e.to_string(),
        _ => format!("cannot be read: {e}"),
    };
    let file = open_file(path).map_err(refuse)?;
    let size = file.metadata().map_err(refuse)?.len();
    if size > 2 * MAX_BYTES {
        return Err(format!("file of {} MB is larger than the limit of {} MB", size >> 20, (2 * MAX_BYTES) >> 20));
    }
    // Of a large file, samples and decoder are expected to take as much again, each. The decoder then need not wait
    // while the file is in memory.
    held.exchange(if size > SLACK { 3 * size } else { size });
    let mut bytes = Vec::with_capacity(size as usize);
    // The file may grow while it is read.
    file.take(2 * MAX_BYTES).read_to_end(&mut bytes).map_err(refuse)?;
    if bytes.is_empty() { Err("file is empty".into()) } else { Ok(bytes) }
}

/// Decodes PNG, JPEG, one plane of FITS, or an array of NumPy, and with the feature `recordings` TIFF, PNM, BMP and
/// WebP. Palettes become colour, and CMYK becomes RGB. If a file contains several pictures, the first is decoded.
/// `expected` is the camera's size in pixels: a picture of another size is refused before anything large is decoded.
///
/// # Errors
/// The reason why it cannot be decoded, for the picture's result.
pub fn decode(bytes: &[u8], expected: Option<(u32, u32)>) -> Result<Picture, String> {
    decode_holding(bytes, expected, &mut Held::default())
}

/// Decodes a picture as [`decode`] does, when its memory is free.
pub(super) fn decode_holding(bytes: &[u8], expected: Option<(u32, u32)>, held: &mut Held) -> Result<Picture, String> {
    if let Some(array) = arrays::decode(bytes, expected, held) {
        return array;
    }
    let mut reader = picture_reader(Cursor::new(bytes)).map_err(|e| e.to_string())?;
    reader.limits(limits(SLACK));
    let format = reader.format().filter(ImageFormat::reading_enabled).ok_or_else(|| {
        let found = name_foreign(bytes).map(|name| format!("; it is {name}: convert it")).unwrap_or_default();
        format!("is not a picture of a supported format ({SUPPORTED}){found}")
    })?;
    if format == ImageFormat::Tiff
        && let Some(picture) = arrays::decode_wide_tiff(bytes, expected, held)
    {
        return picture;
    }
    let mut decoder = reader.into_decoder().map_err(|e| explain(&e, format, SLACK))?;
    let (width, height) = decoder.dimensions();
    check_size(width, height, expected)?;
    if decoder.total_bytes() > MAX_BYTES {
        return Err(format!(
            "picture of {width}x{height} needs {} MB, above the limit of {} MB",
            decoder.total_bytes() >> 20,
            MAX_BYTES >> 20
        ));
    }
    if format == ImageFormat::Jpeg && jpeg_is_truncated(bytes) {
        return Err("JPEG data end before the picture is complete: the file is truncated".into());
    }
    let structure = if format == ImageFormat::Jpeg { jpeg::read(bytes) } else { jpeg::Structure::default() };
    if structure.scans > MAX_SCANS {
        return Err(format!("JPEG of {} scans is above the limit of {MAX_SCANS}: save it again", structure.scans));
    }
    let budget = budget(decoder.total_bytes(), format, structure);
    decoder.set_limits(limits(budget)).map_err(|e| explain(&e, format, budget))?;
    held.raise(bytes.len() as u64 + budget);
    let exif_time_s = decoder.exif_metadata().ok().flatten().and_then(|block| exif::time_s(block).ok().flatten());
    let orientation = decoder.orientation().unwrap_or(Orientation::NoTransforms);
    let image = DynamicImage::from_decoder(decoder).map_err(|e| explain(&e, format, budget))?;
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
            return Err(format!("samples of kind {:?} are not supported; {SAMPLES}", other.color()));
        }
    };
    let layout = Layout::packed(width, height, channels, bits);
    Ok(Picture { exif_time_s, orientation, pages: pages::count(bytes, format), ..Picture::new(samples, layout) })
}

/// Returns the memory that a decoder may need for a picture of `samples` bytes. A TIFF also has a compressed strip or
/// tile in memory. A progressive JPEG has coefficients of 16 bits for samples of 8 bits. A WebP has planes of
/// brightness and colour, or four channels.
fn budget(samples: u64, format: ImageFormat, structure: jpeg::Structure) -> u64 {
    let times = match format {
        ImageFormat::Tiff => 2,
        ImageFormat::WebP => 3,
        _ if structure.is_progressive => 3,
        _ => 1,
    };
    times * samples + SLACK
}

fn limits(bytes: u64) -> image::Limits {
    let mut limits = image::Limits::no_limits();
    limits.max_alloc = Some(bytes);
    limits
}

/// Returns the name of a format that is not supported, from the first bytes.
fn name_foreign(bytes: &[u8]) -> Option<&'static str> {
    const FORMATS: &[(usize, &[u8], &str)] = &[
        (4, b"jP  ", "JPEG 2000"),
        (0, b"\xff\x4f\xff\x51", "JPEG 2000"),
        (0, b"GIF8", "GIF"),
        (4, b"ftypavif", "AVIF"),
        (4, b"ftyphei", "HEIC"),
        (0, b"\x89HDF", "HDF5"),
        (0, b"%PDF", "PDF"),
    ];
    FORMATS.iter().find(|(at, magic, _)| bytes.get(*at..).is_some_and(|b| b.starts_with(magic))).map(|(.., name)| *name)
}

/// Returns whether a JPEG is truncated. JPEG decoders fill missing parts with grey, which would pass as a picture. A
/// scan that began (FF DA) must be followed by an end (FF D9). Neither marker occurs within entropy-coded data.
fn jpeg_is_truncated(bytes: &[u8]) -> bool {
    let last = |marker: u8| bytes.windows(2).rposition(|w| *w == [0xff, marker]);
    match (last(0xda), last(0xd9)) {
        (Some(scan), Some(end)) => end < scan,
        (Some(_), None) => true,
        (None, _) => false,
    }
}

fn explain(error: &image::ImageError, format: ImageFormat, budget: u64) -> String {
    let name = format!("{format:?}").to_uppercase();
    let text = error.to_string().replace('\n', " ");
    match error {
        image::ImageError::Limits(_) => {
            format!("{name} needs more memory than a picture of its size should: above {} MB", budget >> 20)
        }
        image::ImageError::Unsupported(_) => {
            format!("{name} of a kind that is not supported: {text}; {SAMPLES}")
        }
        image::ImageError::IoError(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => {
            format!("{name} data end before the picture is complete: the file is truncated")
        }
        _ => format!("{name} cannot be decoded: {text}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_decoder_may_take_what_its_format_needs() {
        let times = |format, is_progressive| {
            let budget = budget(1_000_000, format, jpeg::Structure { is_progressive, scans: 1 });
            (budget - SLACK) as f64 / 1e6
        };
        for format in [ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::Bmp, ImageFormat::Pnm] {
            assert_eq!(times(format, false), 1.0, "{format:?}");
        }
        assert_eq!(times(ImageFormat::Jpeg, true), 3.0);
        assert_eq!((times(ImageFormat::Tiff, false), times(ImageFormat::WebP, false)), (2.0, 3.0));
        // Of a picture without pixels, a header is left.
        assert_eq!(budget(0, ImageFormat::WebP, jpeg::Structure::default()), SLACK);
        // The largest picture that is accepted has a budget, too.
        assert_eq!(budget(MAX_BYTES, ImageFormat::WebP, jpeg::Structure::default()), 3 * MAX_BYTES + SLACK);
    }
}
