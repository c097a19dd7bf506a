//! imu.csv: the samples of an inertial measurement unit.

use std::path::Path;

use hzn_nav::frames::Vector;
use hzn_nav::strapdown::Imu;

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

const NAMES: [&str; 8] = [
    "time_s",
    "gyro_x_radps",
    "gyro_y_radps",
    "gyro_z_radps",
    "accel_x_mps2",
    "accel_y_mps2",
    "accel_z_mps2",
    "saturated",
];

/// Reads an imu.csv with the columns `time_s`, `gyro_{x,y,z}_radps`, `accel_{x,y,z}_mps2` and, if there is one,
/// `saturated` (0 or 1).
///
/// # Errors
/// The file cannot be read, a column is missing, or a cell is not a number.
///
/// ```
/// # let folder = tempfile::tempdir()?;
/// let path = folder.path().join("imu.csv");
/// let columns = "time_s,gyro_x_radps,gyro_y_radps,gyro_z_radps,accel_x_mps2,accel_y_mps2,accel_z_mps2\n";
/// std::fs::write(&path, columns.to_owned() + "0.00,0,0,0.1,9.8,0,0\n0.01,0,0,0.1,9.8,0,0\n")?;
/// let samples = hzn_fuse::input::imu(&path)?;
/// assert_eq!((samples.len(), samples[1].imu.time_s, samples[1].saturated), (2, 0.01, false));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn imu(path: &Path) -> Result<Vec<Sample>, Error> {
    let table = Table::read(path, &NAMES, 7)?;
    let sample = |row: &[f64]| {
        let [time_s, gx, gy, gz, ax, ay, az, saturated] = row.try_into().unwrap_or([f64::NAN; 8]);
        let imu = Imu { time_s, gyro_rad_s: Vector::new(gx, gy, gz), accel_m_s2: Vector::new(ax, ay, az) };
        Sample { imu, saturated: saturated > 0.5 }
    };
    Ok(table.rows().map(sample).collect())
}
