//! What a camera wrote into the picture's EXIF: the time of exposure, and its lens.

use exif::{Exif, In, Tag, Value};
use hzn_files::start;

/// Reads the entries as far as possible, and returns the first fault. Some cameras end the block after the last entry,
/// without the pointer to a next list that the standard asks for; all their entries are readable.
fn read(block: Vec<u8>) -> Result<(Exif, Option<String>), String> {
    let mut fault = None;
    let read = exif::Reader::new().continue_on_error(true).read_raw(block);
    let read = read.or_else(|e| e.distill_partial_result(|faults| fault = faults.first().map(|f| f.to_string())));
    Ok((read.map_err(|e| e.to_string())?, fault))
}

/// Returns a text without the spaces around it.
fn text(exif: &Exif, tag: Tag) -> Option<String> {
    match &exif.get_field(tag, In::PRIMARY)?.value {
        Value::Ascii(parts) => Some(String::from_utf8_lossy(parts.first()?).trim().to_owned()),
        _ => None,
    }
}

/// Returns `DateTimeOriginal` with its fraction, in seconds since 1970; `None` without this entry. EXIF rarely has a
/// time zone: UTC is assumed.
///
/// # Errors
/// The block cannot be read, or has a fault that may be the reason why there is no entry, or the entry is not a time.
pub(super) fn time_s(block: Vec<u8>) -> Result<Option<f64>, String> {
    let (exif, fault) = read(block)?;
    let Some(stamp) = text(&exif, Tag::DateTimeOriginal) else { return fault.map_or(Ok(None), Err) };
    let whole = stamp
        .split_once(' ')
        .and_then(|(date, clock)| hzn_files::time::unix_seconds(&format!("{}T{clock}", date.replace(':', "-"))));
    let whole = whole.ok_or_else(|| format!("DateTimeOriginal {stamp:?} is not a time"))?;
    let fraction = text(&exif, Tag::SubSecTimeOriginal).and_then(|t| format!("0.{t}").parse::<f64>().ok());
    Ok(Some(whole + fraction.unwrap_or(0.0)))
}

/// Returns whether the colours are those of sRGB.
pub(super) fn is_srgb(block: Vec<u8>) -> bool {
    let read = read(block);
    read.is_ok_and(|(exif, _)| {
        exif.get_field(Tag::ColorSpace, In::PRIMARY).is_some_and(|f| f.value.get_uint(0) == Some(1))
    })
}

/// Returns the camera and its lens.
pub(super) fn lens(block: Vec<u8>) -> Option<start::Exif> {
    let (exif, _) = read(block).ok()?;
    let number = |tag: Tag| match &exif.get_field(tag, In::PRIMARY)?.value {
        Value::Rational(v) => v.first().map(exif::Rational::to_f64),
        other => other.get_uint(0).map(f64::from),
    };
    let text = |tag: Tag| text(&exif, tag).filter(|t| !t.is_empty());
    // The length in millimetres of the unit of the resolution: 2 is an inch, which is also the default without the tag;
    // 3 is a centimetre. Some programs also write 4 (millimetre) and 5 (micrometre).
    let unit_mm = match number(Tag::FocalPlaneResolutionUnit).unwrap_or(2.0) as u32 {
        3 => 10.0,
        4 => 1.0,
        5 => 1e-3,
        _ => 25.4,
    };
    Some(start::Exif {
        camera: match (text(Tag::Model), text(Tag::LensModel)) {
            (Some(camera), Some(lens)) => Some(format!("{camera}, {lens}")),
            (camera, lens) => camera.or(lens),
        },
        focal_mm: number(Tag::FocalLength),
        focal_35mm_mm: number(Tag::FocalLengthIn35mmFilm),
        plane_px_per_mm: number(Tag::FocalPlaneXResolution).map(|n| n / unit_mm),
        columns: number(Tag::PixelXDimension),
        digital_zoom: number(Tag::DigitalZoomRatio),
        turned: number(Tag::Orientation).is_some_and(|o| (5.0..=8.0).contains(&o)),
    })
}
