//! The one way to a frame's picture, as it stands in its file, recording or video.

use std::path::PathBuf;

use hzn_mcap::Pictures;
use hzn_run::source::{self, Payload, Source};

use crate::model::Place;

/// Reads what is not decoded yet.
#[derive(Default)]
pub(super) struct Reader {
    /// What was opened: a video is begun again from there.
    pub(super) inputs: Vec<PathBuf>,
    pub(super) recording: Option<Pictures>,
    video: Option<(Box<dyn Source>, u64)>,
}

impl Reader {
    pub(super) fn new(inputs: Vec<PathBuf>, recording: Option<Pictures>) -> Self {
        Self { inputs, recording, video: None }
    }

    /// What there is for one frame; [`Payload::Broken`] where only this one cannot be had.
    ///
    /// # Errors
    /// The recording or the video cannot be read any more.
    pub(super) fn payload(&mut self, place: &Place) -> anyhow::Result<Payload> {
        Ok(match place {
            Place::File(path) => Payload::File(path.clone()),
            Place::RawFile(path, raw) => Payload::RawFile(path.clone(), *raw),
            Place::Recorded(place) => match &mut self.recording {
                Some(pictures) => pictures.read(place)?.image.map_or_else(Payload::Broken, source::recorded),
                None => Payload::Broken("the recording is not open".into()),
            },
            Place::Video(index) => self.of_video(*index)?,
            Place::Nowhere => Payload::Broken("the recording holds no picture of this frame".into()),
        })
    }

    /// A video goes forward only; for a picture before, it is begun again.
    fn of_video(&mut self, index: u64) -> anyhow::Result<Payload> {
        let (source, next) = match &mut self.video {
            Some(video) if video.1 <= index => video,
            video => video.insert((source::open(&self.inputs, None, None).map_err(hzn_run::Error::into_cause)?, 0)),
        };
        while let Some(item) = source.next().transpose()? {
            *next += 1;
            if *next > index {
                return Ok(item.payload);
            }
        }
        Ok(Payload::Broken("the video ends before this frame".into()))
    }
}
