//! Takes the edges of one picture from border to verdict, one after the other, and decides which of them is the limb.

mod edge;
mod join;
mod order;

use super::look::Look;
use super::sensor::Sensor;
use super::workspace::Lists;
use crate::base::real::Real;
use crate::geometry::block::Block;
use crate::geometry::camera::Camera;
use crate::geometry::pixel::Pixel;
use crate::image::Pixels;
use crate::model::body::Expected;
use crate::model::found_limb::FoundLimb;
use crate::model::observer::Observer;
use crate::model::report::{Candidate, Report, Solution};
use crate::model::status::Status;
use crate::model::verdict::Verdict;
use crate::model::work::WorkBudget;
use crate::stages::contour::{BinaryPicture, Thinned};
use crate::stages::{covariance, gates, threshold};

/// Answers farther apart than this contradict each other, in degrees.
const AMBIGUOUS_DEG: f64 = 5.0;
/// Of answers that contradict each other, the better one counts where its score is better by this factor. Two Suns, or
/// two Moons, always contradict each other: the reflection of a Sun in the lens is often rounder than the Sun.
const AMBIGUOUS_SCORE: f64 = 2.0;

/// The search over the edges of one picture, which are judged one by one.
pub(super) struct Search<'a, T, O> {
    sensor: &'a Sensor<T>,
    /// Camera of the sensor, or [`Sensor::camera_for`] the picture.
    camera: &'a Camera<T>,
    expected: &'a Expected<T>,
    taken: &'a [FoundLimb<T>],
    noise: &'a covariance::Config,
    /// Whether the answer needs a threshold for the next picture (method `track`).
    needs_next_threshold: bool,
    /// Length of the shortest candidate, border pixels.
    min_points: u16,
    observer: &'a O,
    blocks: &'a mut [Block<T>],
    /// See [`Self::take_lists`].
    border: &'a mut [Pixel],
    marks: &'a mut [u32],
    /// The rest of the work budget.
    work: WorkBudget,
    best: Option<Best<T>>,
    /// The best score of an answer that points in another direction.
    rival: Option<T>,
    /// Number of edges with too few points.
    short: u32,
    /// Length of the longest edge so far, border pixels, with [`gates::Choice::Longest`].
    longest: u32,
    /// Whether any edge was fitted, whatever its verdict.
    fitted: bool,
    report: &'a mut Report<T>,
}

struct Best<T> {
    solution: Solution<T>,
    outcome: Candidate<T>,
    /// Threshold for the next picture.
    level: Option<u16>,
    /// The smallest score wins.
    score: T,
    /// Whether light reaches higher above the limb than air does.
    glows: bool,
    /// Whether the search can end: the answer explains most of the limb in view, and either most points of its edge are
    /// inliers or the residuals are small.
    certain: bool,
}

impl<'a, T: Real, O: Observer<T>> Search<'a, T, O> {
    /// Begins a search. `camera` is the camera of the sensor or [`Sensor::camera_for`], and `work` is the work budget
    /// of the look.
    // Inlined and returned alone: the search is then made where it stays.
    #[inline(always)]
    pub(super) fn new<P>(
        sensor: &'a Sensor<T>,
        camera: &'a Camera<T>,
        look: Look<'a, T, P, O>,
        work: WorkBudget,
    ) -> Self {
        let Look { lists: Lists { border, blocks, marks }, expected, taken, observer, report, .. } = look;
        let config = &sensor.config;
        Self {
            expected,
            taken,
            noise: config.noise_model_of(expected.which),
            needs_next_threshold: config.threshold_of(expected.which).method == threshold::Method::Track,
            min_points: config
                .edge_points
                .min_points
                .min(gates::small_disc_points(expected.sin, &sensor.camera, 2))
                .min(gates::small_picture_points(&sensor.camera, 2)),
            observer,
            work,
            blocks,
            best: None,
            rival: None,
            short: 0,
            longest: 0,
            fitted: false,
            report,
            camera,
            sensor,
            border,
            marks,
        }
    }

    /// Takes the lists for the border and the marks of the edges out of the search.
    pub(super) fn take_lists(&mut self) -> (&'a mut [Pixel], &'a mut [u32]) {
        (core::mem::take(&mut self.border), core::mem::take(&mut self.marks))
    }

    /// Returns the rule that chooses among the edges.
    fn choice(&self) -> gates::Choice {
        // A build without these features has one rule, so that the code for the others is left out.
        let has_others = cfg!(any(feature = "dlr", feature = "horace"));
        if has_others { self.sensor.config.gates.choice } else { gates::Choice::Score }
    }

    /// Returns whether every edge is examined, even if one of them is certain. The reflection of a Sun in the lens may
    /// look as good as the Sun.
    fn examines_all(&self) -> bool {
        self.expected.free || self.choice() != gates::Choice::Score
    }

    /// Returns whether the search is over: the limb is found, or the work budget is used up.
    fn is_over(&self) -> bool {
        self.work.is_exhausted() || self.best.as_ref().is_some_and(|b| b.certain)
    }

    /// Judges the edge of a predicted limb. Returns whether its answer is certain; an answer that is not says nothing,
    /// because other edges of the picture were not examined.
    pub(super) fn judge_tracked<P: Pixels>(&mut self, binary: &BinaryPicture<'_, T, P, O>, edge: &Thinned<'_>) -> bool {
        self.judge_edge(binary, edge);
        self.best.as_ref().is_some_and(|best| best.certain && !best.glows)
    }

    /// Spends work that is done already.
    pub(super) fn charge(&mut self, cost: u32) {
        self.work.charge(cost);
    }

    /// Keeps the better of two answers. If they point in different directions, the score of the other is kept as the
    /// rival's.
    fn keep_better(&mut self, new: Best<T>) {
        let Some(old) = &mut self.best else {
            self.best = Some(new);
            return;
        };
        // Two edges of one Sun or Moon are closer together than its half-angle.
        let limit = if self.expected.free {
            new.solution.half_angle_rad.max(old.solution.half_angle_rad)
        } else {
            T::from_f64(AMBIGUOUS_DEG.to_radians())
        };
        let apart = new.solution.axis.angle_rad(&old.solution.axis) > limit;
        let rival = if new.score < old.score { core::mem::replace(old, new).score } else { new.score };
        if apart {
            self.rival = Some(self.rival.map_or(rival, |r| r.min(rival)));
        }
    }

    /// Writes the answer into the report. Returns the rest of the work budget.
    // The search is not moved, and the answer is copied once.
    pub(super) fn conclude(&mut self) -> WorkBudget {
        let can_be_ambiguous = self.choice() == gates::Choice::Score;
        let (report, work) = (&mut *self.report, self.work);
        report.counters.work = work.spent();
        report.counters.looks += 1;
        if let Some(best) = &self.best {
            let factor = T::from_f64(AMBIGUOUS_SCORE);
            let is_close = |rival: T| rival < best.score * factor || self.expected.free;
            if can_be_ambiguous && !best.certain && self.rival.is_some_and(is_close) {
                report.status = Status::Ambiguous;
                return work;
            }
            if best.glows {
                report.choose(best.outcome, Verdict::Glow);
                report.status = Status::Rejected;
                return work;
            }
            report.choose(best.outcome, Verdict::Chosen);
            report.status = Status::Ok;
            report.next_level = best.level;
            report.solution = Some(best.solution);
            return work;
        }
        report.status = if work.was_truncated() {
            Status::Truncated
        } else if self.fitted {
            Status::Rejected
        } else if report.counters.candidates == 0 && self.short > 0 {
            Status::TooFewPoints
        } else {
            Status::NoLimb
        };
        work
    }
}
