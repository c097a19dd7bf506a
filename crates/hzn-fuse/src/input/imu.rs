//! imu.csv: the samples of an inertial measurement unit.

use std::path::Path;

use hzn_nav::frames::Vector;
use hzn_nav::strapdown::Imu;

use super::columns::IMU;
use super::map::Map;
use super::table::Table;
use crate::error::Error;

/// A sample of the inertial unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Rates and specific forces.
    pub imu: Imu,
    /// Whether a channel was at its limit.
    pub saturated: bool,
}

/// Reads an imu.csv with the columns `time_s`, `gyro_{x,y,z}_radps`, `accel_{x,y,z}_mps2` and, if there is one,
/// `saturated` (0 or 1), or those that the map names.
///
/// # Errors
/// The file cannot be read, a column is missing or there twice, or a cell is not a number.
///
/// ```
/// # let folder = tempfile::tempdir()?;
/// let path = folder.path().join("imu.csv");
/// let columns = "time_s,gyro_x_radps,gyro_y_radps,gyro_z_radps,accel_x_mps2,accel_y_mps2,accel_z_mps2\n";
/// std::fs::write(&path, columns.to_owned() + "0.00,0,0,0.1,9.8,0,0\n0.01,0,0,0.1,9.8,0,0\n")?;
/// let samples = hzn_fuse::input::imu(&path, &hzn_fuse::input::Map::default())?;
/// assert_eq!((samples.len(), samples[1].imu.time_s, samples[1].saturated), (2, 0.01, false));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn imu(path: &Path, map: &Map) -> Result<Vec<Sample>, Error> {
    let table = Table::read(path, &IMU, map)?;
    let needed = ["time", "gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z"];
    table.require(&needed)?;
    let saturated = table.rows(["saturated"]);
    let sample = |([time_s, gx, gy, gz, ax, ay, az], [saturated]): ([f64; 7], [f64; 1])| {
        let imu = Imu { time_s, gyro_rad_s: Vector::new(gx, gy, gz), accel_m_s2: Vector::new(ax, ay, az) };
        Sample { imu, saturated: saturated > 0.5 }
    };
    Ok(table.rows(needed).zip(saturated).map(sample).collect())
}
