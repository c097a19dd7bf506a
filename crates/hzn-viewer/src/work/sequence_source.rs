//! The pictures of the window's sequence, as a [`Source`] for the engine of `hzn-run`.

use std::path::{Path, PathBuf};

use hzn_files::FrameData;
use hzn_mcap::{Index, Pictures};
use hzn_run::source::{Item, Source, TimeSource};

use super::reader::Reader;
use crate::model::{Entry, Sequence};

/// Iterator over the pictures of a sequence, from the first one.
pub(super) struct SequenceSource {
    entries: std::vec::IntoIter<Entry>,
    reader: Reader,
}

impl SequenceSource {
    pub(super) fn new(sequence: Sequence) -> Result<Self, String> {
        let Sequence { entries, inputs, recording, .. } = sequence;
        let pictures = recording.as_deref().map(open_pictures).transpose()?;
        Ok(Self { entries: entries.into_iter(), reader: Reader::new(inputs, pictures) })
    }
}

/// Opens a separate reader for the pictures of a recording.
pub(super) fn open_pictures(path: &Path) -> Result<Pictures, String> {
    let mut index = Index::open(path).map_err(|e| e.to_string())?;
    // The channels of the recording are declared before the first picture.
    while index.channels() == 0 && index.next_part().map_err(|e| e.to_string())?.is_some() {}
    index.pictures().map_err(|e| e.to_string())
}

impl Source for SequenceSource {
    fn next(&mut self) -> Option<Result<Item, hzn_run::Error>> {
        let Entry { name, time_s, data, place } = self.entries.next()?;
        // The window's data of the picture are complete, so nothing is looked up elsewhere.
        let data = FrameData { file: name.clone(), time_s, ..data.unwrap_or_default() };
        Some(self.reader.payload(&place).map(|payload| Item {
            name,
            time: TimeSource::Table,
            stamp: None,
            data: Some(data),
            payload,
        }))
    }
    fn total(&self) -> Option<u64> {
        Some(self.entries.len() as u64)
    }
    fn sizes(&self) -> Box<dyn Iterator<Item = (String, (u32, u32))> + '_> {
        Box::new(std::iter::empty())
    }
    fn folder(&self) -> PathBuf {
        PathBuf::new()
    }
}
