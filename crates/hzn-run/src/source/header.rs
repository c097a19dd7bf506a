//! Facts from the header of a picture file, without its pixels.

use std::path::Path;

use image::metadata::Orientation;
use image::{ImageDecoder, ImageReader};

use super::exif;

/// Returns width and height in pixels from the header of a picture file.
pub(super) fn read_size(path: &Path) -> Option<(u32, u32)> {
    read_size_from(std::io::BufReader::new(std::fs::File::open(path).ok()?))
}

/// Returns the time of exposure, if the camera wrote it into the file. `None` if the header cannot be read.
pub(super) fn read_exif_time(path: &Path) -> Option<Option<f64>> {
    let mut decoder = ImageReader::open(path).ok()?.with_guessed_format().ok()?.into_decoder().ok()?;
    Some(decoder.exif_metadata().ok().flatten().and_then(exif::time_s))
}

/// Returns the lens data from the file's EXIF. `None` if the header cannot be read or there is no EXIF.
pub(super) fn read_lens(path: &Path) -> Option<hzn_calib::start::Exif> {
    let mut decoder = ImageReader::open(path).ok()?.with_guessed_format().ok()?.into_decoder().ok()?;
    decoder.exif_metadata().ok().flatten().and_then(exif::lens)
}

/// Returns the turn that is needed to show a picture upright, as the camera recorded it.
pub(super) fn read_orientation(path: &Path) -> Option<Orientation> {
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
pub(super) fn has_white_value(path: &Path) -> bool {
    use image::codecs::pnm::PnmDecoder;
    let Ok(file) = std::fs::File::open(path) else { return false };
    let decoder = PnmDecoder::new(std::io::BufReader::new(file));
    decoder.is_ok_and(|d| d.into_inner().1.maximal_sample() < u32::from(u16::MAX))
}

/// Returns width and height as [`read_size`] does, from the file's contents.
pub(super) fn read_size_from(contents: impl std::io::BufRead + std::io::Seek) -> Option<(u32, u32)> {
    ImageReader::new(contents).with_guessed_format().ok()?.into_dimensions().ok()
}
