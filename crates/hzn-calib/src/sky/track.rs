//! The lens from the track of the Sun or the Moon through the pictures of a flight.
//!
//! A picture shows the centre of the disc at a point, and attitude and ephemeris give its direction in the nominal
//! camera frame. One rotation of the real camera against the nominal one is common to all pictures, and is unknown. The
//! points are fitted with a Cauchy loss, and the parameters of the lens have their sigmas before the flight as a prior.

use std::fmt;

use hzn_core::camera::{Config, Equation};
use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::parameters::{Determined, Parameters};
use super::unknowns::Unknowns;

/// Smallest number of pictures. The rotation and the lens have seven unknowns at least.
const MIN_SIGHTS: usize = 8;
/// Largest number of Gauss-Newton steps.
const STEPS: usize = 40;
/// Width of the Cauchy loss in standard deviations, for 95 % efficiency with normal errors (Holland & Welsch 1977).
const CAUCHY: f64 = 2.3849;
/// The median length of a residual whose two coordinates have a standard deviation of 1: √(2 ln 2).
const MEDIAN_LENGTH: f64 = 1.1774;
/// Floor of the standard deviation of a disc's centre, in pixels. Blur and threshold have such errors in common.
const MIN_SIGMA_PX: f64 = 0.02;
/// Largest residual of a picture that counts, in standard deviations.
const MAX_SIGMAS: f64 = 4.5;
/// Largest fraction of the pictures that may disagree.
const MAX_INCONSISTENT: f64 = 0.2;

/// The centre of the disc in one picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Sight {
    /// Name of the picture.
    pub name: String,
    /// Image point of the centre, in pixels.
    pub point_px: [f64; 2],
    /// Direction to the centre in the nominal camera frame, a unit vector.
    pub direction: [f64; 3],
}

/// The lens that a track measures.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    /// The calibration with the determined parameters.
    pub camera: Config,
    /// All parameters that take part.
    pub parameters: Vec<Determined>,
    /// Change of the focal length in percent, and its 1-sigma, even if it is not determined.
    pub focal_percent: [f64; 2],
    /// 1-sigma of the focal length before the flight, in percent.
    pub focal_sigma_before_percent: f64,
    /// Rotation from the real to the nominal camera frame, scalar first.
    pub q_nominal_from_camera_wxyz: [f64; 4],
    /// The same as a rotation vector (camera frame), in degrees, with the 1-sigma of each component.
    pub correction_deg: [[f64; 2]; 3],
    /// Standard deviation of a coordinate of a point, in pixels.
    pub sigma_px: f64,
    /// Number of pictures that count.
    pub pictures: usize,
    /// Names of pictures whose point disagrees with the others.
    pub left_out: Vec<String>,
}

/// Why a track does not determine the lens.
#[derive(Debug, Clone, PartialEq)]
pub enum TrackRefusal {
    /// Too few pictures have an answer and a direction.
    TooFew {
        /// Number of such pictures.
        pictures: usize,
    },
    /// The fit has no solution.
    NotConverged,
    /// Too many points disagree with the others.
    Inconsistent {
        /// Number of points that disagree.
        inconsistent: usize,
        /// Number of all points.
        pictures: usize,
    },
    /// No parameter is known clearly better than before.
    Undetermined {
        /// 1-sigma of the focal length after the flight, in percent.
        focal_percent: f64,
        /// 1-sigma of the focal length before the flight, in percent.
        before_percent: f64,
    },
}

impl fmt::Display for TrackRefusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooFew { pictures } => write!(
                f,
                "{pictures} pictures have an answer and a direction of the body, but at least {MIN_SIGHTS} are needed. \
                 frames.csv gives the direction by sun_x, sun_y, sun_z, or by qw, qx, qy, qz with utc (for the Moon \
                 with x_km, y_km, z_km too)"
            ),
            Self::NotConverged => f.write_str(
                "the fit does not converge; check the attitude and the direction of its quaternion (camera to ECEF)",
            ),
            Self::Inconsistent { inconsistent, pictures } => write!(
                f,
                "{inconsistent} of {pictures} points disagree with the others; attitudes or times may belong to other \
                 pictures"
            ),
            Self::Undetermined { focal_percent, before_percent } => write!(
                f,
                "the track gives the focal length to ± {focal_percent:.2} %, and before it was known to ± \
                 {before_percent:.2} %; a value is written if its sigma is at most half of that before, or 0.9 of it \
                 if the calibration states the covariance of all parameters. The track must cross a large part of the \
                 picture"
            ),
        }
    }
}

