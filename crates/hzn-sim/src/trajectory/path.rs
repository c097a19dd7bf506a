//! A flight: the state of the vehicle and the pose of its camera over time.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::attitude::{Attitude, PreparedAttitude};
use super::earth::EARTH_RATE;
use super::point::Point;
use super::position::{PreparedTrajectory, Trajectory};
use crate::pose::Pose;

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
    pub fixed_from_vehicle: UnitQuaternion<f64>,
    /// Rate of the vehicle relative to inertial space, in vehicle axes, rad/s.
    pub rate_radps: Vector3<f64>,
}

/// A flight: trajectory and attitude, prepared for evaluation.
#[derive(Debug, Clone)]
pub struct Path {
    trajectory: PreparedTrajectory,
    attitude: PreparedAttitude,
    /// The mount that the attitude control of the vehicle knows.
    told_to_body: UnitQuaternion<f64>,
    camera_to_body: UnitQuaternion<f64>,
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
        q_fixed_from_camera_wxyz: [f64; 4],
        [from_s, to_s]: [f64; 2],
        start_unix_s: f64,
        seed: u64,
    ) -> Result<Self, (String, String)> {
        let trajectory = PreparedTrajectory::try_new(trajectory, [from_s, to_s], start_unix_s, seed)?;
        let attitude = PreparedAttitude::try_new(attitude, &trajectory, [from_s, to_s], seed)?;
        let [w, x, y, z] = q_fixed_from_camera_wxyz;
        let camera_to_body = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        Ok(Self { trajectory, attitude, told_to_body: camera_to_body, camera_to_body })
    }

    /// Returns the same flight of the vehicle with a camera that is mounted like this.
    #[must_use]
    pub fn with_camera(mut self, [w, x, y, z]: [f64; 4]) -> Self {
        self.camera_to_body = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        self
    }

    /// Returns UTC in seconds since 1970.
    pub fn unix_s(&self, time_s: f64) -> f64 {
        self.trajectory.unix_s(time_s)
    }

    /// Returns the direction to the Sun (body-fixed, unit) in an encounter; `None` for other trajectories.
    pub(crate) fn sun(&self, time_s: f64) -> Option<[f64; 3]> {
        self.trajectory.sight(time_s).map(|sight| sight.sun.into())
    }

    #[cfg(test)]
    pub(crate) fn sidereal_rad(&self, time_s: f64) -> f64 {
        self.trajectory.sidereal_rad(time_s)
    }

    pub(crate) fn point(&self, time_s: f64) -> Point {
        self.trajectory.point(time_s)
    }

    fn fixed_from_vehicle(&self, time_s: f64) -> UnitQuaternion<f64> {
        self.attitude.fixed_from_vehicle(&self.trajectory, &self.told_to_body, time_s)
    }

    /// Returns the state of the vehicle at a time in seconds.
    pub fn state(&self, time_s: f64) -> State {
        let Point { position_m, velocity_mps, specific_force_mps2 } = self.point(time_s);
        let fixed_from_vehicle = self.fixed_from_vehicle(time_s);
        let earth = fixed_from_vehicle.inverse_transform_vector(&Vector3::new(0.0, 0.0, EARTH_RATE));
        let rate_radps = self.rate_against_earth_radps(time_s) + earth;
        State { position_m, velocity_mps, specific_force_mps2, fixed_from_vehicle, rate_radps }
    }

    /// Returns the camera's pose at a time in seconds.
    pub fn camera(&self, time_s: f64) -> Pose {
        let q = self.fixed_from_vehicle(time_s) * self.camera_to_body;
        Pose { position_m: self.point(time_s).position_m.into(), q_fixed_from_camera_wxyz: [q.w, q.i, q.j, q.k] }
    }

    /// Returns the rate of the camera relative to ECEF, in the camera frame, rad/s. This rate blurs a picture.
    pub fn camera_rate_radps(&self, time_s: f64) -> [f64; 3] {
        self.camera_to_body.inverse_transform_vector(&self.rate_against_earth_radps(time_s)).into()
    }

    /// Returns the rate of the vehicle relative to ECEF, in vehicle axes, rad/s.
    pub fn vehicle_rate_radps(&self, time_s: f64) -> [f64; 3] {
        self.rate_against_earth_radps(time_s).into()
    }

    fn rate_against_earth_radps(&self, time_s: f64) -> Vector3<f64> {
        let [before, after] = [-RATE_STEP_S, RATE_STEP_S].map(|d| self.fixed_from_vehicle(time_s + d));
        (before.inverse() * after).scaled_axis() / (2.0 * RATE_STEP_S)
    }
}
