//! Crops of a picture: a smaller copy of it, and halves of halves when the whole picture gives no answer (Barf et al.
//! 2015, 4.2.1; Barf 2014, 2.2.6).
//!
//! A part is examined as a picture with its own camera, whose principal point is moved and whose focal length is
//! scaled. The observer gets everything in the coordinates of the whole picture. Equation (2.39) ends the division only
//! when a part is too small *and* too bright and too dark at once; here it ends when a part is too small, or too
//! bright, or too dark.

use super::budget;
use super::look::Look;
use super::sensor::Sensor;
use crate::base::linalg::{V3, basis, unit};
use crate::base::real::Real;
use crate::base::sort;
use crate::config::retry::{Combine, Method};
use crate::geometry::crop::Crop;
use crate::geometry::frames::{Cam, Cov3, UnitVec3};
use crate::geometry::pixel::ImagePoint;
use crate::image::{Cropped, Indirect, Pixels};
use crate::model::body::Expected;
use crate::model::error_budget::ErrorBudget;
use crate::model::evidence::Evidence;
use crate::model::observer::{Border, Observer};
use crate::model::report::{Candidate, Report, Solution};
use crate::model::status::{Stage, Status};
use crate::model::verdict::Verdict;
use crate::model::work;

/// Largest number of parts that can have an answer.
const ANSWERS: usize = 64;
/// Largest number of parts that wait at the same time: one for each halving.
const WAITING: usize = 16;

type Answers<T> = heapless::Vec<Solution<T>, ANSWERS>;

impl<T: Real> Sensor<T> {
    /// Examines the whole picture, scaled if the configuration asks for it, and its parts if it has no answer.
    pub(super) fn look_at_parts<P: Pixels, O: Observer<T>>(&self, mut look: Look<'_, T, P, O>) {
        let whole = Crop::whole([look.picture.width(), look.picture.height()], self.config.input.scale_to_height);
        if whole.is_all() {
            self.look(look.reborrow());
        } else {
            self.look_at_crop(look.reborrow(), whole, None);
        }
        let ended = matches!(look.report.status, Status::Ok | Status::TooDark | Status::TooBright);
        if self.config.retry.method == Method::Division && !ended && !look.report.glows() {
            self.divide(look, whole);
        }
    }

    /// Looks at smaller and smaller parts of the picture, and combines the answers of the parts.
    fn divide<P: Pixels, O: Observer<T>>(&self, mut look: Look<'_, T, P, O>, whole: Crop) {
        let (status, level) = (look.report.status, look.report.level);
        // The work budget that the whole picture has left.
        let mut work = budget::new(&self.config, look.lists.border.len());
        work.charge(look.report.counters.work);
        let mut cut = false;
        let least = f64::from(whole.area()) * self.config.retry.least_part;
        let mut answers = Answers::<T>::new();
        let mut chosen = heapless::Vec::<Candidate<T>, ANSWERS>::new();
        let mut waiting = heapless::Vec::<Crop, WAITING>::new();
        // One half is examined at a time, so at most one part for each halving waits.
        let _ = waiting.extend_from_slice(whole.halves().as_ref().map_or(&[][..], |h| h));
        while let Some(part) = waiting.pop() {
            if !work.try_spend(work::PART) {
                break;
            }
            look.report.counters.work = 0;
            self.look_at_crop(look.reborrow(), part, Some(work.remaining()));
            let report = &mut *look.report;
            work.charge(report.counters.work);
            cut |= report.status == Status::Truncated;
            if let Some(answer) = report.solution.take() {
                // The list has room: there are at most `ANSWERS` parts of the smallest size.
                let _ = answers.push(answer);
                if let Some(edge) = report.candidates.iter_mut().find(|c| c.verdict == Verdict::Chosen) {
                    edge.verdict = Verdict::Passed;
                    let _ = chosen.push(*edge);
                }
                continue;
            }
            let ended = matches!(report.status, Status::TooDark | Status::TooBright);
            if !ended && f64::from(part.area()) >= 2.0 * least {
                let _ = waiting.extend_from_slice(part.halves().as_ref().map_or(&[][..], |h| h));
            }
        }
        let report = look.report;
        (report.status, report.level, report.counters.work) = (status, level, work.spent());
        if cut || work.was_truncated() {
            report.status = Status::Truncated;
        }
        self.conclude_parts(&mut answers, &chosen, report);
    }

    /// Writes the answer of the parts into the report, if there is one.
    fn conclude_parts(&self, answers: &mut Answers<T>, chosen: &[Candidate<T>], report: &mut Report<T>) {
        if let Some(mut answer) = combine_answers(answers, self.config.retry.combine) {
            answer.axis_vehicle = self.vehicle_from_camera.as_ref().map(|r| r.apply(&answer.axis));
            report.status = Status::Ok;
            report.stage = Stage::Gates;
            if let Some(edge) = chosen.iter().find(|c| c.number == answer.candidate) {
                report.choose(*edge, Verdict::Chosen);
            }
            report.solution = Some(answer);
        }
    }

    /// Examines a part with the part's own camera and region. `left` is the largest work that it may cost.
    fn look_at_crop<P: Pixels, O: Observer<T>>(&self, look: Look<'_, T, P, O>, crop: Crop, left: Option<u32>) {
        let Look { lists, picture, expected, taken, observer, report } = look;
        let mut config = self.config.clone();
        config.limits.max_work = left.or(config.limits.max_work);
        let part = Sensor {
            config,
            camera: self.camera.for_crop(&crop),
            region: self.region.for_crop(&crop),
            vehicle_from_camera: self.vehicle_from_camera,
        };
        // Picture and observer are behind pointers, so that crops of every kind share the pipeline of the watched
        // pictures: crops are rare, and each pipeline is 100 KB and seconds of compiling.
        let cropped = Cropped::new(picture, crop);
        let read = |index| cropped.read(index);
        let picture = Indirect::new(&cropped, &read);
        let observer: &dyn Observer<T> = &Through { observer, crop };
        part.look(Look { lists, picture: &picture, expected, taken, observer: &observer, report });
    }
}