impl std::error::Error for TrackRefusal {}

/// Estimates the lens and the rotation from a track.
///
/// # Errors
/// See [`TrackRefusal`].
pub fn estimate_track(unknowns: &Unknowns, sights: &[Sight]) -> Result<Track, TrackRefusal> {
    let mut kept: Vec<&Sight> = sights.iter().collect();
    loop {
        if kept.len() < MIN_SIGHTS {
            return Err(TrackRefusal::TooFew { pictures: kept.len() });
        }
        let fit = Fit::new(unknowns, &kept)?;
        let lengths = fit.lengths(unknowns, &kept);
        let good = |length: &f64| *length <= MAX_SIGMAS * fit.sigma_px;
        if lengths.iter().all(good) {
            let left_out = sights.iter().filter(|s| !kept.iter().any(|k| k.name == s.name)).map(|s| s.name.clone());
            return fit.into_track(unknowns, kept.len(), left_out.collect());
        }
        kept = kept.into_iter().zip(lengths).filter(|(_, length)| good(length)).map(|(s, _)| s).collect();
        let inconsistent = sights.len() - kept.len();
        if inconsistent as f64 > MAX_INCONSISTENT * sights.len() as f64 {
            return Err(TrackRefusal::Inconsistent { inconsistent, pictures: sights.len() });
        }
    }
}

/// A fit that has converged.
pub(super) struct Fit {
    /// Rotation from the nominal to the real camera frame.
    rotation: Rotation3<f64>,
    pub(super) changes: DVector<f64>,
    /// Covariance of the rotation vector (rad), then of the parameters.
    pub(super) covariance: DMatrix<f64>,
    sigma_px: f64,
}

impl Fit {
    pub(super) fn new(unknowns: &Unknowns, sights: &[&Sight]) -> Result<Self, TrackRefusal> {
        let n = unknowns.list.len();
        let start = start_rotation(&unknowns.before, sights).ok_or(TrackRefusal::NotConverged)?;
        let prior = unknowns.covariance.clone().cholesky().ok_or(TrackRefusal::NotConverged)?.inverse();
        let mut fit = Self {
            rotation: start,
            changes: DVector::zeros(n),
            covariance: DMatrix::zeros(n + 3, n + 3),
            sigma_px: 1.0,
        };
        for _ in 0..STEPS {
            let lengths = fit.lengths(unknowns, sights);
            fit.sigma_px = (median(&lengths) / MEDIAN_LENGTH).max(MIN_SIGMA_PX);
            let (mut normal, mut right) = fit.equations(unknowns, sights).ok_or(TrackRefusal::NotConverged)?;
            let mut block = normal.view_mut((3, 3), (n, n));
            block += &prior;
            let mut rest = right.rows_mut(3, n);
            rest -= &prior * &fit.changes;
            let factor = scaled(&normal).ok_or(TrackRefusal::NotConverged)?;
            fit.covariance = factor;
            let step = &fit.covariance * right;
            fit.rotation = Rotation3::new(Vector3::new(step[0], step[1], step[2])) * fit.rotation;
            fit.changes += step.rows(3, n);
            let moved = (0..n + 3).map(|i| step[i].abs() / fit.covariance[(i, i)].sqrt()).fold(0.0, f64::max);
            if moved < 1e-3 {
                return Ok(fit);
            }
        }
        Err(TrackRefusal::NotConverged)
    }

    /// Returns the lengths of the residuals in pixels.
    fn lengths(&self, unknowns: &Unknowns, sights: &[&Sight]) -> Vec<f64> {
        let lens = Equation::new(&unknowns.changed_by(self.changes.as_slice()));
        let length = |s: &&Sight| {
            let turned = self.rotation * Vector3::from(s.direction);
            lens.project(turned.into())
                .map_or(f64::INFINITY, |p| (s.point_px[0] - p.point.u).hypot(s.point_px[1] - p.point.v))
        };
        sights.iter().map(length).collect()
    }

