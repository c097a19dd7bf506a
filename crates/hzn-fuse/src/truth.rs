//! The errors of a solution against the truth of a simulated flight.

use std::path::Path;

use hzn_files::separator_hint;
use hzn_files::vehicle::VehicleRow;
use hzn_nav::frames::{Fixed, Rotation, Vector, Vehicle};
use nalgebra::{Quaternion, UnitQuaternion};

use crate::error::Error;
use crate::results::Epoch;

/// The error of one solution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Miss {
    /// Time, s.
    pub time_s: f64,
    /// Error of the attitude: rotation vector from the solution to the truth, rad.
    pub attitude_rad: Vector<Vehicle>,
    /// Its square over its covariance; 3 on average.
    pub nees: f64,
    /// Error of the position, m.
    pub position_m: Vector<Fixed>,
}

/// Reads a vehicle.csv of `hzn simulate`.
///
/// # Errors
/// The file cannot be read, or is not a vehicle.csv.
pub fn read(path: &Path) -> Result<Vec<VehicleRow>, Error> {
    let named = |e: csv::Error, hint: &str| {
        Error::unusable(format!("{}: {e}; a vehicle.csv is expected{hint}", path.display()))
    };
    let mut reader = csv::Reader::from_path(path).map_err(|e| named(e, ""))?;
    let hint = separator_hint(reader.headers().map_err(|e| named(e, ""))?);
    reader.deserialize().collect::<Result<_, _>>().map_err(|e| named(e, &hint))
}

/// Returns the errors of all solutions that have a truth less than 0.2 s before and after them.
pub fn compare(epochs: &[Epoch], truth: &[VehicleRow]) -> Vec<Miss> {
    epochs.iter().filter_map(|epoch| miss(epoch, truth)).collect()
}

fn miss(epoch: &Epoch, truth: &[VehicleRow]) -> Option<Miss> {
    let time_s = epoch.state.time_s;
    let next = truth.partition_point(|row| row.time_s < time_s);
    let b = truth.get(next)?;
    let a = if b.time_s - time_s < 1e-9 { b } else { truth.get(next.checked_sub(1)?)? };
    if b.time_s - a.time_s > 0.4 {
        return None;
    }
    let part = if b.time_s > a.time_s { (time_s - a.time_s) / (b.time_s - a.time_s) } else { 0.0 };
    let q = |r: &VehicleRow| UnitQuaternion::from_quaternion(Quaternion::new(r.qw, r.qx, r.qy, r.qz));
    let x = |r: &VehicleRow| Vector::new(r.x_m, r.y_m, r.z_m);
    let v = |r: &VehicleRow| Vector::new(r.vx_mps, r.vy_mps, r.vz_mps);
    let dt = b.time_s - a.time_s;
    // Hermite's cubic for the position: the vehicle falls.
    let (s2, s3) = (part * part, part * part * part);
    let position = x(a) * (2.0 * s3 - 3.0 * s2 + 1.0)
        + v(a) * ((s3 - 2.0 * s2 + part) * dt)
        + x(b) * (3.0 * s2 - 2.0 * s3)
        + v(b) * ((s3 - s2) * dt);
    let attitude = Rotation::<Vehicle, Fixed>::from(q(a).slerp(&q(b), part));
    let error = (epoch.state.attitude.inverse() * attitude).scaled_axis();
    let information = epoch.attitude_covariance_rad2.as_inner().try_inverse();
    let nees = information.map_or(f64::NAN, |p| error.as_inner().dot(&(p * error.as_inner())));
    Some(Miss { time_s, attitude_rad: error, nees, position_m: position - epoch.state.position_m })
}
