//! One answer beside its truth.

use std::collections::HashMap;

use hzn_core::body::Kind;
use hzn_core::camera::Camera;
use hzn_core::frames::UnitVec3;
use hzn_core::status::Status;
use nalgebra::{Matrix3, Vector3};
use serde::Serialize;

use crate::truth::Truth;

/// What the sensor says about one picture and body.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    /// Name of the picture as the run was given it; a folder before the name does not matter.
    pub file: String,
    /// The body's kind as in sensor.toml.
    pub body: String,
    /// Outcome.
    pub status: Status,
    /// The direction, beside `ok`.
    pub found: Option<MeasuredDirection>,
}

/// A direction with its covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredDirection {
    /// Unit vector to the body in the camera frame.
    pub axis: [f64; 3],
    /// Its covariance: xx, xy, xz, yy, yz, zz in rad².
    pub covariance_rad2: [f64; 6],
    /// Half-angle of the half-angle-free fit in degrees.
    pub half_angle_deg: Option<f64>,
}

/// Sun and Moon, which have no nadir.
fn in_the_sky(body: &str) -> bool {
    body == Kind::Sun.name() || body == Kind::Moon.name()
}

/// One picture and body: what was there, and what was made of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Case {
    /// Name of the picture.
    pub file: String,
    /// The body's kind as in sensor.toml.
    pub body: String,
    /// Time of the truth in seconds.
    pub time_s: f64,
    /// Enough limb is in view to be answered.
    pub limb: bool,
    /// Outcome, by its name.
    pub status: &'static str,
    /// Altitude in kilometres; of Sun and Moon there is none.
    pub altitude_km: Option<f64>,
    /// Angle of the optical axis from the body's direction in degrees.
    pub off_axis_deg: f64,
    /// Length in pixels of the limb within the picture, lit or not; `None` where the camera is not known.
    pub limb_in_view_px: Option<f64>,
    /// How far off the answer is, where there is one.
    pub miss: Option<Miss>,
}

impl Case {
    /// What [`Self::off_axis_deg`] is called with this body.
    pub fn off_axis_name(&self) -> &'static str {
        if in_the_sky(&self.body) { "off axis" } else { "off nadir" }
    }
}

/// How far an answer is off.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Miss {
    /// Angle between answer and truth in degrees.
    pub angle_deg: f64,
    /// The rotation that takes the answer to the truth, about the camera's x, y and z axes, in degrees. For a camera
    /// that looks along the horizon x is its pitch and z its roll.
    pub about_deg: [f64; 3],
    /// The larger of the two standard deviations that the answer claims, in degrees.
    pub sigma_max_deg: f64,
    /// Squared error over covariance on the tangent plane, two degrees of freedom; `None` when the covariance is
    /// singular there.
    pub nees: Option<f64>,
    /// Half-angle that was found over the true one; `None` when none was given, and of the Sun, which blooms.
    pub half_angle_ratio: Option<f64>,
    /// The error of the direction in true half-angles.
    pub half_angles: f64,
}

impl Miss {
    /// Of one direction against the truth; `None` when either is no direction.
    pub fn new(found: &MeasuredDirection, truth_axis: [f64; 3], truth_half_angle_deg: f64) -> Option<Self> {
        let unit = |v: [f64; 3]| Vector3::from(v).try_normalize(1e-12);
        let (e, truth) = (unit(found.axis)?, unit(truth_axis)?);
        let cross = e.cross(&truth);
        let angle_deg = cross.norm().atan2(e.dot(&truth)).to_degrees();
        let about_deg = cross.try_normalize(1e-300).map_or([0.0; 3], |n| (n * angle_deg).into());
        let [xx, xy, xz, yy, yz, zz] = found.covariance_rad2;
        let p = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        // In the tangent plane of the answer, where the covariance lives.
        let across = e.cross(&Vector3::ith(e.iamin(), 1.0)).normalize();
        let basis = nalgebra::Matrix3x2::from_columns(&[across, e.cross(&across)]);
        let tangent = basis.transpose() * p * basis;
        // By length of arc, so that large errors are not foreshortened.
        let d = basis.transpose() * truth;
        let d = d * (angle_deg.to_radians() / d.norm().max(1e-300));
        let nees = tangent.cholesky().map(|c| d.dot(&c.solve(&d))).filter(|x| x.is_finite());
        Some(Self {
            angle_deg,
            about_deg,
            sigma_max_deg: tangent.symmetric_eigenvalues().max().max(0.0).sqrt().to_degrees(),
            nees,
            half_angle_ratio: found.half_angle_deg.map(|a| a / truth_half_angle_deg),
            half_angles: angle_deg / truth_half_angle_deg,
        })
    }
}

