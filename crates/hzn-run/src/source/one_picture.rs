//! The contents of one picture file in memory.

use std::io::Cursor;
use std::path::PathBuf;
use std::sync::Arc;

use image::metadata::Orientation;

use super::header;
use super::item::{Item, TimeSource};
use super::payload::Payload;
use super::sequence::Source;
use super::turn;
use crate::error::Error;

/// A sequence of one picture, whose file is in memory. It has the same answer as the file, alone in a folder.
#[derive(Debug, Clone)]
pub struct OnePicture {
    name: String,
    bytes: Arc<[u8]>,
    is_taken: bool,
}

impl OnePicture {
    /// Makes the sequence from the contents of a picture file and its name.
    pub fn new(name: impl Into<String>, bytes: impl Into<Arc<[u8]>>) -> Self {
        Self { name: name.into(), bytes: bytes.into(), is_taken: false }
    }

    fn contents(&self) -> Cursor<Arc<[u8]>> {
        Cursor::new(Arc::clone(&self.bytes))
    }

    fn payload(&self) -> Payload {
        Payload::Encoded(self.bytes.to_vec())
    }

    /// Returns the origin of the time: EXIF, if the camera wrote it.
    fn time(&self) -> TimeSource {
        let has_time = matches!(header::read_exif_time(self.contents()), Some(Ok(Some(_))));
        if has_time { TimeSource::Exif } else { TimeSource::Count }
    }
}

impl Source for OnePicture {
    fn next(&mut self) -> Option<Result<Item, Error>> {
        if std::mem::replace(&mut self.is_taken, true) {
            return None;
        }
        Some(Ok(Item { name: self.name.clone(), time: self.time(), stamp: None, data: None, payload: self.payload() }))
    }
    fn total(&self) -> Option<u64> {
        Some(1)
    }
    fn names(&self) -> Option<Box<dyn Iterator<Item = String> + '_>> {
        Some(Box::new(std::iter::once(self.name.clone())))
    }
    fn sizes(&self) -> Box<dyn Iterator<Item = (String, (u32, u32))> + '_> {
        let size = header::read_size_from(self.contents());
        Box::new(size.map(|size| (self.name.clone(), size)).into_iter())
    }
    fn folder(&self) -> PathBuf {
        PathBuf::new()
    }
    fn samples(&self) -> Box<dyn Iterator<Item = Payload> + '_> {
        Box::new(std::iter::once(self.payload()))
    }
    fn display_turn(&self) -> Option<(String, &'static str)> {
        let turn = header::read_orientation(self.contents()).filter(|turn| *turn != Orientation::NoTransforms)?;
        Some((self.name.clone(), turn::describe(turn)))
    }
}
