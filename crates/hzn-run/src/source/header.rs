//! Facts from the header of a picture file, without its pixels.

#[cfg(feature = "recordings")]
use std::io::BufReader;
use std::io::{Read, Seek};
use std::path::Path;

use image::ImageDecoder;
use image::metadata::Orientation;

use super::paths::open_file;
use super::picture_reader::picture_reader;
use super::{arrays, exif};

/// Returns the decoder of a picture file's contents, which has read only the header. `None` if it cannot be read.
fn decoder<R: Read + Seek + 'static>(contents: R) -> Option<impl ImageDecoder + use<R>> {
    picture_reader(contents).ok()?.into_decoder().ok()
}

/// Returns width and height in pixels from the header of a picture file.
pub(super) fn read_size(path: &Path) -> Option<(u32, u32)> {
    read_size_from(open_file(path).ok()?)
}

/// Returns the time of exposure, if the camera wrote it into the file, or why its EXIF cannot be read. `None` if the
/// header cannot be read.
pub(super) fn read_exif_time(contents: impl Read + Seek + 'static) -> Option<Result<Option<f64>, String>> {
    let mut decoder = decoder(contents)?;
    let block = decoder.exif_metadata().map_err(|e| e.to_string());
    Some(block.and_then(|block| block.map_or(Ok(None), exif::time_s)))
}

/// Returns the lens data from the file's EXIF. `None` if the header cannot be read or there is no EXIF.
pub(super) fn read_lens(contents: impl Read + Seek + 'static) -> Option<hzn_files::start::Exif> {
    decoder(contents)?.exif_metadata().ok().flatten().and_then(exif::lens)
}

/// Returns the turn that is needed to show a picture upright, as the camera recorded it.
pub(super) fn read_orientation(contents: impl Read + Seek + 'static) -> Option<Orientation> {
    decoder(contents)?.orientation().ok()
}

/// Returns whether the samples are words, from the header.
pub(super) fn has_words(mut contents: impl Read + Seek) -> bool {
    if let Some(array) = arrays::read_header(&mut contents) {
        return array.is_ok_and(|array| array.has_words());
    }
    if contents.rewind().is_err() {
        return false;
    }
    if arrays::wide_tiff_size(&mut contents).is_some() {
        return true;
    }
    if contents.rewind().is_err() {
        return false;
    }
    let reader = picture_reader(contents);
    reader.ok().and_then(|reader| reader.into_decoder().ok()).is_some_and(|decoder| {
        let color = decoder.color_type();
        color.bytes_per_pixel() > color.channel_count()
    })
}

/// Returns whether the header gives a white value below 65535, as a PNM can. The decoder then scales the samples to all
/// 16 bits.
#[cfg(feature = "recordings")]
pub(super) fn has_white_value(contents: impl Read) -> bool {
    use image::codecs::pnm::PnmDecoder;
    let decoder = PnmDecoder::new(BufReader::new(contents));
    decoder.is_ok_and(|d| d.into_inner().1.maximal_sample() < u32::from(u16::MAX))
}

/// There is no decoder of PNM.
#[cfg(not(feature = "recordings"))]
pub(super) fn has_white_value(_: impl Read) -> bool {
    false
}

/// Returns width and height as [`read_size`] does, from the file's contents.
pub(super) fn read_size_from(mut contents: impl Read + Seek) -> Option<(u32, u32)> {
    if let Some(array) = arrays::read_header(&mut contents) {
        return array.ok().map(|array| (array.width, array.height));
    }
    contents.rewind().ok()?;
    let size = picture_reader(&mut contents).ok()?.into_dimensions().ok();
    size.or_else(|| {
        contents.rewind().ok()?;
        arrays::wide_tiff_size(&mut contents)
    })
}
