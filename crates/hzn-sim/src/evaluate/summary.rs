//! Many cases in a few numbers.

use std::collections::BTreeMap;

use serde::Serialize;

use super::case::Case;
use super::honesty::Honesty;

/// HORACE counts an answer when radius and centre are right to this part of the radius.
const HORACE_PART: f64 = 0.1;
/// About so many rows a group has.
const ROWS: f64 = 6.0;

/// A run against its truth, for one body.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Evaluation {
    /// The body's kind.
    pub body: String,
    /// Pictures.
    pub frames: usize,
    /// Pictures with a limb in view.
    pub with_limb: usize,
    /// Of these, answered.
    pub answered: usize,
    /// Pictures with a limb in view that were not answered, by their status.
    pub unanswered: BTreeMap<&'static str, usize>,
    /// Pictures that were answered though no limb is in view.
    pub false_answers: usize,
    /// Errors of the answers where a limb is in view; `None` without any.
    pub errors: Option<Errors>,
    /// Whether the covariances say so; `None` without answers.
    pub honesty: Option<Honesty>,
    /// HORACE's own criteria.
    pub horace: Horace,
    /// The same by altitude, by angle off nadir (of Sun and Moon: off axis), by length of limb in view. One that does
    /// not vary is left out.
    pub groups: Vec<Group>,
}

/// Errors of many answers, angles in degrees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Errors {
    /// Answers.
    pub answers: usize,
    /// Root of the mean square.
    pub rms_deg: f64,
    /// Half are below.
    pub median_deg: f64,
    /// 95 % are below.
    pub p95_deg: f64,
    /// The largest.
    pub worst_deg: f64,
    /// Mean of the rotation from answer to truth about the camera's x, y, z axes.
    pub mean_about_deg: [f64; 3],
    /// Root of its mean square about the camera's x, y, z axes.
    pub rms_about_deg: [f64; 3],
}

/// The success criteria of HORACE (Barf 2014; Barf et al. 2015), said in angles instead of pixels of a picture: radius
/// is the half-angle of the half-angle-free fit, centre the direction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Horace {
    /// Share of the pictures with a limb whose answer has its radius within 10 %, and its centre within 10 % of the
    /// radius. NaN when there are none.
    pub success: f64,
    /// Share of the pictures with a limb that were not answered so. Their goal was below 10 %.
    pub false_negatives: f64,
    /// Share of the pictures without a limb that were answered; `None` when there are none.
    pub false_positives: Option<f64>,
}

/// Cases in ranges of one quantity.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Group {
    /// The quantity, such as `altitude`.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Its ranges, rising; empty ones are left out.
    pub rows: Vec<GroupRow>,
}

/// Cases whose quantity is within a range.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GroupRow {
    /// The range: from, and up to but without.
    pub range: [f64; 2],
    /// Pictures with a limb in view.
    pub with_limb: usize,
    /// Of these, answered.
    pub answered: usize,
    /// Their errors.
    pub errors: Option<Errors>,
    /// Their honesty.
    pub honesty: Option<Honesty>,
}

impl Evaluation {
    /// Of cases, one evaluation a body, in the order in which bodies come.
    pub fn by_body(cases: &[Case]) -> Vec<Self> {
        let mut bodies: Vec<&str> = Vec::new();
        for case in cases {
            if !bodies.contains(&case.body.as_str()) {
                bodies.push(&case.body);
            }
        }
        let of = |body: &&str| cases.iter().filter(|c| c.body == **body).collect::<Vec<_>>();
        bodies.iter().map(|body| Self::new(&of(body))).collect()
    }

    /// Of the cases of one body.
    pub fn new(cases: &[&Case]) -> Self {
        let with_limb: Vec<&Case> = cases.iter().copied().filter(|c| c.limb).collect();
        let without = cases.len() - with_limb.len();
        let false_answers = cases.iter().filter(|c| !c.limb && c.miss.is_some()).count();
        let mut unanswered = BTreeMap::new();
        for case in with_limb.iter().filter(|c| c.miss.is_none()) {
            *unanswered.entry(case.status).or_default() += 1;
        }
        let hits = with_limb.iter().filter(|c| horace_counts(c)).count();
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

    /// Pictures with a limb in view that were answered, as a share; NaN when there are none.
    pub fn answered_share(&self) -> f64 {
        self.answered as f64 / self.with_limb as f64
    }
}

fn horace_counts(case: &Case) -> bool {
    case.miss.is_some_and(|m| {
        let radius = m.half_angle_ratio.is_none_or(|r| (r - 1.0).abs() <= HORACE_PART);
        radius && m.half_angles <= HORACE_PART
    })
}

fn honesty(cases: &[&Case]) -> Option<Honesty> {
    let nees: Vec<f64> = cases.iter().filter_map(|c| c.miss?.nees).collect();
    Honesty::from_nees(&nees)
}

impl Errors {
    /// Of the answers among some cases; `None` without any.
    fn new(cases: &[&Case]) -> Option<Self> {
        let misses: Vec<_> = cases.iter().filter_map(|c| c.miss).collect();
        let mut sorted: Vec<f64> = misses.iter().map(|m| m.angle_deg).collect();
        sorted.sort_by(f64::total_cmp);
        let worst_deg = *sorted.last()?;
        let mean = |f: &dyn Fn(&super::Miss) -> f64| misses.iter().map(f).sum::<f64>() / misses.len() as f64;
        Some(Self {
            answers: misses.len(),
            rms_deg: mean(&|m| m.angle_deg * m.angle_deg).sqrt(),
            median_deg: quantile(&sorted, 0.5),
            p95_deg: quantile(&sorted, 0.95),
            worst_deg,
            mean_about_deg: [0, 1, 2].map(|i| mean(&|m| m.about_deg[i])),
            rms_about_deg: [0, 1, 2].map(|i| mean(&|m| m.about_deg[i] * m.about_deg[i]).sqrt()),
        })
    }
}

/// The value below which the share `p` of sorted values is, linear between neighbours; NaN without any.
pub(super) fn quantile(sorted: &[f64], p: f64) -> f64 {
    let place = p * sorted.len().saturating_sub(1) as f64;
    let (below, part) = (place.floor() as usize, place.fract());
    match (sorted.get(below), sorted.get(below + 1)) {
        (Some(a), Some(b)) => a + part * (b - a),
        (Some(a), None) => *a,
        _ => f64::NAN,
    }
}

impl Group {
    /// In ranges of about a sixth of where the values are; `None` when they are all alike, or not known.
    fn new(
        name: &'static str,
        unit: &'static str,
        cases: &[&Case],
        value: impl Fn(&Case) -> Option<f64>,
    ) -> Option<Self> {
        let values: Vec<f64> = cases.iter().map(|c| value(c)).collect::<Option<_>>()?;
        let (low, high) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &x| (a.min(x), b.max(x)));
        let step = nice_step((high - low) / ROWS)?;
        // A spread that tells nothing apart makes no table.
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

/// The next of 1, 2, 5, 10, … (times a power of ten) that is not below; `None` for what has no size.
pub(super) fn nice_step(at_least: f64) -> Option<f64> {
    if !(at_least > 0.0 && at_least.is_finite()) {
        return None;
    }
    let decade = 10f64.powf(at_least.log10().floor());
    [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * decade).find(|step| *step >= at_least * (1.0 - 1e-9))
}
