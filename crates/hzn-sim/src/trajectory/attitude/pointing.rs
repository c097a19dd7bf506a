//! Cameras that point: at an angle from straight down, or towards one body after the other.

use core::f64::consts::TAU;

use hzn_core::body::Kind;
use hzn_nav::ephemeris;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::pose::{Look, Pose};

/// A camera whose angles change evenly from the first picture to the last one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Pointing {
    /// Angle between the optical axis and straight down, degrees, in the first and the last picture.
    pub off_nadir_deg: [f64; 2],
    /// Azimuth over ground, degrees from north to east, in the first and the last picture.
    pub azimuth_deg: [f64; 2],
    /// Turn about the optical axis, degrees, in the first and the last picture.
    pub roll_deg: [f64; 2],
}

impl Default for Pointing {
    fn default() -> Self {
        Self { off_nadir_deg: [0.0, 0.0], azimuth_deg: [0.0, 0.0], roll_deg: [0.0, 0.0] }
    }
}

impl Pointing {
    /// Fails for the first value that is out of its limits, with its key and the rule.
    pub(super) fn check(&self) -> Result<(), (&'static str, &'static str)> {
        if self.off_nadir_deg.iter().any(|d| !(0.0..=180.0).contains(d)) {
            return Err(("pointing.off_nadir_deg", "must be 0 (straight down) to 180"));
        }
        Ok(())
    }

    /// Returns the attitude of the camera at a position in ECEF.
    pub(super) fn fixed_from_camera(
        &self,
        position_m: Vector3<f64>,
        [from_s, to_s]: [f64; 2],
        time_s: f64,
    ) -> UnitQuaternion<f64> {
        let x = if to_s > from_s { (time_s - from_s) / (to_s - from_s) } else { 0.0 };
        let angle = |[a, b]: [f64; 2]| (a + x * (b - a)).to_radians();
        let look = Look::off_nadir(angle(self.off_nadir_deg), angle(self.azimuth_deg), angle(self.roll_deg));
        quaternion(&Pose::looking(position_m.into(), look))
    }
}

/// A camera that looks at one body after the other.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Towards {
    /// `sun`, `moon`, `earth`; each gets an equal share of the time.
    #[cfg_attr(feature = "schema", schemars(schema_with = "crate::foreign_schema::bodies"))]
    pub bodies: Vec<Kind>,
    /// Amplitude of the optical axis's motion around the body, degrees.
    pub wander_deg: f64,
}

impl Default for Towards {
    fn default() -> Self {
        Self { bodies: vec![Kind::Sun, Kind::Moon], wander_deg: 3.0 }
    }
}

impl Towards {
    /// Fails for the first value that is out of its limits, with its key and the rule.
    pub(super) fn check(&self) -> Result<(), (&'static str, &'static str)> {
        if self.bodies.is_empty() || self.bodies.iter().any(|b| matches!(b, Kind::Sphere)) {
            return Err(("towards.bodies", "must be one or more of \"sun\", \"moon\", \"earth\""));
        }
        Ok(())
    }

    /// Returns the attitude of the camera at a position in ECEF, at a time that is also given as UTC. `phase` is the
    /// start of the motion around the bodies, radians.
    pub(super) fn fixed_from_camera(
        &self,
        position_m: Vector3<f64>,
        [from_s, to_s]: [f64; 2],
        [time_s, unix_s]: [f64; 2],
        phase: f64,
    ) -> UnitQuaternion<f64> {
        let fraction = ((time_s - from_s) / (to_s - from_s).max(1e-9)).clamp(0.0, 1.0 - 1e-9);
        let n = self.bodies.len();
        let kind = self.bodies.get((fraction * n as f64) as usize).copied().unwrap_or(Kind::Sun);
        let axis: Vector3<f64> = match kind {
            Kind::Sun => ephemeris::sun(unix_s).seen_from(position_m.into()).direction.into_inner(),
            Kind::Moon => ephemeris::moon(unix_s).seen_from(position_m.into()).direction.into_inner(),
            _ => -position_m.normalize(),
        };
        let helper = if axis.z.abs() < 0.9 { Vector3::z() } else { Vector3::x() };
        let right = axis.cross(&helper).normalize();
        let pose = Pose::from_axes(position_m.into(), [right, axis.cross(&right), axis].map(Into::into));
        // The body moves slowly over the picture on a Lissajous figure.
        let swing = |cycles: f64| libm::sin(phase + TAU * cycles * fraction * n as f64);
        let wander = self.wander_deg.to_radians();
        let offset = [wander * swing(1.3), wander * swing(0.9 + 0.2 * phase), 0.6 * swing(0.4)];
        quaternion(&pose.disturbed(offset))
    }
}

fn quaternion(pose: &Pose) -> UnitQuaternion<f64> {
    let [w, x, y, z] = pose.q_fixed_from_camera_wxyz;
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
}
