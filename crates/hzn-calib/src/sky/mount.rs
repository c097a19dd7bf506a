//! The mounting of the camera from a sequence with known attitude.
//!
//! The attitude of each picture (camera to ECEF) was computed with a nominal mount. It predicts the limb axis p in the
//! nominal camera frame, and the picture shows the axis a in the real camera frame. The correction is the constant
//! rotation C from the real to the nominal camera frame with p = C a. For a small rotation ω the difference is p − C a
//! = ω × (C a). A picture determines the two components of ω across p. The directions must differ for all three.

use hzn_core::body::{self, Kind};
use hzn_core::ellipsoid::{LimbCone, WGS84_A_M, WGS84_B_M};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use std::fmt;

use super::estimate::{Estimate, Picture};
use super::view::View;

/// Largest 1-sigma of each component of the rotation, in degrees: the attitude of a sensor without a calibration of its
/// mount is worse.
const MAX_SIGMA_DEG: f64 = 0.5;
/// Smallest number of pictures.
const MIN_PICTURES: usize = 6;
/// 1-sigma of an attitude without a sigma, in radians: what is left of it scatters in the residuals.
const MIN_SIGMA_RAD: f64 = 1e-5;
/// Number of iterations.
const ITERATIONS: usize = 10;
/// Number of rounds in which the weights of the pictures follow from the residuals.
const ROUNDS: usize = 3;

/// The mounting that a flight measures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mount {
    /// Rotation from the real to the nominal camera frame, scalar first.
    pub q_nominal_from_camera_wxyz: [f64; 4],
    /// The correction as a rotation vector (camera frame), in degrees.
    pub correction_deg: [f64; 3],
    /// Covariance of the rotation vector, in deg².
    pub covariance_deg2: [[f64; 3]; 3],
    /// 1-sigma of each component of the rotation vector, in degrees.
    pub sigma_deg: [f64; 3],
    /// RMS angle between measured and predicted axes after the correction, in degrees.
    pub residual_deg: f64,
    /// Number of pictures.
    pub pictures: usize,
}

/// Why a flight does not determine the mounting.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MountRefusal {
    /// Too few pictures have a position and an attitude.
    TooFew {
        /// Number of such pictures.
        pictures: usize,
    },
    /// The directions of the limb axis do not determine three axes.
    Degenerate {
        /// Largest 1-sigma of a rotation, in degrees; infinite if nothing determines it.
        sigma_deg: f64,
        /// The direction (camera frame) about which the rotation is not determined.
        about: [f64; 3],
    },
}

impl fmt::Display for MountRefusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooFew { pictures } => write!(
                f,
                "{pictures} pictures have a limb, a position (x_km, y_km, z_km) and an attitude (qw, qx, qy, qz) in \
                 frames.csv, but at least {MIN_PICTURES} are needed"
            ),
            Self::Degenerate { sigma_deg, about: [x, y, z] } => write!(
                f,
                "the limb axes that the camera sees do not determine the rotation about ({x:.2}, {y:.2}, {z:.2}) in \
                 the camera frame: its sigma is {sigma_deg:.2}°, and at most {MAX_SIGMA_DEG}° is useful. Take \
                 pictures in which the body lies in different directions of the camera"
            ),
        }
    }
}

impl std::error::Error for MountRefusal {}

/// A measured axis with its prediction, both in the camera frame.
struct Pair {
    measured: Vector3<f64>,
    predicted: Vector3<f64>,
    variance_rad2: f64,
}

/// Estimates the correction of the mount from the pictures of an estimate. `views` are those of the estimate, and
/// `body` is the body.
///
/// # Errors
/// The pictures do not determine three axes: see [`MountRefusal`].
pub fn estimate_mount(estimate: &Estimate, body: &body::Config, views: &[View]) -> Result<Mount, MountRefusal> {
    from_pictures(&estimate.pictures, estimate.height_km[0], body, views)
}

