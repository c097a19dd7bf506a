//! One answer and its truth.

use std::collections::HashMap;

use hzn_core::Solution;
use hzn_core::body::Kind;
use hzn_core::camera::Camera;
use hzn_core::frames::UnitVec3;
use hzn_core::status::Status;
use hzn_files::truth::Truth;
use hzn_mcap::Row;
use nalgebra::{Matrix3, Vector3};
use serde::Serialize;

use crate::position::{MeasuredPosition, PositionMiss};

/// The sensor's answer about one body in one picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    /// Name of the picture as the run got it; a folder before the name does not matter.
    pub file: String,
    /// The body's kind as in sensor.toml.
    pub body: String,
    /// Outcome.
    pub status: Status,
    /// The direction, if the status is `ok`.
    pub found: Option<MeasuredDirection>,
    /// The position of the body, if the answer has one.
    pub position: Option<MeasuredPosition>,
}

impl From<&Row> for Answer {
    fn from(row: &Row) -> Self {
        let found = row.axis().filter(|_| row.status == Status::Ok).map(|axis| MeasuredDirection {
            axis,
            // Without a covariance the error still counts, but its covariance is not evaluated.
            covariance_rad2: row.covariance().unwrap_or_default(),
            common_rad2: row.common_covariance(),
            half_angle_deg: row.half_angle_deg,
            protection_deg: row.protection_deg,
        });
        let position = || {
            let (centre_km, covariance_km2) = (row.position_km()?, row.position_covariance_km2()?);
            Some(MeasuredPosition { centre_km, covariance_km2 })
        };
        let position = found.and_then(|_| position());
        Self { file: row.file.clone(), body: row.body.clone(), status: row.status, found, position }
    }
}

/// A direction with its covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredDirection {
    /// Unit vector to the body, in the camera frame.
    pub axis: [f64; 3],
    /// Covariance of the axis: xx, xy, xz, yy, yz, zz in rad².
    pub covariance_rad2: [f64; 6],
    /// The part of the covariance that the next picture shares; `None` if the result does not have it.
    pub common_rad2: Option<[f64; 6]>,
    /// Half-angle of the half-angle-free fit in degrees.
    pub half_angle_deg: Option<f64>,
    /// Protection level in degrees; `None` if the result does not have it.
    pub protection_deg: Option<f64>,
}

impl From<&Solution<f64>> for MeasuredDirection {
    fn from(s: &Solution<f64>) -> Self {
        Self {
            axis: s.axis.xyz(),
            covariance_rad2: s.covariance.upper_rad2,
            common_rad2: s.common.map(|c| c.upper_rad2),
            half_angle_deg: Some(s.half_angle_rad.to_degrees()),
            // Only rows have it, because it depends on the configuration.
            protection_deg: None,
        }
    }
}

/// Returns true for Sun and Moon, which have no nadir.
fn is_in_sky(body: &str) -> bool {
    body == Kind::Sun.name() || body == Kind::Moon.name()
}

/// One body in one picture: the truth, and the result of the sensor.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Case {
    /// Name of the picture.
    pub file: String,
    /// The body's kind as in sensor.toml.
    pub body: String,
    /// Time of the truth in seconds; `None` if the truth has no times.
    pub time_s: Option<f64>,
    /// True if enough limb is in view for an answer.
    pub limb: bool,
    /// Name of the status.
    pub status: &'static str,
    /// Altitude in kilometres; `None` for Sun and Moon, and if the truth has none.
    pub altitude_km: Option<f64>,
    /// Angle between the optical axis and the body's direction, in degrees.
    pub off_axis_deg: f64,
    /// Length of the limb within the picture, lit or not, in pixels; `None` if the camera is not known.
    pub limb_in_view_px: Option<f64>,
    /// The true axis in the camera frame.
    #[serde(skip)]
    pub truth_axis: [f64; 3],
    /// Error of the answer; `None` without an answer.
    pub miss: Option<Miss>,
    /// Error of the position; `None` without a position, or if the truth has none.
    pub position_miss: Option<PositionMiss>,
}

impl Case {
    /// Returns the name of [`Self::off_axis_deg`] for this body.
    pub fn off_axis_name(&self) -> &'static str {
        if is_in_sky(&self.body) { "off axis" } else { "off nadir" }
    }
}

