//! The truth about a simulated vehicle: a row of vehicle.csv.

use serde::{Deserialize, Serialize};

/// A row of vehicle.csv: the true state of the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct VehicleRow {
    /// Time in seconds.
    pub time_s: f64,
    /// First component of the position in ECEF, metres.
    pub x_m: f64,
    /// Second component of the position.
    pub y_m: f64,
    /// Third component of the position.
    pub z_m: f64,
    /// First component of the velocity relative to the Earth in ECEF, m/s.
    pub vx_mps: f64,
    /// Second component of the velocity.
    pub vy_mps: f64,
    /// Third component of the velocity.
    pub vz_mps: f64,
    /// Attitude as a quaternion from the vehicle's axes to ECEF, scalar part.
    pub qw: f64,
    /// First vector component of the attitude.
    pub qx: f64,
    /// Second vector component of the attitude.
    pub qy: f64,
    /// Third vector component of the attitude.
    pub qz: f64,
}
