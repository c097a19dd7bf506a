//! Reads the picture of any place: a file, a recording or a video.

use std::path::PathBuf;

use hzn_mcap::Pictures;
use hzn_run::Error;
use hzn_run::source::{self, Payload, Source};

use crate::model::Place;

/// Reader of pictures that are not decoded yet.
#[derive(Default)]
pub(super) struct Reader {
    /// Files and folders that were opened; a video is reopened from these.
    pub(super) inputs: Vec<PathBuf>,
    pub(super) recording: Option<Pictures>,
    video: Option<(Box<dyn Source>, u64)>,
}

impl Reader {
    pub(super) fn new(inputs: Vec<PathBuf>, recording: Option<Pictures>) -> Self {
        Self { inputs, recording, video: None }
    }

    /// Returns the payload of one picture, or [`Payload::Broken`] if only this picture cannot be read.
    ///
    /// # Errors
    /// The recording or the video can no longer be read.
    pub(super) fn payload(&mut self, place: &Place) -> Result<Payload, Error> {
        Ok(match place {
            Place::File(path) => Payload::File(path.clone()),
            Place::RawFile(path, raw) => Payload::RawFile(path.clone(), *raw),
            Place::Recorded(place) => match &mut self.recording {
                Some(pictures) => pictures
                    .read(place)
                    .map_err(Error::failed)?
                    .image
                    .map_or_else(Payload::Broken, Payload::from_recorded),
                None => Payload::Broken("the recording is not open".into()),
            },
            Place::Video(index) => self.read_video(*index)?,
            Place::Nowhere => Payload::Broken("the recording does not contain this picture".into()),
        })
    }

    /// Returns a picture of the video. A video is read forward only, so for an earlier picture it is reopened.
    fn read_video(&mut self, index: u64) -> Result<Payload, Error> {
        let (source, next) = match &mut self.video {
            Some(video) if video.1 <= index => video,
            video => video.insert((source::open(&self.inputs, None, None)?, 0)),
        };
        while let Some(item) = source.next().transpose()? {
            *next += 1;
            if *next > index {
                return Ok(item.payload);
            }
        }
        Ok(Payload::Broken("the video ends before this picture".into()))
    }
}
