//! The truth about one picture: a row of truth.csv.

use hzn_core::frames::{Cam, UnitVec3};
use serde::{Deserialize, Serialize};

/// The truth about one picture; the fields are the columns of truth.csv, in their order.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Truth {
    /// Name of the picture's file, without its folder.
    pub file: String,
    /// Time in seconds.
    #[serde(default = "missing")]
    pub time_s: f64,
    /// The body's kind as in sensor.toml.
    pub body: String,
    /// 1 if enough of the lit limb is in view and nothing hides it, else 0. Enough is the smallest of 50 px, a quarter
    /// of the outline, and half of the picture's shorter side (`Scene::has_limb` of hzn-sim).
    pub limb: u8,
    /// Limb axis in the camera frame, first component of the unit vector. For spheres it is the direction to the
    /// centre.
    pub axis_x: f64,
    /// Second component of the axis.
    pub axis_y: f64,
    /// Third component of the axis.
    pub axis_z: f64,
    /// Half-angle of the limb's cone in degrees. For an ellipsoid, its cot² is the mean of the cot² of the two
    /// principal half-angles.
    pub half_angle_deg: f64,
    /// Altitude of the camera above the surface in kilometres (geodetic for `earth`).
    #[serde(default = "missing")]
    pub altitude_km: f64,
    /// Direction to the Sun in the camera frame, first component of the unit vector; empty if the scene has no Sun.
    pub sun_x: Option<f64>,
    /// Second component of the direction to the Sun.
    pub sun_y: Option<f64>,
    /// Third component of the direction to the Sun.
    pub sun_z: Option<f64>,
    /// Direction to the Moon in the camera frame, first component of the unit vector; empty if the scene has no Moon.
    pub moon_x: Option<f64>,
    /// Second component of the direction to the Moon.
    pub moon_y: Option<f64>,
    /// Third component of the direction to the Moon.
    pub moon_z: Option<f64>,
    /// Attitude as a quaternion from camera to ECEF (to body-fixed axes for an ellipsoid): scalar part.
    #[serde(default = "missing")]
    pub qw: f64,
    /// First vector component of the attitude.
    #[serde(default = "missing")]
    pub qx: f64,
    /// Second vector component of the attitude.
    #[serde(default = "missing")]
    pub qy: f64,
    /// Third vector component of the attitude.
    #[serde(default = "missing")]
    pub qz: f64,
    /// Vector from the camera to the centre of the body in the camera frame, first component, kilometres; empty in
    /// files of older versions.
    #[serde(default)]
    pub position_x_km: Option<f64>,
    /// Second component of the vector to the centre.
    #[serde(default)]
    pub position_y_km: Option<f64>,
    /// Third component of the vector to the centre.
    #[serde(default)]
    pub position_z_km: Option<f64>,
    /// Angle between the directions from the body to the Sun and to the camera, degrees: 0 is a full disc. Empty for
    /// the Sun itself, if the scene has no Sun, and in files of older versions.
    #[serde(default)]
    pub phase_deg: Option<f64>,
}

/// The value of a number whose column is missing.
fn missing() -> f64 {
    f64::NAN
}

impl Truth {
    /// Returns the limb axis in the camera frame; `None` if the row holds no direction.
    pub fn axis(&self) -> Option<UnitVec3<Cam, f64>> {
        UnitVec3::try_new([self.axis_x, self.axis_y, self.axis_z])
    }
    /// Returns the vector from the camera to the centre of the body in the camera frame, kilometres.
    pub fn position_km(&self) -> Option<[f64; 3]> {
        Some([self.position_x_km?, self.position_y_km?, self.position_z_km?])
    }
    /// Returns the same row with the vector to the centre, and with the phase that follows from the Sun in the row.
    #[must_use]
    pub fn with_position_km(self, [x, y, z]: [f64; 3]) -> Self {
        let range = (x * x + y * y + z * z).sqrt();
        let phase_deg = self.sun_x.zip(self.sun_y).zip(self.sun_z).map(|((sx, sy), sz)| {
            let cos = -(x * sx + y * sy + z * sz) / range;
            libm::acos(cos.clamp(-1.0, 1.0)).to_degrees()
        });
        Self { position_x_km: Some(x), position_y_km: Some(y), position_z_km: Some(z), phase_deg, ..self }
    }
    /// Returns true if the picture shows enough limb for an answer.
    pub fn has_limb(&self) -> bool {
        self.limb != 0
    }
}
