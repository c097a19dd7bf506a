//! The truth about a scene with an ellipsoid.

use hzn_core::frames::UnitVec3;
use nalgebra::Vector3;

use super::row::Truth;
use super::scene::LIMB_IN_VIEW_PX;
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
        let [sun_x, sun_y, sun_z] =
            UnitVec3::<hzn_core::frames::Cam, f64>::try_new(sun.into()).ok_or(SceneError::Sun)?.xyz().map(Some);
        let [qw, qx, qy, qz] = self.pose.unit_quaternion_wxyz();
        let range_km = Vector3::from(limb.position_km()).norm();
        let truth = Truth {
            file: file.to_owned(),
            time_s,
            body: body.kind().to_owned(),
            limb: u8::from(self.visible_limb_px()? >= LIMB_IN_VIEW_PX),
            axis_x,
            axis_y,
            axis_z,
            half_angle_deg: libm::atan2(1.0, cot2.sqrt()).to_degrees(),
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
}
