//! Errors of positions.

use nalgebra::{Matrix3, Vector3};
use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::quantile::quantile;

/// A position with its covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredPosition {
    /// From the camera to the centre of the body in the camera frame, kilometres.
    pub centre_km: [f64; 3],
    /// Covariance: xx, xy, xz, yy, yz, zz in km².
    pub covariance_km2: [f64; 6],
}

impl MeasuredPosition {
    /// Returns the 1-sigma along the line to the body, and the largest one across it, kilometres; `None` if the
    /// position has no direction.
    pub fn sigmas_km(&self) -> Option<[f64; 2]> {
        let u = Vector3::from(self.centre_km).try_normalize(1e-12)?;
        let across = u.cross(&Vector3::ith(u.iamin(), 1.0)).normalize();
        let to_sight = Matrix3::from_rows(&[u.transpose(), across.transpose(), u.cross(&across).transpose()]);
        let [xx, xy, xz, yy, yz, zz] = self.covariance_km2;
        let p = to_sight * Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz) * to_sight.transpose();
        let widest = p.fixed_view::<2, 2>(1, 1).into_owned().symmetric_eigenvalues().max();
        Some([p.m11, widest].map(|variance| variance.max(0.0).sqrt()))
    }
}

/// Error of a position.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PositionMiss {
    /// Measured minus true distance, kilometres.
    pub range_km: f64,
    /// The same as a fraction of the distance.
    pub range_share: f64,
    /// The same divided by the 1-sigma of the distance.
    pub range_sigmas: f64,
    /// Error perpendicular to the true direction, kilometres.
    pub cross_range_km: f64,
    /// Normalised estimation error squared, three degrees of freedom; `None` if the covariance is singular.
    pub nees: Option<f64>,
}

impl PositionMiss {
    /// Compares a position with the truth (kilometres, camera frame).
    pub fn new(found: &MeasuredPosition, truth_km: [f64; 3]) -> Option<Self> {
        let (r, truth) = (Vector3::from(found.centre_km), Vector3::from(truth_km));
        let (u, direction) = (r.try_normalize(1e-12)?, truth.try_normalize(1e-12)?);
        let [xx, xy, xz, yy, yz, zz] = found.covariance_km2;
        let p = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        let range_km = r.norm() - truth.norm();
        let off = r - truth;
        // In units of its own standard deviations the matrix is well conditioned at any distance.
        let scale = Matrix3::from_diagonal(&p.diagonal().map(|variance| 1.0 / variance.sqrt()));
        let (scaled, d) = (scale * p * scale, scale * off);
        let nees = scaled.cholesky().map(|c| d.dot(&c.solve(&d))).filter(|x| x.is_finite());
        Some(Self {
            range_km,
            range_share: range_km / truth.norm(),
            range_sigmas: range_km / u.dot(&(p * u)).sqrt(),
            cross_range_km: (off - direction * off.dot(&direction)).norm(),
            nees,
        })
    }
}

/// Errors of many positions.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PositionErrors {
    /// Number of positions.
    pub positions: usize,
    /// RMS error of the distance, kilometres.
    pub range_rms_km: f64,
    /// RMS, mean and largest error of the distance as fractions of it.
    pub range_share_rms: f64,
    /// Mean error of the distance as a fraction of it.
    pub range_share_mean: f64,
    /// Largest error of the distance as a fraction of it.
    pub range_share_worst: f64,
    /// Mean error of the distance in sigmas.
    pub range_sigmas_mean: f64,
    /// RMS error of the distance in sigmas; 1 is ideal.
    pub range_sigmas_rms: f64,
    /// Median error perpendicular to the direction, kilometres.
    pub cross_range_median_km: f64,
    /// RMS error perpendicular to the direction, kilometres.
    pub cross_range_rms_km: f64,
    /// Mean NEES; 3 is ideal. NaN without a NEES.
    pub nees: f64,
    /// Interval that holds 95 % of the mean NEES if the covariances are right and the errors are independent.
    pub nees_interval: [f64; 2],
}

impl PositionErrors {
    /// Summarises errors; `None` if there are none.
    pub(crate) fn new(misses: &[PositionMiss]) -> Option<Self> {
        if misses.is_empty() {
            return None;
        }
        let mean = |f: &dyn Fn(&PositionMiss) -> f64| misses.iter().map(f).sum::<f64>() / misses.len() as f64;
        let rms = |f: &dyn Fn(&PositionMiss) -> f64| mean(&|m| f(m) * f(m)).sqrt();
        let mut cross: Vec<f64> = misses.iter().map(|m| m.cross_range_km).collect();
        cross.sort_by(f64::total_cmp);
        let nees: Vec<f64> = misses.iter().filter_map(|m| m.nees).collect();
        let n = nees.len() as f64;
        let chi2 = ChiSquared::new(3.0 * n);
        Some(Self {
            positions: misses.len(),
            range_rms_km: rms(&|m| m.range_km),
            range_share_rms: rms(&|m| m.range_share),
            range_share_mean: mean(&|m| m.range_share),
            range_share_worst: misses.iter().map(|m| m.range_share.abs()).fold(0.0, f64::max),
            range_sigmas_mean: mean(&|m| m.range_sigmas),
            range_sigmas_rms: rms(&|m| m.range_sigmas),
            cross_range_median_km: quantile(&cross, 0.5),
            cross_range_rms_km: rms(&|m| m.cross_range_km),
            nees: nees.iter().sum::<f64>() / n,
            nees_interval: chi2.map_or([f64::NAN; 2], |chi2| [0.025, 0.975].map(|p| chi2.inverse_cdf(p) / n)),
        })
    }
}
