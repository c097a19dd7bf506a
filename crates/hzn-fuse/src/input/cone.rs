//! The freely fitted cone of a limb, which is what all its edge points say together.

use hzn_core::ellipsoid::{WGS84_A_M, WGS84_B_M, from_geodetic};
use hzn_core::{Prior, Sensor};
use hzn_mcap::Row;
use hzn_nav::frames::{Cam, Covariance, Vector};
use nalgebra::Matrix3;

/// The cone that was fitted to the edge points of a limb with a free half-angle.
///
/// Its axis does not depend on the altitude and the limb height that the sensor was told. Its half-angle measures both.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FreeCone {
    /// Axis, unit vector.
    pub axis: Vector<Cam>,
    /// Covariance of the axis, rad².
    pub covariance_rad2: Covariance<Cam>,
    /// Cosine of the half-angle.
    pub cos: f64,
    /// Variance of the cosine.
    pub var_cos: f64,
    /// Covariance of the axis with the cosine, rad.
    pub axis_with_cos_rad: Vector<Cam>,
    /// The cosine that the sensor expects at the told altitude and limb height.
    pub told_cos: f64,
}

impl FreeCone {
    /// Returns the cone of a row; `None` if the row does not have it, or if the sensor is not known.
    pub(super) fn of_row(row: &Row, sensor: Option<&Sensor<f64>>) -> Option<Self> {
        let three = |x: [Option<f64>; 3]| Some(Vector::<Cam>::new(x[0]?, x[1]?, x[2]?));
        let axis = three([row.axis_free_x, row.axis_free_y, row.axis_free_z])?;
        let with_cos = three([row.cov_free_cos_x, row.cov_free_cos_y, row.cov_free_cos_z])?;
        let gain = three([row.axis_by_cos_x, row.axis_by_cos_y, row.axis_by_cos_z])?;
        let (cos, var_cos) = (row.half_angle_deg?.to_radians().cos(), row.var_free_cos?);
        let free = symmetric([
            row.cov_free_xx?,
            row.cov_free_xy?,
            row.cov_free_xz?,
            row.cov_free_yy?,
            row.cov_free_yz?,
            row.cov_free_zz?,
        ]);
        // The answer has errors that the sensor adds after the fusion with the expected half-angle: its covariance is
        // free − gain · (axis with cos)ᵀ + added. They are errors of the free axis, too.
        let fusion = gain.as_inner() * with_cos.as_inner().transpose();
        let added = symmetric(row.covariance()?) - free + (fusion + fusion.transpose()) * 0.5;
        let mut added = added.symmetric_eigen();
        added.eigenvalues.apply(|v| *v = v.max(0.0));
        let cone = Self {
            axis: axis.try_normalize(1e-6)?,
            covariance_rad2: (free + added.recompose()).into(),
            cos,
            var_cos,
            axis_with_cos_rad: with_cos,
            told_cos: told_cos(row, sensor?)?,
        };
        cone.is_usable().then_some(cone)
    }

    /// Returns the covariance of the axis and of the cosine, which takes the place along the axis: an axis has no error
    /// there.
    pub fn with_cos_along_axis(&self) -> Matrix3<f64> {
        let (e, with) = (self.axis.as_inner(), self.axis_with_cos_rad.as_inner());
        let across = Matrix3::identity() - e * e.transpose();
        let with = across * with * e.transpose();
        let axis = across * self.covariance_rad2.as_inner() * across;
        axis + with + with.transpose() + e * e.transpose() * self.var_cos
    }

    fn is_usable(&self) -> bool {
        let is_cosine = |cos: f64| cos > 0.0 && cos < 1.0;
        let covariance = self.with_cos_along_axis();
        is_cosine(self.cos)
            && is_cosine(self.told_cos)
            && covariance.iter().all(|x| x.is_finite())
            && covariance.symmetric_eigenvalues().min() > 0.0
    }
}

/// Returns the symmetric matrix of an upper triangle.
pub(super) fn symmetric([xx, xy, xz, yy, yz, zz]: [f64; 6]) -> Matrix3<f64> {
    Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
}

/// Returns the cosine that the sensor expects. The latitude follows from the axis in the fixed frame, which points down
/// to the ellipsoid.
fn told_cos(row: &Row, sensor: &Sensor<f64>) -> Option<f64> {
    let altitude_m = row.altitude_km? * 1e3;
    let position_m = row.axis_e_x.zip(row.axis_e_y).zip(row.axis_e_z).map(|((x, y), z)| {
        from_geodetic((-z).clamp(-1.0, 1.0).asin(), (-y).atan2(-x), altitude_m, WGS84_A_M, WGS84_B_M)
    });
    let which = sensor.config().each_body().iter().position(|body| body.kind.name() == row.body)?;
    let prior = Prior { altitude_m: Some(altitude_m), position_m, ..Prior::default() };
    Some(sensor.expect_body(which, &prior).ok()?.half_angle_rad().cos())
}
