//! A picture on its way from the source to a thread, with the origin of its time.

use hzn_core::Config;
use hzn_files::{FrameData, Frames};
use hzn_mcap::Stamp;

use super::payload::Payload;
use super::picture::Picture;

/// One picture before it is decoded.
#[derive(Debug)]
pub struct Item {
    /// The name of the picture in results and in frames.csv.
    pub name: String,
    /// The origin of its time, unless [`Self::time_source`] returns another one.
    pub time: TimeSource,
    /// The time and the frame of the picture as a recording of another program states them.
    pub stamp: Option<Stamp>,
    /// The prior from the source itself, as a row of frames.csv. A recording of ours has one: the prior of its first
    /// run.
    pub data: Option<FrameData>,
    /// The picture.
    pub payload: Payload,
}

/// The origin of a picture's time. All pictures of a sequence use one clock, because times of two clocks can have
/// different zero points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TimeSource {
    /// frames.csv, or a recording of ours.
    Table,
    /// The container (video, MCAP): time in seconds, if it has one for this picture.
    Container(Option<f64>),
    /// The EXIF time that the camera wrote into the picture.
    Exif,
    /// The picture's number, divided by the number of frames a second.
    Count,
}

impl TimeSource {
    /// Returns the time in seconds, if it is known. `exif` returns the time that the camera wrote into the picture.
    pub fn time_s(
        self,
        data: Option<&FrameData>,
        exif: impl FnOnce() -> Option<f64>,
        index: u64,
        fps: f64,
    ) -> Option<f64> {
        match self {
            Self::Table => data.and_then(|d| d.time_s),
            Self::Container(time_s) => time_s,
            Self::Exif => exif(),
            Self::Count => Some(index as f64 / fps),
        }
    }
}

impl Item {
    /// Returns the picture as a sensor sees it; `None` if it cannot be read.
    pub fn decode(self, sensor: &Config) -> Option<Picture> {
        self.payload.decode(Some(sensor)).ok().map(|(picture, _)| picture)
    }
    /// Returns the prior of the picture. A frames.csv replaces the prior from the source.
    pub fn take_prior(&mut self, frames: Option<&Frames>) -> Option<FrameData> {
        match frames {
            Some(frames) => frames.get(&self.name).cloned(),
            None => self.data.take(),
        }
    }
    /// Returns the origin of the picture's time. A frames.csv with times, or the source's own data, replaces every
    /// other.
    pub fn time_source(&self, frames: Option<&Frames>) -> TimeSource {
        let timed = frames.map_or(self.data.is_some(), Frames::has_times);
        if timed { TimeSource::Table } else { self.time }
    }
}
