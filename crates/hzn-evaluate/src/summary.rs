//! A summary of many cases.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::case::{Case, Miss};
use crate::classes::ErrorClasses;
use crate::honesty::Honesty;
use crate::integrity::Integrity;
use crate::means::{Means, common_square};
use crate::position::PositionErrors;
use crate::quantile::quantile;

/// HORACE counts an answer as a success if radius and centre are right within this fraction of the radius.
const HORACE_TOLERANCE: f64 = 0.1;
/// Approximate number of rows in a group.
const ROWS: f64 = 6.0;

/// A run compared with its truth, for one body.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Evaluation {
    /// The body's kind.
    pub body: String,
    /// Number of pictures.
    pub frames: usize,
    /// Number of pictures with a limb in view.
    pub with_limb: usize,
    /// Number of answered pictures with a limb in view.
    pub answered: usize,
    /// Number of pictures with a limb in view that were not answered, by status.
    pub unanswered: BTreeMap<&'static str, usize>,
    /// Number of answered pictures without a limb in view.
    pub false_answers: usize,
    /// Errors of the answers to pictures with a limb in view; `None` if there are none.
    pub errors: Option<Errors>,
    /// Comparison of these errors with their covariances; `None` if there are no answers.
    pub honesty: Option<Honesty>,
    /// Means over consecutive answers compared with their covariances, for each of [`LENGTHS`](crate::LENGTHS) that has
    /// a group.
    pub means: Vec<Means>,
    /// Protection levels compared with the errors; `None` if no answer has a level.
    pub integrity: Option<Integrity>,
    /// Errors of the positions; `None` if there are none.
    pub position: Option<PositionErrors>,
    /// The error classes of ECSS-E-ST-60-20C about the camera's x and y axes; `None` for a short sequence.
    pub classes: Option<[ErrorClasses; 2]>,
    /// Result by the criteria of HORACE.
    pub horace: Horace,
    /// Results by altitude, by angle off nadir (off axis for Sun and Moon), and by length of limb in view. A quantity
    /// that does not vary is left out.
    pub groups: Vec<Group>,
}

/// Errors of many answers, all angles in degrees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Errors {
    /// Number of answers.
    pub answers: usize,
    /// Root mean square.
    pub rms_deg: f64,
    /// Median.
    pub median_deg: f64,
    /// 95th percentile.
    pub p95_deg: f64,
    /// Largest error.
    pub worst_deg: f64,
    /// Mean rotation from answer to truth, about the camera's x, y, z axes.
    pub mean_about_deg: [f64; 3],
    /// RMS rotation from answer to truth, about the camera's x, y, z axes.
    pub rms_about_deg: [f64; 3],
    /// Error of the two-dimensional direction in the picture; `None` if no answer has one.
    pub picture: Option<PictureError>,
}

/// Error of the unit vector in the picture towards the body (Barf 2014, (2.37)), as an angle about the principal point.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PictureError {
    /// Number of answers whose body is not straight ahead.
    pub answers: usize,
    /// Mean, degrees.
    pub mean_deg: f64,
    /// Standard deviation about the mean, degrees.
    pub sigma_deg: f64,
}

impl PictureError {
    fn new(misses: &[Miss]) -> Option<Self> {
        let errors: Vec<f64> = misses.iter().filter_map(|m| m.picture_deg).collect();
        let mean = |of: &dyn Fn(f64) -> f64| errors.iter().map(|x| of(*x)).sum::<f64>() / errors.len() as f64;
        let mean_deg = mean(&|x| x);
        let sigma_deg = mean(&|x| (x - mean_deg) * (x - mean_deg)).sqrt();
        (!errors.is_empty()).then_some(Self { answers: errors.len(), mean_deg, sigma_deg })
    }

    /// Returns the statistic of HORACE: the absolute mean plus the standard deviation, degrees.
    pub fn mean_and_sigma_deg(&self) -> f64 {
        self.mean_deg.abs() + self.sigma_deg
    }
}

