//! The frames as the window has them, as an input of `hzn-cli`.

use std::path::{Path, PathBuf};

use hzn_cli::input::{Item, Payload, Source};
use hzn_mcap::{Index, Pictures};

use crate::model::{Entry, Place, Sequence};

/// Goes through a sequence from its first frame on.
pub(super) struct Walk {
    entries: std::vec::IntoIter<Entry>,
    inputs: Vec<PathBuf>,
    pictures: Option<Pictures>,
    video: Option<Box<dyn Source>>,
}

impl Walk {
    pub(super) fn new(sequence: Sequence) -> Result<Self, String> {
        let Sequence { entries, inputs, recording, .. } = sequence;
        let pictures = recording.as_deref().map(pictures).transpose()?;
        Ok(Self { entries: entries.into_iter(), inputs, pictures, video: None })
    }
    fn payload(&mut self, place: &Place) -> anyhow::Result<Payload> {
        Ok(match place {
            Place::File(path) => Payload::File(path.clone()),
            Place::RawFile(path, raw) => Payload::RawFile(path.clone(), *raw),
            Place::Nowhere => Payload::Broken("the recording holds no picture of this frame".into()),
            Place::Recorded(place) => match &mut self.pictures {
                Some(pictures) => match pictures.read(place)?.image {
                    Ok(image) => hzn_cli::input::recorded(image),
                    Err(why) => Payload::Broken(why),
                },
                None => Payload::Broken("the recording is not open".into()),
            },
            Place::Video(_) => {
                if self.video.is_none() {
                    let opened = hzn_cli::input::open(&self.inputs, None, None);
                    self.video = Some(opened.map_err(|stop| stop.error)?);
                }
                match self.video.as_mut().and_then(|v| v.next()).transpose()? {
                    Some(item) => item.payload,
                    None => Payload::Broken("the video ends before this frame".into()),
                }
            }
        })
    }
}

/// A reader of one's own for the pictures of a recording.
fn pictures(path: &Path) -> Result<Pictures, String> {
    let mut index = Index::open(path).map_err(|e| e.to_string())?;
    // Its channels are declared before the first picture.
    while index.channels() == 0 && index.next_part().map_err(|e| e.to_string())?.is_some() {}
    index.pictures().map_err(|e| e.to_string())
}

impl Source for Walk {
    fn next(&mut self) -> Option<anyhow::Result<Item>> {
        let Entry { name, time_s, place, .. } = self.entries.next()?;
        Some(self.payload(&place).map(|payload| Item { name, time_s: Some(time_s), payload }))
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
