//! Attitudes of a star tracker.

use std::path::Path;

use hzn_nav::frames::{Fixed, Rotation, Vehicle};

use super::columns::ATTITUDE;
use super::map::Map;
use super::table::Table;
use crate::error::Error;

/// An attitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attitude {
    /// Time, s.
    pub time_s: f64,
    /// Rotation from the vehicle's frame to ECEF; `None` if the cells are not a quaternion.
    pub fixed_from_vehicle: Option<Rotation<Vehicle, Fixed>>,
    /// 1-sigma about each axis, rad.
    pub sigma_rad: f64,
}

/// Reads a table with the columns `time_s`, `qw`, `qx`, `qy`, `qz` (vehicle to ECEF) and `sigma_deg`, or those that the
/// map names.
///
/// # Errors
/// The file cannot be read, a column is missing or there twice, or a cell is not a number.
pub fn attitudes(path: &Path, map: &Map) -> Result<Vec<Attitude>, Error> {
    let table = Table::read(path, &ATTITUDE, map)?;
    let needed = ["time", "qw", "qx", "qy", "qz", "sigma"];
    table.require(&needed)?;
    let attitude = |[time_s, w, x, y, z, sigma_deg]: [f64; 6]| {
        let fixed_from_vehicle = super::rotation([w, x, y, z]).ok();
        Attitude { time_s, fixed_from_vehicle, sigma_rad: sigma_deg.to_radians() }
    };
    Ok(table.rows(needed).map(attitude).collect())
}
