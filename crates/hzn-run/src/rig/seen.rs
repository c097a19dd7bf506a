//! What the joint answer knows of the picture of a head.

use hzn_core::Solution;
use hzn_core::status::Status;

use crate::engine::Finished;

/// The picture of a head in an epoch, as the joint answer needs it.
#[derive(Debug, Clone, Copy)]
pub struct Seen<'a> {
    pub(super) frame: Option<&'a Finished>,
    pub(super) repeats: Option<Repeat>,
    pub(super) level: Option<u16>,
}

/// Another picture with the same bytes. The noise of a camera never repeats, so it is not a picture of this head at
/// this time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Repeat {
    /// The picture of the epoch before.
    Before,
    /// The picture of another head.
    OtherHead,
}

impl<'a> Seen<'a> {
    /// Takes a processed picture; `None` if the head has none in this epoch. `repeats` says that it is another picture.
    pub fn new(frame: Option<&'a Finished>, repeats: Option<Repeat>) -> Self {
        Self { frame, repeats, level: None }
    }

    /// Sets the brightness from which on the pictures of this head are lit, in counts, as earlier pictures with a limb
    /// showed it. Without it, an eighth of full scale is taken.
    #[must_use]
    pub fn with_level(self, level: Option<u16>) -> Self {
        Self { level, ..self }
    }

    pub(super) fn solution(&self) -> Option<&'a Solution<f64>> {
        let report = self.frame?.outcomes.first()?.report.as_ref().ok()?;
        report.solution.as_ref().filter(|_| report.status == Status::Ok)
    }

    /// Returns whether the head looked for the limb in a picture of its own, and has no answer.
    pub(super) fn has_no_limb(&self) -> bool {
        let status = self.frame.and_then(|frame| Some(frame.outcomes.first()?.status()));
        self.repeats.is_none() && matches!(status, Some(Status::NoLimb | Status::Rejected | Status::TooFewPoints))
    }

    /// Returns why the head has no part in the joint answer; `None` if it has an answer.
    pub(super) fn absence(&self) -> Option<String> {
        let Some(frame) = self.frame else { return Some("no picture".into()) };
        match self.repeats {
            Some(Repeat::Before) => return Some("the picture of the epoch before".into()),
            Some(Repeat::OtherHead) => return Some("the picture of another head".into()),
            None => {}
        }
        match frame.outcomes.first() {
            Some(outcome) if self.solution().is_none() => Some(outcome.status().name().into()),
            Some(_) => None,
            None => Some(Status::NoLimb.name().into()),
        }
    }
}