/// Why answers and truth do not belong together; displayed with the first name that does not fit.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Mismatch {
    /// An answer whose picture has no truth.
    #[error("{file} ({body}) is among the results but has no row in the truth: another sequence?")]
    NoTruth {
        /// Name of the picture.
        file: String,
        /// The body.
        body: String,
    },
    /// An answer about another body than the truth of its picture.
    #[error("{file}: the results are about {body}, the truth about {truth}: set [body] kind to {truth}")]
    Body {
        /// Name of the picture.
        file: String,
        /// The body of the results.
        body: String,
        /// The body of the truth.
        truth: String,
    },
    /// A truth whose picture was not answered, not even with a status.
    #[error("{file} ({body}) has a row in the truth but none among the results: was the run cut off?")]
    NoAnswer {
        /// Name of the picture.
        file: String,
        /// The body.
        body: String,
    },
    /// A picture and body that stand twice.
    #[error("{file} ({body}) stands twice {among}")]
    Twice {
        /// Name of the picture.
        file: String,
        /// The body.
        body: String,
        /// Where: `among the results` or `in the truth`.
        among: &'static str,
    },
    /// No answers at all.
    #[error("there are no results")]
    Empty,
}

/// The name without folders, as truth.csv has it.
fn base(file: &str) -> &str {
    file.rsplit(['/', '\\']).next().unwrap_or(file)
}

/// Puts every answer beside the truth of its picture and body, in the order of the truth. Truths of bodies that no
/// answer is about are passed over. `camera` serves [`Case::limb_in_view_px`].
///
/// # Errors
/// The first answer or truth that has no counterpart, or that stands twice.
pub fn pair(answers: &[Answer], truth: &[Truth], camera: Option<&Camera<f64>>) -> Result<Vec<Case>, Mismatch> {
    let mut by_name: HashMap<(&str, &str), &Answer> = HashMap::new();
    for a in answers {
        let (file, body) = (base(&a.file), a.body.as_str());
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
        let (file, body) = (base(&a.file).to_owned(), a.body.clone());
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
    for t in truth.iter().filter(|t| answers.iter().any(|a| a.body == t.body)) {
        let Some(answer) = by_name.get(&(t.file.as_str(), t.body.as_str())) else {
            return Err(Mismatch::NoAnswer { file: t.file.clone(), body: t.body.clone() });
        };
        let axis = [t.axis_x, t.axis_y, t.axis_z];
        cases.push(Case {
            file: t.file.clone(),
            body: t.body.clone(),
            time_s: t.time_s,
            limb: t.has_limb(),
            status: answer.status.name(),
            altitude_km: (!in_the_sky(&t.body)).then_some(t.altitude_km),
            off_axis_deg: axis[0].hypot(axis[1]).atan2(axis[2]).to_degrees(),
            limb_in_view_px: camera.map(|c| limb_in_view_px(c, axis, t.half_angle_deg.to_radians())),
            miss: answer.found.and_then(|f| {
                // The Sun blooms: its size is no measure.
                let half_angle_deg = f.half_angle_deg.filter(|_| t.body != Kind::Sun.name());
                Miss::new(&MeasuredDirection { half_angle_deg, ..f }, axis, t.half_angle_deg)
            }),
        });
    }
    Ok(cases)
}

/// Length in pixels of the part of a cone about `axis` (camera frame) that is in the picture and within the image
/// circle, whether it is lit or not.
pub fn limb_in_view_px(camera: &Camera<f64>, axis: [f64; 3], half_angle_rad: f64) -> f64 {
    const STEPS: usize = 4096;
    let Some(e) = Vector3::from(axis).try_normalize(1e-12) else { return 0.0 };
    let b1 = e.cross(&Vector3::ith(e.iamin(), 1.0)).normalize();
    let b2 = e.cross(&b1);
    let (sin, cos) = half_angle_rad.sin_cos();
    let at = |step: usize| {
        let (s, c) = (step as f64 * core::f64::consts::TAU / STEPS as f64).sin_cos();
        let p = camera.project(&UnitVec3::try_new((e * cos + (b1 * c + b2 * s) * sin).into())?)?;
        let inside = |x: f64, size: u16| x >= -0.5 && x <= f64::from(size) - 0.5;
        (inside(p.u, camera.width()) && inside(p.v, camera.height())).then_some(p)
    };
    let mut last = at(0);
    let mut length = 0.0;
    for step in 1..=STEPS {
        let next = at(step % STEPS);
        if let (Some(a), Some(b)) = (last, next) {
            length += (b.u - a.u).hypot(b.v - a.v);
        }
        last = next;
    }
    length
}