/// The success criteria of HORACE (Barf 2014; Barf et al. 2015), in angles instead of pixels. The radius is the
/// half-angle of the half-angle-free fit, and the centre is the direction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Horace {
    /// Share of the pictures with a limb whose answer has the radius right within 10 %, and the centre right within
    /// 10 % of the radius. It is NaN if there are no pictures with a limb.
    pub success: f64,
    /// Share of the pictures with a limb that are not a success. HORACE's goal was below 10 %.
    pub false_negatives: f64,
    /// Share of the pictures without a limb that were answered; `None` if there are no pictures without a limb.
    pub false_positives: Option<f64>,
}

/// Cases, grouped by ranges of one quantity.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Group {
    /// Name of the quantity, for example `altitude`.
    pub name: &'static str,
    /// Unit of the quantity.
    pub unit: &'static str,
    /// Ranges in rising order; empty ones are left out.
    pub rows: Vec<GroupRow>,
}

/// Cases whose quantity is within one range.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GroupRow {
    /// The range: the lower limit is included, the upper limit is not.
    pub range: [f64; 2],
    /// Number of pictures with a limb in view.
    pub with_limb: usize,
    /// Number of answered pictures with a limb in view.
    pub answered: usize,
    /// Errors of these answers; `None` if there are none.
    pub errors: Option<Errors>,
    /// Comparison of these errors with their covariances; `None` if there are no answers.
    pub honesty: Option<Honesty>,
}

impl Evaluation {
    /// Makes one evaluation per body, in the order in which the bodies first occur.
    pub fn by_body(cases: &[Case]) -> Vec<Self> {
        let mut bodies: Vec<&str> = Vec::new();
        for case in cases {
            if !bodies.contains(&case.body.as_str()) {
                bodies.push(&case.body);
            }
        }
        let cases_about = |body: &&str| cases.iter().filter(|c| c.body == **body).collect::<Vec<_>>();
        bodies.iter().map(|body| Self::new(&cases_about(body))).collect()
    }

    /// Evaluates the cases of one body.
    pub fn new(cases: &[&Case]) -> Self {
        let with_limb: Vec<&Case> = cases.iter().copied().filter(|c| c.limb).collect();
        let without = cases.len() - with_limb.len();
        let false_answers = cases.iter().filter(|c| !c.limb && c.miss.is_some()).count();
        let mut unanswered = BTreeMap::new();
        for case in with_limb.iter().filter(|c| c.miss.is_none()) {
            *unanswered.entry(case.status).or_default() += 1;
        }
        let hits = with_limb.iter().filter(|c| is_horace_success(c)).count();
        let off_axis = cases.first().map_or("off axis", |c| c.off_axis_name());
        let success = hits as f64 / with_limb.len() as f64;
        Self {
            body: cases.first().map(|c| c.body.clone()).unwrap_or_default(),
            frames: cases.len(),
            with_limb: with_limb.len(),
            answered: with_limb.iter().filter(|c| c.miss.is_some()).count(),
            unanswered,
            false_answers,
            errors: Errors::new(&with_limb),
            honesty: honesty(&with_limb),
            means: Means::of(cases),
            integrity: Integrity::of(cases),
            position: PositionErrors::new(&with_limb.iter().filter_map(|c| c.position_miss).collect::<Vec<_>>()),
            classes: classes(&with_limb),
            horace: Horace {
                success,
                false_negatives: 1.0 - success,
                false_positives: (without > 0).then(|| false_answers as f64 / without as f64),
            },
            groups: [
                Group::new("altitude", "km", &with_limb, |c| c.altitude_km),
                Group::new(off_axis, "deg", &with_limb, |c| Some(c.off_axis_deg)),
                Group::new("limb in view", "px", &with_limb, |c| c.limb_in_view_px),
            ]
            .into_iter()
            .flatten()
            .collect(),
        }
    }

    /// Returns the share of pictures with a limb in view that were answered; NaN if there are no pictures with a limb.
    pub fn answered_share(&self) -> f64 {
        self.answered as f64 / self.with_limb as f64
    }
}

