//! What is true of a scene: a row of truth.csv.

use hzn_core::body::Kind;
use hzn_core::ellipsoid::LimbCone;
use hzn_core::frames::{Cam, Ecef, UnitVec3};
use serde::{Deserialize, Serialize};

use crate::error::SceneError;
use crate::globe::Globe;
use crate::scene::{Light, Scene};

/// Visible pixels of limb from which a picture counts as showing one.
pub const LIMB_IN_VIEW_PX: f64 = 50.0;

/// The truth about one picture; the fields are the columns of truth.csv, in their order.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Truth {
    /// Name of the picture's file, without its folder.
    pub file: String,
    /// Time in seconds.
    pub time_s: f64,
    /// The body's kind as in sensor.toml.
    pub body: String,
    /// 1 when at least 50 px of lit limb are in view and not behind the vehicle, else 0.
    pub limb: u8,
    /// Limb axis (for spheres the centre) in the camera frame, unit vector.
    pub axis_x: f64,
    /// Second component of the axis.
    pub axis_y: f64,
    /// Third component of the axis.
    pub axis_z: f64,
    /// Half-angle of the limb's cone in degrees; for an ellipsoid its cot² is the mean of the two principal ones.
    pub half_angle_deg: f64,
    /// Altitude of the camera above the surface in kilometres (geodetic for `earth`).
    pub altitude_km: f64,
    /// Direction to the Sun in the camera frame, unit vector; empty when the scene has none.
    pub sun_x: Option<f64>,
    /// Second component of the direction to the Sun.
    pub sun_y: Option<f64>,
    /// Third component of the direction to the Sun.
    pub sun_z: Option<f64>,
    /// Direction to the Moon in the camera frame, unit vector; empty when the scene has none.
    pub moon_x: Option<f64>,
    /// Second component of the direction to the Moon.
    pub moon_y: Option<f64>,
    /// Third component of the direction to the Moon.
    pub moon_z: Option<f64>,
    /// Attitude as a quaternion from camera to ECEF, scalar part.
    pub qw: f64,
    /// First vector component of the attitude.
    pub qx: f64,
    /// Second vector component of the attitude.
    pub qy: f64,
    /// Third vector component of the attitude.
    pub qz: f64,
}

impl Truth {
    /// The limb axis in the camera frame; `None` when the row holds no direction.
    pub fn axis(&self) -> Option<UnitVec3<Cam, f64>> {
        UnitVec3::try_new([self.axis_x, self.axis_y, self.axis_z])
    }
    /// Whether the picture shows enough limb to be answered.
    pub fn has_limb(&self) -> bool {
        self.limb != 0
    }
}

/// The kind's name in sensor.toml.
fn name(kind: Kind) -> &'static str {
    match kind {
        Kind::Earth => "earth",
        Kind::EarthSphere => "earth-sphere",
        Kind::Sun => "sun",
        Kind::Moon => "moon",
        Kind::Sphere => "sphere",
    }
}

impl Scene {
    /// The truth of the scene, for a picture's name and time.
    ///
    /// # Errors
    /// A camera, position or light that cannot be.
    pub fn truth(&self, file: &str, time_s: f64) -> Result<Truth, SceneError> {
        let globe = Globe::of(&self.body);
        let raised = globe.raised(self.body.limb_height_km * 1e3);
        let cone = LimbCone::try_new(self.pose.position_m, raised.a_m, raised.b_m).ok_or(SceneError::Pose)?;
        let ecef_to_cam = self.pose.cam_to_ecef().ok_or(SceneError::Pose)?.inverse();
        let [axis_x, axis_y, axis_z] = ecef_to_cam.apply(&cone.axis).xyz();
        let sun = match self.light {
            Light::Sun { direction, .. } => {
                let direction = UnitVec3::<Ecef, f64>::try_new(direction).ok_or(SceneError::Sun)?;
                Some(ecef_to_cam.apply(&direction).xyz())
            }
            Light::Full | Light::Sector { .. } => None,
        };
        let [qw, qx, qy, qz] = self.pose.unit_quaternion_wxyz();
        Ok(Truth {
            file: file.to_owned(),
            time_s,
            body: name(self.body.kind).to_owned(),
            limb: u8::from(self.visible_limb_px()? >= LIMB_IN_VIEW_PX),
            axis_x,
            axis_y,
            axis_z,
            half_angle_deg: cone.mean_half_angle_rad().to_degrees(),
            altitude_km: globe.altitude_m(self.pose.position_m) * 1e-3,
            sun_x: sun.map(|s| s[0]),
            sun_y: sun.map(|s| s[1]),
            sun_z: sun.map(|s| s[2]),
            qw,
            qx,
            qy,
            qz,
            ..Truth::default()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose::{Look, Pose, position_m};
    use hzn_core::camera::{Config, Model};

    fn scene(look: Look) -> Scene {
        Scene::new(Config::ideal(Model::Pinhole, 640, 480, 400.0), Pose::looking(position_m(0.0, 0.0, 200.0), look))
    }

    #[test]
    fn straight_down_at_the_equator() {
        let t = scene(Look::off_nadir(0.0, 0.0, 0.0)).truth("a.png", 1.5).unwrap();
        assert!((t.axis_z - 1.0).abs() < 1e-12 && (t.altitude_km - 200.0).abs() < 1e-6);
        assert_eq!((t.limb, t.body.as_str(), t.file.as_str(), t.time_s), (0, "earth", "a.png", 1.5));
        // sin α = (R + 10 km)/(R + 200 km) with a radius between the two of the ellipsoid's curvature.
        let alpha = |r: f64| ((r + 10.0) / (r + 200.0)).asin().to_degrees();
        assert!(t.half_angle_deg > alpha(6330.0) && t.half_angle_deg < alpha(6380.0));
    }

    #[test]
    fn level_camera_sees_the_limb_and_the_axis_below() {
        let t = scene(Look { depression_rad: 0.2, ..Look::default() }).truth("", 0.0).unwrap();
        assert!(t.has_limb() && t.axis_y > 0.97 && t.axis_z > 0.19 && t.sun_x.is_none());
        // Looking up, there is none.
        assert!(!scene(Look { depression_rad: -0.8, ..Look::default() }).truth("", 0.0).unwrap().has_limb());
    }

    #[test]
    fn an_unlit_limb_does_not_count() {
        let mut s = scene(Look { depression_rad: 0.2, ..Look::default() });
        s.light = Light::Sun { direction: [-1.0, 0.0, 0.0], twilight_rad: 0.1 };
        let t = s.truth("", 0.0).unwrap();
        assert!(!t.has_limb() && t.sun_y.is_some_and(|y| y > 0.97));
    }
}
