//! The truth about a scene with an ellipsoid.

use hzn_core::frames::{Cam, UnitVec3};
use hzn_files::truth::Truth;
use nalgebra::Vector3;

use crate::ellipsoid::{Ellipsoid, EllipsoidLimb};
use crate::error::SceneError;
use crate::scene::Scene;

impl Scene {
    /// Returns the truth about an ellipsoid. The axis is that of the elliptic cone of limb rays; the altitude counts
    /// above the mean of the semi-axes.
    pub(super) fn ellipsoid_truth(&self, body: &Ellipsoid, file: &str, time_s: f64) -> Result<Truth, SceneError> {
        let limb = EllipsoidLimb::try_new(body.limb_m(), &self.pose).ok_or(SceneError::Pose)?;
        let ([axis_x, axis_y, axis_z], cot2) = limb.axis_and_cot2();
        let sun = self.pose.matrix().transpose() * self.sun_direction()?;
        let [sun_x, sun_y, sun_z] = UnitVec3::<Cam, f64>::try_new(sun.into()).ok_or(SceneError::Sun)?.xyz().map(Some);
        let [qw, qx, qy, qz] = self.pose.unit_q_fixed_from_camera_wxyz();
        let range_km = Vector3::from(limb.position_km()).norm();
        let half_angle_rad = libm::atan2(1.0, cot2.sqrt());
        let truth = Truth {
            file: file.to_owned(),
            time_s,
            body: body.kind().to_owned(),
            limb: u8::from(self.has_limb(self.body.kind)?),
            axis_x,
            axis_y,
            axis_z,
            half_angle_deg: half_angle_rad.to_degrees(),
            altitude_km: range_km - body.mean_radius_km(),
            sun_x,
            sun_y,
            sun_z,
            qw,
            qx,
            qy,
            qz,
            ..Truth::default()
        };
        Ok(truth.with_position_km(limb.position_km()))
    }

    /// Returns what a navigation system would tell the sensor about an ellipsoid: the attitude and the Sun.
    pub fn told_prior(&self) -> hzn_core::Prior<f64> {
        let sun = self.sun_direction().ok().map(|sun| self.pose.matrix().transpose() * sun);
        hzn_core::Prior {
            fixed_from_camera: self.pose.fixed_from_camera(),
            attitude_sigma_rad: Some(0.0),
            sun: sun.and_then(|sun| UnitVec3::try_new(sun.into())),
            ..hzn_core::Prior::default()
        }
    }
}
