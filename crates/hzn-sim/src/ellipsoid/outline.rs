//! The visible part of an ellipsoid's limb.

use hzn_core::frames::{Cam, UnitVec3};
use nalgebra::Vector3;

use super::body::Ellipsoid;
use super::limb::EllipsoidLimb;
use super::ring;
use crate::pose::Pose;
use crate::visible::air::PreparedAir;

/// The limb of a body, with its light and its rings.
pub(crate) struct EllipsoidOutline<'a> {
    body: &'a Ellipsoid,
    limb: EllipsoidLimb,
    position_m: Vector3<f64>,
    sun: Vector3<f64>,
    air: Option<PreparedAir>,
}

impl<'a> EllipsoidOutline<'a> {
    /// Returns `None` if the camera is not above the limb height. `sun` is the unit direction to the Sun.
    pub(crate) fn try_new(body: &'a Ellipsoid, pose: &Pose, sun: Vector3<f64>) -> Option<Self> {
        Some(Self {
            body,
            limb: EllipsoidLimb::try_new(body.limb_m(), pose)?,
            position_m: pose.position_m.into(),
            sun,
            air: body.haze.map(|haze| PreparedAir::new(&haze.air(), body.mean_radius_km() * 1e3)),
        })
    }

    /// Returns the direction of the limb at an azimuth.
    pub(crate) fn ray(&self, azimuth_rad: f64) -> Option<UnitVec3<Cam, f64>> {
        UnitVec3::try_new(self.limb.ray(azimuth_rad))
    }

    /// Returns whether the limb at an azimuth gets sunlight and is not behind a ring. On a body without air the Sun
    /// must be above the horizon there. Haze still shines beyond the terminator: it counts while it gets half of the
    /// sunlight.
    pub(crate) fn is_visible(&self, azimuth_rad: f64) -> bool {
        let (normal, point) = self.limb.touch(&self.limb.ray(azimuth_rad).into());
        let mu0 = normal.dot(&self.sun);
        let lit = self.air.map_or(mu0 > 0.0, |air| {
            let height_m = (self.body.limb_height_km() - self.body.surface_height_km) * 1e3;
            let density = air.density_ratio(height_m as f32);
            air.sunlight(air.sun_path(mu0 as f32), density)[0] > 0.5
        });
        let to_point = point - self.position_m;
        let range_m = to_point.norm();
        let ring = ring::intersect(&self.body.rings, &self.position_m, &(to_point / range_m));
        lit && !ring.is_some_and(|ring| ring.range_m < range_m && ring.opacity > 0.5)
    }
}