fn is_horace_success(case: &Case) -> bool {
    case.miss.is_some_and(|m| {
        let radius = m.half_angle_ratio.is_none_or(|r| (r - 1.0).abs() <= HORACE_TOLERANCE);
        radius && m.half_angles <= HORACE_TOLERANCE
    })
}

/// Separates the errors about the camera's x and y axes of the answers, in order of time.
fn classes(cases: &[&Case]) -> Option<[ErrorClasses; 2]> {
    let mut answered: Vec<_> =
        cases.iter().filter_map(|c| Some((c.time_s.unwrap_or(f64::NAN), c.miss?.about_deg))).collect();
    answered.sort_by(|a, b| a.0.total_cmp(&b.0));
    let about = |axis: usize| ErrorClasses::new(&answered.iter().map(|(_, e)| e[axis]).collect::<Vec<_>>());
    Some([about(0)?, about(1)?])
}

fn honesty(cases: &[&Case]) -> Option<Honesty> {
    let nees: Vec<f64> = cases.iter().filter_map(|c| c.miss?.nees).collect();
    Honesty::from_nees(&nees, common_square(cases))
}

impl Errors {
    /// Summarises the errors of the answers among `cases`; returns `None` if there are no answers.
    fn new(cases: &[&Case]) -> Option<Self> {
        let misses: Vec<_> = cases.iter().filter_map(|c| c.miss).collect();
        let mut sorted: Vec<f64> = misses.iter().map(|m| m.angle_deg).collect();
        sorted.sort_by(f64::total_cmp);
        let worst_deg = *sorted.last()?;
        let mean = |f: &dyn Fn(&Miss) -> f64| misses.iter().map(f).sum::<f64>() / misses.len() as f64;
        Some(Self {
            answers: misses.len(),
            rms_deg: mean(&|m| m.angle_deg * m.angle_deg).sqrt(),
            median_deg: quantile(&sorted, 0.5),
            p95_deg: quantile(&sorted, 0.95),
            worst_deg,
            mean_about_deg: [0, 1, 2].map(|i| mean(&|m| m.about_deg[i])),
            rms_about_deg: [0, 1, 2].map(|i| mean(&|m| m.about_deg[i] * m.about_deg[i]).sqrt()),
            picture: PictureError::new(&misses),
        })
    }
}

impl Group {
    /// Groups the cases into ranges of about one sixth of the spread of the values. Returns `None` if the values are
    /// all alike or not known.
    fn new(
        name: &'static str,
        unit: &'static str,
        cases: &[&Case],
        value: impl Fn(&Case) -> Option<f64>,
    ) -> Option<Self> {
        let values: Vec<f64> = cases.iter().map(|c| value(c)).collect::<Option<_>>()?;
        let (low, high) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &x| (a.min(x), b.max(x)));
        let step = nice_step((high - low) / ROWS)?;
        // A spread below 1 % of the values separates nothing, so it gets no table.
        if high - low < 0.01 * high.abs() {
            return None;
        }
        let first = (low / step).floor();
        let count = ((high / step).floor() - first) as usize + 1;
        let row = |i: usize| {
            let range = [(first + i as f64) * step, (first + i as f64 + 1.0) * step];
            let inside = |x: f64| (x / step).floor() == first + i as f64;
            let members: Vec<&Case> = cases.iter().zip(&values).filter(|(_, x)| inside(**x)).map(|(c, _)| *c).collect();
            (!members.is_empty()).then(|| GroupRow {
                range,
                with_limb: members.len(),
                answered: members.iter().filter(|c| c.miss.is_some()).count(),
                errors: Errors::new(&members),
                honesty: honesty(&members),
            })
        };
        Some(Self { name, unit, rows: (0..count).filter_map(row).collect() })
    }
}

/// Returns the smallest of 1, 2, 5, 10, … (times a power of ten) that is at least `min`. Returns `None` if
/// `min` is not positive and finite.
pub(crate) fn nice_step(min: f64) -> Option<f64> {
    if !(min > 0.0 && min.is_finite()) {
        return None;
    }
    let decade = 10f64.powf(min.log10().floor());
    [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * decade).find(|step| *step >= min * (1.0 - 1e-9))
}
