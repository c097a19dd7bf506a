//! The comparison of answers with the turn of the vehicle, for every body of a sequence, in the order of the pictures.
//!
//! It comes after the threads, where results are in order again: the rows are then the same for any number of threads.

use std::collections::VecDeque;

use hzn_core::frames::{Cam, UnitVec3};
use hzn_core::gates::FixedEdge;
use hzn_core::status::Status;
use hzn_core::{Config, Prior, Sequence, Step};
use hzn_files::FrameData;
use hzn_mcap::Row;

use super::outcome::{BodyOutcome, Finished};

/// Number of pictures whose bytes are compared with those of the next one: more than a camera or a recorder has
/// buffers.
pub const REMEMBERED: usize = 32;

/// The answers of earlier pictures, one for each body, with the turn of the vehicle since then.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Turns {
    each: Vec<Sequence<f64>>,
    time_s: Option<f64>,
    /// The checksums of the last pictures, with their times, the newest last.
    checksums: VecDeque<(u32, Option<f64>)>,
}

/// An answer in the results of an earlier run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StoredAnswer {
    axis: [f64; 3],
    noise_rad: f64,
}

impl StoredAnswer {
    /// Returns the answer of a row; `None` if the row has none.
    pub fn from_row(row: &Row) -> Option<Self> {
        Some(Self { axis: row.axis()?, noise_rad: row.noise_rad()? })
    }

    fn to_answer(self) -> Option<(UnitVec3<Cam, f64>, f64)> {
        Some((UnitVec3::try_new(self.axis)?, self.noise_rad))
    }
}

impl Turns {
    /// Judges the answers of the next picture, see `gates.fixed_edge`.
    pub fn judge(&mut self, frame: &mut Finished, config: &Config) {
        let repeats = self.see_bytes(frame);
        let Some(steps) = self.take_steps(frame.data.as_ref(), frame.time_s, config) else { return };
        for ((sequence, step), outcome) in self.each.iter_mut().zip(steps).zip(&mut frame.outcomes) {
            match outcome {
                BodyOutcome { report: Ok(report), .. } => {
                    sequence.judge(&step, report, &config.gates);
                    if repeats {
                        sequence.judge_repeat(report, &config.gates);
                    }
                }
                BodyOutcome { report: Err(_), .. } => {
                    sequence.see(&step, None, &config.gates);
                }
            }
        }
    }

    /// Compares the bytes of the next picture with those of the last [`REMEMBERED`] ones. Returns whether they are the
    /// same as one of these although a time is told, which is another one: the camera or its recorder stands still, or
    /// gives old buffers again. The noise of a camera never repeats.
    fn see_bytes(&mut self, frame: &mut Finished) -> bool {
        // A dark or clipped picture has no noise. It has no answer either, and keeps its own reason.
        let is_answered = frame.outcomes.iter().any(|outcome| outcome.status() == Status::Ok);
        let Some(bytes) = &mut frame.bytes else { return false };
        let is_same = |(checksum, time_s): &(u32, Option<f64>)| *checksum == bytes.checksum && *time_s != frame.time_s;
        bytes.repeats = is_answered && self.checksums.iter().any(is_same);
        let repeats = bytes.repeats && bytes.has_time;
        self.remember(bytes.checksum, frame.time_s);
        repeats
    }

    /// Takes the bytes of the picture that was replayed last, which an earlier run has processed.
    pub fn see_checksum(&mut self, checksum: Option<u32>) {
        if let Some(checksum) = checksum {
            self.remember(checksum, self.time_s);
        }
    }

    fn remember(&mut self, checksum: u32, time_s: Option<f64>) {
        if self.checksums.len() == REMEMBERED {
            self.checksums.pop_front();
        }
        self.checksums.push_back((checksum, time_s));
    }

    /// Takes the next picture from the results of an earlier run. An answer that this run refused is not in them, and
    /// it would not change what follows.
    pub fn replay(
        &mut self,
        data: Option<&FrameData>,
        time_s: Option<f64>,
        answers: &[Option<StoredAnswer>],
        config: &Config,
    ) {
        let Some(steps) = self.take_steps(data, time_s, config) else { return };
        for ((sequence, step), answer) in self.each.iter_mut().zip(steps).zip(answers) {
            sequence.see(&step, answer.and_then(StoredAnswer::to_answer), &config.gates);
        }
    }

    /// Returns the step to the next picture for each body; `None` if nothing is compared.
    fn take_steps(&mut self, data: Option<&FrameData>, time_s: Option<f64>, config: &Config) -> Option<Vec<Step<f64>>> {
        if config.gates.fixed_edge == FixedEdge::Off {
            return None;
        }
        let bodies = config.each_body();
        self.each.resize(bodies.len(), Sequence::default());
        let after_s = time_s.zip(self.time_s).map(|(now, before)| now - before);
        self.time_s = time_s;
        let step = |(which, body)| {
            let prior: Prior<f64> =
                data.and_then(|d| d.for_body(which, body).ok()).map(|d| d.to_prior(None)).unwrap_or_default();
            Step::from_prior(&prior, after_s)
        };
        Some(bodies.iter().enumerate().map(step).collect())
    }
}
