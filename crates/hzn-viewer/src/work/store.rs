//! Cache of decoded pictures, within a fixed amount of memory.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::Arc;

use hzn_mcap::Pictures;
use hzn_run::source::{Picture, picture::Samples};

use super::reader::Reader;
use crate::model::Place;

/// Limit for the decoded pictures in memory, in bytes. A larger picture is kept alone.
const KEEP_BYTES: usize = 192 << 20;

/// A decoded picture, or the reason why there is none.
pub type Decoded = Result<Arc<Picture>, String>;

/// Cache that reads pictures and keeps those that were used last.
#[derive(Default)]
pub struct Store {
    reader: Reader,
    /// Index, picture and size in bytes; the most recently used picture is last.
    kept: VecDeque<(usize, Decoded, usize)>,
}

impl Store {
    /// Starts another sequence and drops all pictures.
    pub fn open(&mut self, inputs: Vec<PathBuf>) {
        *self = Self { reader: Reader::new(inputs, None), ..Self::default() };
    }
    /// Drops all pictures.
    pub fn forget(&mut self) {
        self.kept.clear();
    }
    /// Sets the reader for the pictures of the recording.
    pub fn set_recording(&mut self, pictures: Pictures) {
        self.reader.recording = Some(pictures);
    }
    /// Returns true if the picture with this index is in the cache.
    pub fn has(&self, index: usize) -> bool {
        self.kept.iter().any(|(i, ..)| *i == index)
    }
    /// Returns the memory of the kept pictures, in bytes.
    pub fn bytes(&self) -> usize {
        self.kept.iter().map(|(_, _, bytes)| bytes).sum()
    }

    /// Returns a picture; decodes it if it is not in the cache.
    pub fn get(&mut self, index: usize, place: &Place) -> Decoded {
        if let Some(at) = self.kept.iter().position(|(i, ..)| *i == index)
            && let Some(kept) = self.kept.remove(at)
        {
            let decoded = kept.1.clone();
            self.kept.push_back(kept);
            return decoded;
        }
        let payload = self.reader.payload(place).map_err(|e| format!("{e:#}"));
        let decoded = payload.and_then(|p| p.decode(None)).map(|(picture, _)| Arc::new(picture));
        let bytes = decoded.as_ref().map_or(0, |p| size_of_picture(p));
        while !self.kept.is_empty() && self.bytes() + bytes > KEEP_BYTES {
            self.kept.pop_front();
        }
        self.kept.push_back((index, decoded.clone(), bytes));
        decoded
    }
}

fn size_of_picture(picture: &Picture) -> usize {
    match &picture.samples {
        Samples::Bytes(b) => b.len(),
        Samples::Words(w) => 2 * w.len(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_bounded_and_what_was_used_last_stays() {
        let dir = tempfile::tempdir().unwrap();
        let place = |i: u8| {
            let path = dir.path().join(format!("{i}.png"));
            image::GrayImage::from_pixel(4096, 4096, image::Luma([i])).save(&path).unwrap();
            Place::File(path)
        };
        let places: Vec<Place> = (0..14).map(place).collect();
        let mut store = Store::default();
        store.open(vec![dir.path().to_owned()]);
        for (i, place) in places.iter().enumerate() {
            let Samples::Bytes(b) = &store.get(i, place).unwrap().samples else { panic!() };
            assert_eq!(b[0], i as u8);
            store.get(0, &places[0]).unwrap();
            assert!(store.bytes() <= KEEP_BYTES);
        }
        assert!(store.has(0) && store.has(13) && !store.has(1));
    }

    #[test]
    fn a_picture_that_cannot_be_read_says_why_once() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.png");
        std::fs::write(&path, b"nothing").unwrap();
        let mut store = Store::default();
        let place = Place::File(path.clone());
        let why = store.get(0, &place).unwrap_err();
        assert!(why.contains("not a picture"), "{why}");
        assert!(store.has(0));
        assert_eq!(store.get(1, &Place::File(dir.path().join("b.png"))).unwrap_err(), "no such file");
        assert!(store.get(2, &Place::Nowhere).is_err());
    }
}