/// Combines the answers of the parts. The axis is their median or mean, the covariance includes their scatter, and the
/// rest comes from the answer that is nearest to this axis.
fn combine_answers<T: Real>(answers: &mut Answers<T>, combine: Combine) -> Option<Solution<T>> {
    let count = T::from_f64(answers.len() as f64);
    let axis = match combine {
        Combine::Mean => answers.iter().fold(V3::new(T::ZERO, T::ZERO, T::ZERO), |sum, a| sum + a.axis.v()),
        Combine::Median => {
            let mut middle = [T::ZERO; 3];
            for (k, m) in middle.iter_mut().enumerate() {
                let mut values = heapless::Vec::<T, ANSWERS>::new();
                for answer in answers.iter() {
                    let _ = values.push(answer.axis.v()[k]);
                }
                sort::by(&mut values, |a, b| a < b);
                let at = |i: usize| values.get(i).copied().unwrap_or(T::ZERO);
                let n = values.len();
                *m = (at(n / 2) + at(n.saturating_sub(1) / 2)) * T::from_f64(0.5);
            }
            V3::from(middle)
        }
    };
    let axis = unit(&axis)?;
    let (b1, b2) = basis(&axis);
    let (mut p, mut common) = ([T::ZERO; 3], Some([T::ZERO; 3]));
    for a in answers.iter() {
        let off = a.axis.v() - axis;
        let (x, y) = (off.dot(&b1), off.dot(&b2));
        let [p11, p12, p22] = across(&a.covariance, &b1, &b2);
        p = [p[0] + (p11 + x * x), p[1] + (p12 + x * y), p[2] + (p22 + y * y)];
        // The scatter of the parts is new in every picture.
        common = common.zip(a.common.map(|c| across(&c, &b1, &b2))).map(|(sum, c)| [0, 1, 2].map(|i| sum[i] + c[i]));
    }
    let nearest = answers.iter().max_by(|a, b| {
        let along = |s: &Solution<T>| s.axis.v().dot(&axis);
        along(a).partial_cmp(&along(b)).unwrap_or(core::cmp::Ordering::Equal)
    })?;
    Some(Solution {
        axis: UnitVec3::assume_unit(axis),
        covariance: Cov3::from_tangent(&b1, &b2, p.map(|x| x / count)),
        common: common.map(|c| Cov3::from_tangent(&b1, &b2, c.map(|x| x / count))),
        ..*nearest
    })
}

/// Returns a covariance (11, 12, 22) on a tangent basis.
fn across<T: Real>(covariance: &Cov3<Cam, T>, b1: &V3<T>, b2: &V3<T>) -> [T; 3] {
    let rows = covariance.rows();
    let form = |x: &V3<T>, y: &V3<T>| {
        let mut sum = T::ZERO;
        for i in 0..3 {
            for j in 0..3 {
                sum += x[i] * rows[i][j] * y[j];
            }
        }
        sum
    };
    [form(b1, b1), form(b1, b2), form(b2, b2)]
}

/// Passes on what is observed in a part, in the coordinates of the whole picture.
struct Through<'a, O> {
    observer: &'a O,
    crop: Crop,
}

impl<T: Real, O: Observer<T>> Observer<T> for Through<'_, O> {
    fn enter(&self, stage: Stage) {
        self.observer.enter(stage);
    }
    fn pixel(&self, x: u16, y: u16) {
        let at = self.crop.pixel(x, y);
        self.observer.pixel(at.x, at.y);
    }
    fn level(&self, level: u16, mean: T, samples: u32) {
        self.observer.level(level, mean, samples);
    }
    fn dark_frame(&self, px: u16) {
        self.observer.dark_frame(px);
    }
    fn look(&self, number: u32, level: u16) {
        self.observer.look(number, level);
    }
    fn edge(&self, candidate: u32, border: Border<'_>) {
        self.observer.edge(candidate, border.within(self.crop));
    }
    fn wants(&self, candidate: u32) -> bool {
        self.observer.wants(candidate)
    }
    fn point(&self, candidate: u32, point: ImagePoint<T>) {
        self.observer.point(candidate, self.crop.picture_point(point));
    }
    fn points(&self, candidate: u32, count: u32, clipped: u32) {
        self.observer.points(candidate, count, clipped);
    }
    fn weight(&self, candidate: u32, point: u32, weight: T) {
        self.observer.weight(candidate, point, weight);
    }
    fn wants_budget(&self) -> bool {
        self.observer.wants_budget()
    }
    fn budget(&self, candidate: u32, budget: &ErrorBudget<T>) {
        self.observer.budget(candidate, budget);
    }
    fn wants_fit(&self) -> bool {
        self.observer.wants_fit()
    }
    fn fit(&self, candidate: u32, fit: &Solution<T>, expected: &Expected<T>) {
        self.observer.fit(candidate, fit, expected);
    }
    fn evidence(&self, candidate: u32, evidence: &Evidence<T>) {
        self.observer.evidence(candidate, evidence);
    }
    fn verdict(&self, candidate: u32, outcome: &Candidate<T>, solution: Option<&Solution<T>>) {
        self.observer.verdict(candidate, outcome, solution);
    }
}
