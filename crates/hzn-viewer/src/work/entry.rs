//! A picture of a source, as the window lists it.

use hzn_files::Frames;
use hzn_run::source::{self, Item, Payload, TimeSource};

use crate::model::{Entry, Place};

/// Returns a picture with its time and data, and where its time comes from.
pub(super) fn entry_of(mut item: Item, index: u64, frames: Option<&Frames>, fps: Option<f64>) -> (Entry, TimeSource) {
    let time = item.time_source(frames);
    let data = item.take_prior(frames);
    let Item { name, payload, .. } = item;
    let place = match payload {
        Payload::File(path) => Place::File(path),
        Payload::RawFile(path, raw) => Place::RawFile(path, raw),
        _ => Place::Video(index),
    };
    let exif = || match &place {
        Place::File(path) => source::exif_time_s(path),
        _ => None,
    };
    let time_s = match (time, fps) {
        // No time is invented for a folder without times.
        (TimeSource::Count, None) => None,
        (time, fps) => time.time_s(data.as_ref(), exif, index, fps.unwrap_or(1.0)),
    };
    (Entry { name, time_s, data, place }, time)
}
