//! What a camera wrote into the picture's EXIF: the time of exposure, and its lens.

use exif::{In, Tag, Value};
use hzn_files::start;

/// Returns `DateTimeOriginal` with its fraction, in seconds since 1970. EXIF rarely has a time zone: UTC is assumed.
pub(super) fn time_s(block: Vec<u8>) -> Option<f64> {
    let exif = exif::Reader::new().read_raw(block).ok()?;
    let text = |tag: Tag| match &exif.get_field(tag, In::PRIMARY)?.value {
        Value::Ascii(parts) => Some(String::from_utf8_lossy(parts.first()?).trim().to_owned()),
        _ => None,
    };
    let stamp = text(Tag::DateTimeOriginal)?;
    let (date, clock) = stamp.split_once(' ')?;
    let whole = hzn_files::time::unix_seconds(&format!("{}T{clock}", date.replace(':', "-")))?;
    let fraction = text(Tag::SubSecTimeOriginal).and_then(|t| format!("0.{t}").parse::<f64>().ok()).unwrap_or(0.0);
    Some(whole + fraction)
}

/// Returns the camera and its lens.
pub(super) fn lens(block: Vec<u8>) -> Option<start::Exif> {
    let exif = exif::Reader::new().read_raw(block).ok()?;
    let number = |tag: Tag| match &exif.get_field(tag, In::PRIMARY)?.value {
        Value::Rational(v) => v.first().map(exif::Rational::to_f64),
        other => other.get_uint(0).map(f64::from),
    };
    let text = |tag: Tag| match &exif.get_field(tag, In::PRIMARY)?.value {
        Value::Ascii(parts) => {
            Some(String::from_utf8_lossy(parts.first()?).trim().to_owned()).filter(|t| !t.is_empty())
        }
        _ => None,
    };
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
