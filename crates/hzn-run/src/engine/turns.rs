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

use super::outcome::{BodyOutcome, Finished, Repeats, Sums};

/// Number of pictures whose bytes are compared with those of the next one: more than a camera or a recorder has
/// buffers.
pub const REMEMBERED: usize = 32;

/// The answers of earlier pictures, one for each body, with the turn of the vehicle since then.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Turns {
    each: Vec<Sequence<f64>>,
    time_s: Option<f64>,
    /// The checksums of the last pictures, with their times, the newest last.
    earlier: VecDeque<(Sums, Option<f64>)>,
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
        let each = self.each.iter_mut().zip(steps).zip(&mut frame.outcomes);
        for (which, ((sequence, step), outcome)) in each.enumerate() {
            match outcome {
                BodyOutcome { report: Ok(report), .. } => {
                    sequence.judge(&step, report, &config.gates);
                    if repeats.get(which).is_some_and(|repeats| *repeats != Repeats::Nothing) {
                        sequence.judge_repeat(report, &config.gates);
                    }
                }
                BodyOutcome { report: Err(_), .. } => {
                    sequence.see(&step, None, &config.gates);
                }
            }
        }
    }

    /// Compares the bytes of the next picture with those of the last [`REMEMBERED`] ones. Returns for each body whether
    /// they are the same as in one of these, at least along its limb, although a time is told, which is another one:
    /// the camera or its recorder stands still, or gives old buffers again. The noise of a camera never repeats.
    fn see_bytes(&mut self, frame: &mut Finished) -> Vec<Repeats> {
        // A dark or clipped picture has no noise. It has no answer either, and keeps its own reason.
        let is_answered = frame.outcomes.iter().any(|outcome| outcome.status() == Status::Ok);
        let Some(bytes) = &mut frame.bytes else { return Vec::new() };
        let at_other_times = || self.earlier.iter().filter(|(_, time_s)| *time_s != frame.time_s);
        let of_limb = |limb: &Vec<usize>| {
            if at_other_times().any(|(earlier, _)| earlier.checksum == bytes.sums.checksum) {
                return Repeats::All;
            }
            let Some(now) = &bytes.sums.tiles else { return Repeats::Nothing };
            let mut earlier = at_other_times().filter_map(|(earlier, _)| earlier.tiles.as_ref());
            if earlier.any(|earlier| now.repeat(limb, earlier)) { Repeats::Limb } else { Repeats::Nothing }
        };
        let repeats: Vec<Repeats> = if is_answered { bytes.limbs.iter().map(of_limb).collect() } else { Vec::new() };
        bytes.repeats = repeats.iter().copied().max().unwrap_or_default();
        let sums = bytes.sums.clone();
        let has_time = bytes.has_time;
        self.remember(sums, frame.time_s);
        if has_time { repeats } else { Vec::new() }
    }

    /// Takes the bytes of the picture that was replayed last, which an earlier run has processed.
    pub fn see_sums(&mut self, sums: Option<Sums>) {
        if let Some(sums) = sums {
            self.remember(sums, self.time_s);
        }
    }

    fn remember(&mut self, sums: Sums, time_s: Option<f64>) {
        if self.earlier.len() == REMEMBERED {
            self.earlier.pop_front();
        }
        self.earlier.push_back((sums, time_s));
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
