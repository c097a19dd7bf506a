//! The time of exposure that a camera wrote into the picture.

use exif::{In, Tag, Value};

/// `DateTimeOriginal` with its fraction, in seconds since 1970. EXIF rarely has a time zone: UTC is assumed.
pub(super) fn time_s(block: Vec<u8>) -> Option<f64> {
    let exif = exif::Reader::new().read_raw(block).ok()?;
    let text = |tag: Tag| match &exif.get_field(tag, In::PRIMARY)?.value {
        Value::Ascii(parts) => Some(String::from_utf8_lossy(parts.first()?).trim().to_owned()),
        _ => None,
    };
    let stamp = text(Tag::DateTimeOriginal)?;
    let (date, clock) = stamp.split_once(' ')?;
    let whole = hzn_calib::time::unix_seconds(&format!("{}T{clock}", date.replace(':', "-")))?;
    let fraction = text(Tag::SubSecTimeOriginal).and_then(|t| format!("0.{t}").parse::<f64>().ok()).unwrap_or(0.0);
    Some(whole + fraction)
}
