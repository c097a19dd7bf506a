//! The outcome of a picture: a report for each body, or the reason why there is none.

use std::sync::Arc;
use std::time::Duration;

use hzn_core::body::PriorError;
use hzn_core::camera::Camera;
use hzn_core::rig::Glimpse;
use hzn_core::status::Status;
use hzn_core::{Report, Solution};
use hzn_files::FrameData;
use hzn_mcap::Stamp;

use super::sensor::Processed;
use super::tiles::Tiles;
use super::trace::Traces;
use crate::mask::MaskOutcome;
use crate::source::{Picture, TimeSource};

/// A processed picture.
#[derive(Debug)]
pub struct Finished {
    /// Place in the sequence, from 0.
    pub index: u64,
    /// Name of the picture.
    pub name: String,
    /// Time in seconds, if it is known.
    pub time_s: Option<f64>,
    /// The time and the frame of the picture as a recording states them; [`Self::time_s`] can be of another clock.
    pub stamp: Option<Stamp>,
    /// The prior of this picture from frames.csv or from a recording of ours.
    pub data: Option<FrameData>,
    /// The outcome of each body, in the order of the configuration.
    pub outcomes: Vec<BodyOutcome>,
    /// Whether the answers are those of the sensor of a flight computer, in single precision.
    pub is_flight: bool,
    /// The drawing over the picture, if the plan asks for it.
    pub drawing: hzn_mcap::Annotations,
    /// The picture as PNG or JPEG, if the plan asks for it.
    pub picture: Option<Vec<u8>>,
    /// The brightness at places all over the picture, if it could be read.
    pub glimpse: Option<Glimpse>,
    /// What the pipeline showed of its work, one record for each body, if the plan asks for it.
    pub traces: Option<Traces>,
    /// Advice, if nothing was found and the picture itself suggests a reason.
    pub tip: Option<String>,
    /// Number of pictures in the file; only the first was processed.
    pub pages: u32,
    /// What became of the mask, if the plan asks for masks.
    pub mask: Option<MaskOutcome>,
    /// What tells the picture from another one in its place: of its file before it was read, or of its bytes.
    pub identity: Option<u64>,
    /// The bytes of the picture, if it could be read and is compared with those before.
    pub bytes: Option<Bytes>,
    /// Correlation of the brightness of the first body with the height of the told Sun over its surface, from -1 to 1,
    /// where that Sun lights it; `None` unless there is an answer, and day and night are in view.
    pub brightness_by_sun: Option<f64>,
}

/// What the bytes of a picture say about the pictures before, with the same bytes or not.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bytes {
    /// The checksums of the samples.
    pub sums: Sums,
    /// The tiles on the limb of each body.
    pub(super) limbs: Vec<Vec<usize>>,
    /// Whether the time of the picture is told. A time that only counts the pictures does not say that a picture with
    /// the same bytes is another one.
    pub has_time: bool,
    /// What of the picture one of the last pictures has, too, at another time; known when the picture is judged.
    pub repeats: Repeats,
}

/// The checksums of a picture: of all samples, and of small parts of the picture.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sums {
    /// The checksum of the samples.
    pub checksum: u32,
    /// The checksums of its tiles; `None` for a frame of a video.
    pub(super) tiles: Option<Arc<Tiles>>,
}

/// What is the same in an earlier picture, to the last bit.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Repeats {
    /// Nothing.
    #[default]
    Nothing,
    /// The picture along the limb. Elsewhere, some of it is new.
    Limb,
    /// The whole picture.
    All,
}

impl Sums {
    /// Returns the checksums of a decoded picture.
    pub fn of(picture: &Picture) -> Self {
        Self { checksum: picture.checksum(), tiles: Tiles::of_picture(picture).map(Arc::new) }
    }
}

impl Bytes {
    /// Returns what is known of a picture whose time has this origin.
    pub(super) fn of(picture: &Picture, time: TimeSource) -> Self {
        let has_time = !matches!(time, TimeSource::Count);
        Self { sums: Sums::of(picture), limbs: Vec::new(), has_time, repeats: Repeats::Nothing }
    }

    /// Takes the limbs that were found in the picture.
    pub(super) fn see_limbs(&mut self, outcomes: &[BodyOutcome], camera: &Camera<f64>) {
        let on_limb = |outcome: &BodyOutcome| {
            let limb = outcome.report.as_ref().ok()?.solution.as_ref()?;
            Some(self.sums.tiles.as_ref()?.on_limb(limb, camera))
        };
        self.limbs = outcomes.iter().map(|outcome| on_limb(outcome).unwrap_or_default()).collect();
    }
}

/// The outcome of one body in one picture.
#[derive(Debug)]
pub struct BodyOutcome {
    /// The report, or the reason why the picture was not processed.
    pub report: Result<Report<f64>, Unprocessed>,
    /// Time of processing, without decoding.
    pub elapsed: Duration,
}

impl BodyOutcome {
    /// Returns the status.
    pub fn status(&self) -> Status {
        self.report.as_ref().map_or_else(|e| e.status, |r| r.status)
    }

    /// Returns why the values of frames.csv did not allow to search for the body, if this is so.
    pub fn refused_prior(&self) -> Option<&PriorError> {
        self.report.as_ref().err()?.prior.as_ref()
    }
}

impl From<Processed> for BodyOutcome {
    fn from(p: Processed) -> Self {
        Self { report: p.report.map_err(Into::into), elapsed: p.elapsed }
    }
}

/// The reason why a picture was not processed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unprocessed {
    /// [`Status::Unreadable`] or [`Status::NoAltitude`].
    pub status: Status,
    /// The reason in words.
    pub why: String,
    /// The error of the prior, if that is the reason.
    pub prior: Option<PriorError>,
}

impl From<PriorError> for Unprocessed {
    fn from(error: PriorError) -> Self {
        let status = match error {
            PriorError::Altitude
            | PriorError::Position
            | PriorError::AttitudeSigma
            | PriorError::Rate
            | PriorError::Temperature
            | PriorError::NoBody
            | PriorError::NotConfigured => Status::Unreadable,
            // Nothing can be expected of the body: no distance is known, or what is known contradicts itself.
            _ => Status::NoAltitude,
        };
        Self { status, why: error.to_string(), prior: Some(error) }
    }
}

impl Finished {
    /// Returns the answer of each body.
    pub fn answers(&self) -> Vec<Option<&Solution<f64>>> {
        self.outcomes.iter().map(|found| found.report.as_ref().ok()?.solution.as_ref()).collect()
    }
    /// Returns the reason why the picture could not be read, if it could not.
    pub fn unreadable(&self) -> Option<&str> {
        let errors = self.outcomes.iter().filter_map(|f| f.report.as_ref().err());
        errors.filter(|e| e.status == Status::Unreadable).map(|e| e.why.as_str()).next()
    }
    /// Returns the result of a picture that could not be read. It is unreadable for every body.
    pub(super) fn into_unreadable(self, bodies: usize, why: &str) -> Self {
        let why = Unprocessed { status: Status::Unreadable, why: why.to_owned(), prior: None };
        let none = || BodyOutcome { report: Err(why.clone()), elapsed: Duration::ZERO };
        Self { outcomes: (0..bodies).map(|_| none()).collect(), ..self }
    }
}
