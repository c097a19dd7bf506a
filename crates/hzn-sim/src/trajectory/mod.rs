//! Position and attitude of the vehicle over time in the Earth-fixed frame, and the signals of its sensors.
//!
//! | module | content |
//! |---|---|
//! | `rocket` | a sounding rocket: two stages, then free fall |
//! | `orbit` | Kepler's ellipse |
//! | `table` | positions and attitudes from a CSV file |
//! | `attitude` | the rotation of the vehicle |
//! | [`instruments`] | gyroscopes, accelerometers, satellite navigation receiver |

mod attitude;
pub mod instruments;
mod orbit;
mod rocket;
mod table;

pub use attitude::{Attitude, Pointing, Spin, Towards, Tumble};
pub use orbit::Orbit;
pub use rocket::Rocket;
pub use table::Table;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::pose::Pose;
use hzn_nav::ephemeris;

/// Gravitational parameter of the Earth, m³/s² (WGS-84).
pub(crate) const MU: f64 = 3.986_004_418e14;
/// Rotation rate of the Earth, rad/s (WGS-84).
pub(crate) const EARTH_RATE: f64 = 7.292_115e-5;

/// The trajectory of the vehicle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Trajectory {
    /// A sounding rocket; time 0 is lift-off.
    Rocket(Rocket),
    /// An orbit of the Earth.
    Orbit(Orbit),
    /// Rows of a CSV file.
    Table(Table),
}

/// The vehicle at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// Position in ECEF, metres.
    pub position_m: Vector3<f64>,
    /// Velocity relative to the rotating Earth, in ECEF, m/s.
    pub velocity_mps: Vector3<f64>,
    /// Acceleration by all forces except gravity, in ECEF, m/s².
    pub specific_force_mps2: Vector3<f64>,
    /// Rotation from vehicle axes to ECEF.
    pub body_to_ecef: UnitQuaternion<f64>,
    /// Rate of the vehicle relative to inertial space, in vehicle axes, rad/s.
    pub rate_radps: Vector3<f64>,
}

/// A point of the trajectory, all vectors in ECEF; the velocity is relative to the rotating Earth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Point {
    pub(crate) position_m: Vector3<f64>,
    pub(crate) velocity_mps: Vector3<f64>,
    pub(crate) specific_force_mps2: Vector3<f64>,
}

/// Converts a vector from inertial axes to ECEF, by Greenwich sidereal time.
pub(crate) fn to_ecef(sidereal_rad: f64, v: &Vector3<f64>) -> Vector3<f64> {
    let (s, c) = libm::sincos(sidereal_rad);
    Vector3::new(c * v.x + s * v.y, c * v.y - s * v.x, v.z)
}

/// Converts a vector from ECEF to inertial axes; the inverse of [`to_ecef`].
pub(crate) fn from_ecef(sidereal_rad: f64, v: &Vector3<f64>) -> Vector3<f64> {
    to_ecef(-sidereal_rad, v)
}

/// A trajectory, prepared for evaluation.
#[derive(Debug, Clone)]
enum PreparedTrajectory {
    Rocket(rocket::Ascent),
    Orbit(orbit::Ellipse),
    Table(table::TableRows),
}

/// A flight: trajectory and attitude, prepared for evaluation.
#[derive(Debug, Clone)]
pub struct Path {
    way: PreparedTrajectory,
    turn: attitude::PreparedAttitude,
    camera_to_body: UnitQuaternion<f64>,
    start_unix_s: f64,
}

/// Half of the interval over which two attitudes are differenced to get a rate, seconds.
const RATE_STEP_S: f64 = 1e-3;

