//! A point of a trajectory.

use nalgebra::Vector3;

/// A point of the trajectory, all vectors in ECEF; the velocity is relative to the rotating Earth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Point {
    pub(crate) position_m: Vector3<f64>,
    pub(crate) velocity_mps: Vector3<f64>,
    pub(crate) specific_force_mps2: Vector3<f64>,
}
