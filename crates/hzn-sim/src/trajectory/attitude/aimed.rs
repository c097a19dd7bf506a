//! A camera that is aimed at a planet or moon.

use core::f64::consts::TAU;

use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::super::encounter::Sight;
use crate::pose::Pose;

/// A camera that is aimed at the centre of the body or towards its limb. Each pair has the values of the first and the
/// last picture.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Aimed {
    /// Angle between the optical axis and the centre, in angular radii of the body: 0 is the centre, 1 the limb.
    pub limb: [f64; 2],
    /// Place of the aim about the centre, degrees clockwise from the sunlit side.
    pub azimuth_deg: [f64; 2],
    /// Turn about the optical axis, degrees; at 0 the body's north is up.
    pub roll_deg: [f64; 2],
    /// Amplitude of the optical axis's motion around the aim, degrees. Another seed starts it elsewhere.
    pub wander_deg: f64,
}

impl Aimed {
    /// Fails for the first value that is out of its limits, with its key and the rule.
    pub(super) fn check(&self) -> Result<(), (&'static str, &'static str)> {
        let finite = |pair: [f64; 2]| pair.iter().all(|x| x.is_finite());
        if !self.limb.iter().all(|x| (0.0..=100.0).contains(x)) {
            return Err(("aimed.limb", "must be 0 (centre) to 100 (angular radii)"));
        }
        if !(finite(self.azimuth_deg) && finite(self.roll_deg)) {
            return Err(("aimed.azimuth_deg, aimed.roll_deg", "must be finite"));
        }
        if !(0.0..=90.0).contains(&self.wander_deg) {
            return Err(("aimed.wander_deg", "must be 0 to 90"));
        }
        Ok(())
    }

    /// Returns the attitude of the camera (camera to body-fixed) at a fraction of the time, 0 to 1. `phase` is the
    /// start of the motion around the aim, radians.
    pub(super) fn fixed_from_camera(&self, sight: &Sight, fraction: f64, phase: f64) -> UnitQuaternion<f64> {
        let at = |[first, last]: [f64; 2]| first + (last - first) * fraction;
        let side = |v: &Vector3<f64>, deg: f64| {
            let (sin, cos) = libm::sincos(deg.to_radians());
            v * cos + v.cross(&sight.from_body) * sin
        };
        let outward = side(&sight.sunward, at(self.azimuth_deg));
        let (sin, cos) = libm::sincos(at(self.limb) * sight.radius_rad);
        let axis = outward * sin - sight.from_body * cos;
        let up = side(&sight.north, at(self.roll_deg));
        let right = axis.cross(&up).normalize();
        let pose = Pose::from_axes([0.0; 3], [right, axis.cross(&right), axis].map(Into::into));
        let wander = self.wander_deg.to_radians();
        let swing = |cycles: f64| libm::sin(phase + TAU * cycles * fraction);
        let [w, x, y, z] =
            pose.disturbed([wander * swing(3.1), wander * swing(2.3 + 0.2 * phase), 0.0]).q_fixed_from_camera_wxyz;
        UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z))
    }
}