/// Error of an answer.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Miss {
    /// Angle between answer and truth in degrees.
    pub angle_deg: f64,
    /// Rotation from the answer to the truth, about the camera's x, y and z axes, in degrees. For a camera that looks
    /// along the horizon, x is its pitch and z is its roll.
    pub about_deg: [f64; 3],
    /// Angle from the answer to the truth in the picture, about the principal point, in degrees (positive from right to
    /// down). It is the error of the two-dimensional direction; `None` if answer or truth is straight ahead.
    pub picture_deg: Option<f64>,
    /// The larger of the two standard deviations of the answer's covariance, in degrees.
    pub sigma_max_deg: f64,
    /// Normalised estimation error squared (NEES) on the tangent plane, with two degrees of freedom. It is `None` if
    /// the covariance is singular there.
    pub nees: Option<f64>,
    /// Measured half-angle divided by the true one. It is `None` if the answer has no half-angle, and for the Sun
    /// because it blooms.
    pub half_angle_ratio: Option<f64>,
    /// Error of the direction divided by the true half-angle.
    pub half_angles: f64,
    /// The answer itself.
    #[serde(skip)]
    pub found: MeasuredDirection,
}

impl Miss {
    /// Compares one direction with the truth; returns `None` if either vector has no length.
    pub fn new(found: &MeasuredDirection, truth_axis: [f64; 3], truth_half_angle_deg: f64) -> Option<Self> {
        let unit = |v: [f64; 3]| Vector3::from(v).try_normalize(1e-12);
        let (e, truth) = (unit(found.axis)?, unit(truth_axis)?);
        let cross = e.cross(&truth);
        let angle_deg = cross.norm().atan2(e.dot(&truth)).to_degrees();
        let about_deg = cross.try_normalize(1e-300).map_or([0.0; 3], |n| (n * angle_deg).into());
        let [xx, xy, xz, yy, yz, zz] = found.covariance_rad2;
        let p = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        // The covariance is defined in the tangent plane of the answer.
        let across = e.cross(&Vector3::ith(e.iamin(), 1.0)).normalize();
        let basis = nalgebra::Matrix3x2::from_columns(&[across, e.cross(&across)]);
        let tangent = basis.transpose() * p * basis;
        // The error is an arc length, so large errors are not foreshortened.
        let d = basis.transpose() * truth;
        let d = d * (angle_deg.to_radians() / d.norm().max(1e-300));
        let nees = tangent.cholesky().map(|c| d.dot(&c.solve(&d))).filter(|x| x.is_finite());
        let (answered, true_direction) = (picture_direction(e), picture_direction(truth));
        let picture_deg = answered.zip(true_direction).map(|(a, t)| {
            let (right, down) = (a[0] * t[0] + a[1] * t[1], a[0] * t[1] - a[1] * t[0]);
            down.atan2(right).to_degrees()
        });
        Some(Self {
            angle_deg,
            about_deg,
            picture_deg,
            sigma_max_deg: tangent.symmetric_eigenvalues().max().max(0.0).sqrt().to_degrees(),
            nees,
            half_angle_ratio: found.half_angle_deg.map(|a| a / truth_half_angle_deg),
            half_angles: angle_deg / truth_half_angle_deg,
            found: *found,
        })
    }
}

/// Returns the unit vector in the picture (right, down) from the principal point towards a direction.
fn picture_direction(direction: Vector3<f64>) -> Option<[f64; 2]> {
    UnitVec3::<hzn_core::frames::Cam, f64>::try_new(direction.into())?.to_picture_direction()
}

/// The reason why answers and truth do not match; the message names the first picture that does not fit.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Mismatch {
    /// An answer whose picture has no truth.
    #[error("{file} ({body}) is among the results but has no row in the truth: is the truth of another sequence?")]
    NoTruth {
        /// Name of the picture.
        file: String,
        /// The body.
        body: String,
    },
    /// An answer about a body that differs from the body of the picture's truth.
    #[error("{file}: the results are about {body}, the truth about {truth}: set [body] kind to {truth}")]
    Body {
        /// Name of the picture.
        file: String,
        /// The body of the results.
        body: String,
        /// The body of the truth.
        truth: String,
    },
    /// A truth whose picture has no result, not even a status.
    #[error("{file} ({body}) has a row in the truth but none among the results: was the run cut off?")]
    NoAnswer {
        /// Name of the picture.
        file: String,
        /// The body.
        body: String,
    },
    /// A picture and body that occur twice.
    #[error("{file} ({body}) occurs twice {among}")]
    Twice {
        /// Name of the picture.
        file: String,
        /// The body.
        body: String,
        /// Place of the repetition: `among the results` or `in the truth`.
        among: &'static str,
    },
    /// No answers at all.
    #[error("there are no results")]
    Empty,
}

/// Returns the name without folders, as in truth.csv.
fn base_name(file: &str) -> &str {
    file.rsplit(['/', '\\']).next().unwrap_or(file)
}

/// Returns the body of the truth if the answers are about a sphere and the truth about one body by its name: a
/// sensor.toml has `sphere` for a moon or a planet whose radius it tells.
fn only_body<'a>(answers: &[Answer], truth: &'a [Truth]) -> Option<&'a str> {
    let first = truth.first()?.body.as_str();
    let is_sphere = answers.iter().all(|a| a.body == Kind::Sphere.name());
    let is_one = truth.iter().all(|t| t.body == first) && !first.starts_with(Kind::Earth.name());
    (is_sphere && is_one).then_some(first)
}