    /// Sums the normal equations without the prior.
    fn equations(&self, unknowns: &Unknowns, sights: &[&Sight]) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let n = unknowns.list.len();
        let config = unknowns.changed_by(self.changes.as_slice());
        let lens = Equation::new(&config);
        let all = config.model.intrinsics();
        let places: Vec<usize> = unknowns.list.iter().filter_map(|i| all.iter().position(|a| a == i)).collect();
        let (mut normal, mut right) = (DMatrix::zeros(n + 3, n + 3), DVector::zeros(n + 3));
        for s in sights {
            let turned = self.rotation * Vector3::from(s.direction);
            let projected = lens.project(turned.into())?;
            let error = [s.point_px[0] - projected.point.u, s.point_px[1] - projected.point.v];
            let weight = 1.0 / (1.0 + (error[0].hypot(error[1]) / (CAUCHY * self.sigma_px)).powi(2));
            let weight = weight / (self.sigma_px * self.sigma_px);
            for (axis, error) in error.into_iter().enumerate() {
                let mut row = DVector::zeros(n + 3);
                // (ω × d) · g = ω · (d × g).
                row.rows_mut(0, 3).copy_from(&turned.cross(&Vector3::from(projected.by_direction[axis])));
                for (i, place) in places.iter().enumerate() {
                    row[3 + i] = projected.by_intrinsics[axis][*place];
                }
                normal.syger(weight, &row, &row, 1.0);
                right.axpy(weight * error, &row, 1.0);
            }
        }
        normal.fill_upper_triangle_with_lower_triangle();
        Some((normal, right))
    }

    fn into_track(self, unknowns: &Unknowns, pictures: usize, left_out: Vec<String>) -> Result<Track, TrackRefusal> {
        let n = unknowns.list.len();
        let covariance = self.covariance.view((3, 3), (n, n)).into_owned();
        let lens =
            Parameters::new(unknowns, &self.changes, &covariance, f64::INFINITY).ok_or(TrackRefusal::NotConverged)?;
        let correction = UnitQuaternion::from_rotation_matrix(&self.rotation.inverse());
        let turn = correction.scaled_axis();
        Ok(Track {
            camera: lens.camera,
            parameters: lens.list,
            focal_percent: lens.focal_percent,
            focal_sigma_before_percent: unknowns.focal_sigma_percent(),
            q_nominal_from_camera_wxyz: [correction.w, correction.i, correction.j, correction.k],
            correction_deg: core::array::from_fn(|i| {
                [turn[i].to_degrees(), self.covariance[(i, i)].sqrt().to_degrees()]
            }),
            sigma_px: self.sigma_px,
            pictures,
            left_out,
        })
    }
}

impl Track {
    /// Returns the refusal if the track determines no parameter.
    pub fn undetermined(&self) -> Option<TrackRefusal> {
        let none = !self.parameters.iter().any(|p| p.determined);
        none.then_some(TrackRefusal::Undetermined {
            focal_percent: self.focal_percent[1],
            before_percent: self.focal_sigma_before_percent,
        })
    }
}

/// Returns the rotation that fits the rays of the lens before the flight best (Wahba's problem, by singular values).
fn start_rotation(lens: &Config, sights: &[&Sight]) -> Option<Rotation3<f64>> {
    let camera = hzn_core::camera::Camera::<f64>::try_new(lens).ok()?;
    let mut sum = Matrix3::zeros();
    for s in sights {
        let [u, v] = s.point_px;
        let Some(ray) = camera.unproject(hzn_core::pixel::ImagePoint { u, v }) else { continue };
        sum += Vector3::from(ray.xyz()) * Vector3::from(s.direction).transpose();
    }
    let svd = sum.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let sign = (u.determinant() * v_t.determinant()).signum();
    Some(Rotation3::from_matrix_unchecked(u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v_t))
}

/// Inverts a symmetric matrix whose rows have different units.
fn scaled(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = matrix.nrows();
    let scale = DVector::from_iterator(n, matrix.diagonal().iter().map(|d| 1.0 / d.max(1e-300).sqrt()));
    let inverse = DMatrix::from_fn(n, n, |i, j| matrix[(i, j)] * scale[i] * scale[j]).cholesky()?.inverse();
    Some(DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * scale[i] * scale[j]))
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}