/// Estimates the correction from the axes of the pictures, with the limb height in kilometres.
pub(super) fn from_pictures(
    pictures: &[Picture],
    limb_km: f64,
    body: &body::Config,
    views: &[View],
) -> Result<Mount, MountRefusal> {
    let pairs: Vec<Pair> = pictures
        .iter()
        .filter(|p| p.counts)
        .filter_map(|p| {
            let view = views.iter().find(|v| v.name == p.name)?;
            let predicted = predict_axis(limb_km, body, view)?;
            let sigma = view.prior.attitude_sigma_rad.unwrap_or(MIN_SIGMA_RAD).max(MIN_SIGMA_RAD);
            Some(Pair { measured: Vector3::from(p.axis), predicted, variance_rad2: sigma * sigma })
        })
        .collect();
    if pairs.len() < MIN_PICTURES {
        return Err(MountRefusal::TooFew { pictures: pairs.len() });
    }
    solve(pairs)
}

/// Returns the limb axis that position and attitude predict, in the nominal camera frame.
fn predict_axis(limb_km: f64, body: &body::Config, view: &View) -> Option<Vector3<f64>> {
    let (position, attitude) = (view.prior.position_m?, view.prior.fixed_from_camera?);
    let axis = match body.kind {
        Kind::Earth => LimbCone::try_new(position, WGS84_A_M + limb_km * 1e3, WGS84_B_M + limb_km * 1e3)?.axis,
        _ => hzn_core::frames::UnitVec3::try_new(position.map(|x| -x))?,
    };
    Some(Vector3::from(attitude.inverse().apply(&axis).xyz()))
}

/// Fits the rotation. The residuals raise the variance of all pictures if they are larger than the sigmas.
fn solve(mut pairs: Vec<Pair>) -> Result<Mount, MountRefusal> {
    let (mut rotation, mut inverse, mut residual2) = (Rotation3::identity(), Matrix3::zeros(), 0.0);
    for _ in 0..ROUNDS {
        for _ in 0..ITERATIONS {
            let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
            for pair in &pairs {
                let turned = rotation * pair.measured;
                let across = turned.cross_matrix();
                // ω × a = −[a]× ω.
                normal += across.transpose() * across / pair.variance_rad2;
                right += across.transpose() * (turned - pair.predicted) / pair.variance_rad2;
            }
            inverse = invert(&normal)?;
            let step = inverse * right;
            rotation = Rotation3::new(step) * rotation;
            if step.norm() < 1e-14 {
                break;
            }
        }
        let each = |p: &Pair| (rotation * p.measured - p.predicted).norm_squared();
        residual2 = pairs.iter().map(each).sum::<f64>() / pairs.len() as f64;
        // Two components of each picture, less the three of the rotation.
        let freedom = (2 * pairs.len() - 3) as f64;
        let chi2 = pairs.iter().map(|p| each(p) / p.variance_rad2).sum::<f64>() / freedom;
        if chi2 <= 1.0 {
            break;
        }
        pairs.iter_mut().for_each(|p| p.variance_rad2 *= chi2);
    }
    let quaternion = UnitQuaternion::from_rotation_matrix(&rotation);
    let degrees2 = 1f64.to_degrees().powi(2);
    Ok(Mount {
        q_nominal_from_camera_wxyz: [quaternion.w, quaternion.i, quaternion.j, quaternion.k],
        correction_deg: rotation.scaled_axis().map(f64::to_degrees).into(),
        covariance_deg2: core::array::from_fn(|i| core::array::from_fn(|j| inverse[(i, j)] * degrees2)),
        sigma_deg: core::array::from_fn(|i| inverse[(i, i)].sqrt().to_degrees()),
        residual_deg: residual2.sqrt().to_degrees(),
        pictures: pairs.len(),
    })
}

/// Inverts the information; the error names the direction about which nothing determines the rotation.
fn invert(normal: &Matrix3<f64>) -> Result<Matrix3<f64>, MountRefusal> {
    let eigen = normal.symmetric_eigen();
    let weakest = eigen.eigenvalues.imin();
    let sigma_deg = (1.0 / eigen.eigenvalues[weakest].max(0.0)).sqrt().to_degrees();
    let about = eigen.eigenvectors.column(weakest);
    let refusal = MountRefusal::Degenerate { sigma_deg, about: [about[0], about[1], about[2]] };
    if sigma_deg <= MAX_SIGMA_DEG { normal.try_inverse().ok_or(refusal) } else { Err(refusal) }
}
