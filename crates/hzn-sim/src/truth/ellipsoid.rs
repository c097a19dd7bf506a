//! The truth about a scene with an ellipsoid.

use hzn_core::camera::Camera;
use hzn_core::frames::{Cam, UnitVec3};
use nalgebra::Vector3;

use super::row::Truth;
use super::scene::LIMB_IN_VIEW_PX;
use crate::ellipsoid::{Ellipsoid, EllipsoidLimb};
use crate::error::SceneError;
use crate::scene::Scene;

/// Share of the outline of a small disc that must be lit and in view, if it is shorter than [`LIMB_IN_VIEW_PX`]. Half
/// of it is lit at every phase.
const SMALL_DISC_SHARE: f64 = 0.25;

impl Scene {
    /// Returns the truth about an ellipsoid. The axis is that of the elliptic cone of limb rays; the altitude counts
    /// above the mean of the semi-axes.
    pub(super) fn ellipsoid_truth(&self, body: &Ellipsoid, file: &str, time_s: f64) -> Result<Truth, SceneError> {
        let limb = EllipsoidLimb::try_new(body.limb_m(), &self.pose).ok_or(SceneError::Pose)?;
        let ([axis_x, axis_y, axis_z], cot2) = limb.axis_and_cot2();
        let sun = self.pose.matrix().transpose() * self.sun_direction()?;
        let [sun_x, sun_y, sun_z] = UnitVec3::<Cam, f64>::try_new(sun.into()).ok_or(SceneError::Sun)?.xyz().map(Some);
        let [qw, qx, qy, qz] = self.pose.unit_quaternion_wxyz();
        let range_km = Vector3::from(limb.position_km()).norm();
        let half_angle_rad = libm::atan2(1.0, cot2.sqrt());
        let least_px = LIMB_IN_VIEW_PX.min(SMALL_DISC_SHARE * self.outline_px(half_angle_rad)?);
        let truth = Truth {
            file: file.to_owned(),
            time_s,
            body: body.kind().to_owned(),
            limb: u8::from(self.visible_limb_px()? >= least_px),
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
            cam_to_ecef: self.pose.cam_to_ecef(),
            attitude_sigma_rad: Some(0.0),
            sun: sun.and_then(|sun| UnitVec3::try_new(sun.into())),
            ..hzn_core::Prior::default()
        }
    }

    /// Returns the length of the outline of a disc in the middle of the picture, pixels.
    fn outline_px(&self, half_angle_rad: f64) -> Result<f64, SceneError> {
        let (fx, fy) = Camera::<f64>::try_new(&self.camera)?.focal_px();
        Ok(core::f64::consts::TAU * fx.min(fy) * libm::tan(half_angle_rad))
    }
}