impl Path {
    /// Prepares a flight that lasts to `to_s`. `start_unix_s` is the UTC of time 0, in seconds since 1970.
    ///
    /// # Errors
    /// Returns the key with the invalid value, and a message.
    pub fn try_new(
        trajectory: &Trajectory,
        attitude: &Attitude,
        camera_to_body_wxyz: [f64; 4],
        [from_s, to_s]: [f64; 2],
        start_unix_s: f64,
        seed: u64,
    ) -> Result<Self, (String, String)> {
        let way = match trajectory {
            Trajectory::Rocket(rocket) => {
                PreparedTrajectory::Rocket(rocket::Ascent::try_new(rocket, to_s, start_unix_s)?)
            }
            Trajectory::Orbit(orbit) => PreparedTrajectory::Orbit(orbit::Ellipse::try_new(orbit, start_unix_s)?),
            Trajectory::Table(table) => PreparedTrajectory::Table(table.rows([from_s, to_s])?),
        };
        let [w, x, y, z] = camera_to_body_wxyz;
        let camera_to_body = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        let mut path = Self { way, turn: attitude::PreparedAttitude::Table, camera_to_body, start_unix_s };
        path.turn = attitude::PreparedAttitude::try_new(attitude, &path, [from_s, to_s], seed)?;
        Ok(path)
    }

    /// Returns UTC in seconds since 1970.
    pub fn unix_s(&self, time_s: f64) -> f64 {
        self.start_unix_s + time_s
    }

    pub(crate) fn sidereal_rad(&self, time_s: f64) -> f64 {
        ephemeris::sidereal_rad(self.unix_s(time_s))
    }

    pub(crate) fn point(&self, time_s: f64) -> Point {
        match &self.way {
            PreparedTrajectory::Rocket(ascent) => ascent.point(time_s),
            PreparedTrajectory::Orbit(ellipse) => ellipse.point(time_s),
            PreparedTrajectory::Table(rows) => rows.point(time_s),
        }
    }

    fn body_to_ecef(&self, time_s: f64) -> UnitQuaternion<f64> {
        match (&self.turn, &self.way) {
            (attitude::PreparedAttitude::Table, PreparedTrajectory::Table(rows)) => {
                rows.camera_to_ecef(time_s) * self.camera_to_body.inverse()
            }
            _ => self.turn.body_to_ecef(self, time_s),
        }
    }

    /// Returns the state of the vehicle at a time in seconds.
    pub fn state(&self, time_s: f64) -> State {
        let Point { position_m, velocity_mps, specific_force_mps2 } = self.point(time_s);
        let body_to_ecef = self.body_to_ecef(time_s);
        let [before, after] = [-RATE_STEP_S, RATE_STEP_S].map(|d| self.body_to_ecef(time_s + d));
        let against_earth = (before.inverse() * after).scaled_axis() / (2.0 * RATE_STEP_S);
        let earth = body_to_ecef.inverse_transform_vector(&Vector3::new(0.0, 0.0, EARTH_RATE));
        State { position_m, velocity_mps, specific_force_mps2, body_to_ecef, rate_radps: against_earth + earth }
    }

    /// Returns the camera's pose at a time in seconds.
    pub fn camera(&self, time_s: f64) -> Pose {
        let q = self.body_to_ecef(time_s) * self.camera_to_body;
        Pose { position_m: self.point(time_s).position_m.into(), cam_to_ecef_wxyz: [q.w, q.i, q.j, q.k] }
    }

    /// Returns the rate of the camera relative to ECEF, in the camera frame, rad/s. This rate blurs a picture.
    pub fn camera_rate_radps(&self, time_s: f64) -> [f64; 3] {
        let [before, after] = [-RATE_STEP_S, RATE_STEP_S].map(|d| self.body_to_ecef(time_s + d));
        let body = (before.inverse() * after).scaled_axis() / (2.0 * RATE_STEP_S);
        self.camera_to_body.inverse_transform_vector(&body).into()
    }
}

/// Returns the gravitational acceleration in m/s², from the central field and the Earth's flattening (J2). The
/// centrifugal acceleration is not included.
pub(crate) fn gravity(position_m: &Vector3<f64>) -> Vector3<f64> {
    const J2: f64 = 1.082_629_8e-3;
    const A: f64 = hzn_core::ellipsoid::WGS84_A_M;
    let r2 = position_m.norm_squared();
    let r = r2.sqrt();
    let z2 = position_m.z * position_m.z / r2;
    let k = 1.5 * J2 * (A * A) / r2;
    let side = 1.0 + k * (1.0 - 5.0 * z2);
    let pole = 1.0 + k * (3.0 - 5.0 * z2);
    -MU / (r2 * r) * Vector3::new(side * position_m.x, side * position_m.y, pole * position_m.z)
}