/// Pairs every answer with the truth of its picture and body, in the order of the truth. Truths about bodies without
/// any answer are skipped. `camera` is needed only for [`Case::limb_in_view_px`].
///
/// # Errors
/// Fails if there are no answers, and for the first answer or truth that has no counterpart or occurs twice.
pub fn pair(answers: &[Answer], truth: &[Truth], camera: Option<&Camera<f64>>) -> Result<Vec<Case>, Mismatch> {
    let mut by_name: HashMap<(&str, &str), &Answer> = HashMap::new();
    let only = only_body(answers, truth);
    for a in answers {
        let (file, body) = (base_name(&a.file), only.unwrap_or(a.body.as_str()));
        if by_name.insert((file, body), a).is_some() {
            return Err(Mismatch::Twice { file: file.into(), body: body.into(), among: "among the results" });
        }
    }
    let mut true_bodies: HashMap<&str, Vec<&str>> = HashMap::new();
    for t in truth {
        let bodies = true_bodies.entry(t.file.as_str()).or_default();
        if bodies.contains(&t.body.as_str()) {
            return Err(Mismatch::Twice { file: t.file.clone(), body: t.body.clone(), among: "in the truth" });
        }
        bodies.push(&t.body);
    }
    for a in answers {
        let (file, body) = (base_name(&a.file).to_owned(), only.unwrap_or(a.body.as_str()).to_owned());
        match true_bodies.get(file.as_str()).map(Vec::as_slice) {
            None => return Err(Mismatch::NoTruth { file, body }),
            Some(bodies) if bodies.contains(&body.as_str()) => {}
            Some([only]) => return Err(Mismatch::Body { file, body, truth: (*only).to_owned() }),
            Some(_) => return Err(Mismatch::NoTruth { file, body }),
        }
    }
    if answers.is_empty() {
        return Err(Mismatch::Empty);
    }
    let mut cases = Vec::with_capacity(answers.len());
    for t in truth.iter().filter(|t| only.is_some() || answers.iter().any(|a| a.body == t.body)) {
        let Some(answer) = by_name.get(&(t.file.as_str(), t.body.as_str())) else {
            return Err(Mismatch::NoAnswer { file: t.file.clone(), body: t.body.clone() });
        };
        let axis = [t.axis_x, t.axis_y, t.axis_z];
        cases.push(Case {
            file: t.file.clone(),
            body: t.body.clone(),
            time_s: Some(t.time_s).filter(|t| t.is_finite()),
            truth_axis: axis,
            limb: t.has_limb(),
            status: answer.status.name(),
            altitude_km: (!is_in_sky(&t.body) && t.altitude_km.is_finite()).then_some(t.altitude_km),
            off_axis_deg: axis[0].hypot(axis[1]).atan2(axis[2]).to_degrees(),
            limb_in_view_px: camera.map(|c| limb_in_view_px(c, axis, t.half_angle_deg.to_radians())),
            miss: answer.found.and_then(|f| {
                // The Sun blooms, so its apparent size says nothing about the sensor.
                let half_angle_deg = f.half_angle_deg.filter(|_| t.body != Kind::Sun.name());
                Miss::new(&MeasuredDirection { half_angle_deg, ..f }, axis, t.half_angle_deg)
            }),
            position_miss: answer.position.zip(t.position_km()).and_then(|(p, truth)| PositionMiss::new(&p, truth)),
        });
    }
    Ok(cases)
}

/// Returns the length in pixels of the part of a cone about `axis` (camera frame) that is in the picture and in the
/// image circle, lit or not.
pub fn limb_in_view_px(camera: &Camera<f64>, axis: [f64; 3], half_angle_rad: f64) -> f64 {
    const STEPS: usize = 4096;
    let Some(e) = Vector3::from(axis).try_normalize(1e-12) else { return 0.0 };
    let b1 = e.cross(&Vector3::ith(e.iamin(), 1.0)).normalize();
    let b2 = e.cross(&b1);
    let (sin, cos) = half_angle_rad.sin_cos();
    let project = |step: usize| {
        let (s, c) = (step as f64 * core::f64::consts::TAU / STEPS as f64).sin_cos();
        let p = camera.project(&UnitVec3::try_new((e * cos + (b1 * c + b2 * s) * sin).into())?)?;
        let inside = |x: f64, size: u16| x >= -0.5 && x <= f64::from(size) - 0.5;
        (inside(p.u, camera.width()) && inside(p.v, camera.height())).then_some(p)
    };
    let mut last = project(0);
    let mut length = 0.0;
    for step in 1..=STEPS {
        let next = project(step % STEPS);
        if let (Some(a), Some(b)) = (last, next) {
            length += (b.u - a.u).hypot(b.v - a.v);
        }
        last = next;
    }
    length
}
