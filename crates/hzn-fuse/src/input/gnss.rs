//! gnss.csv: positions and velocities of a satellite navigation receiver.

use std::path::Path;

use hzn_nav::frames::{Fixed, Vector};

use super::table::Table;
use crate::error::Error;

/// A fix of the receiver; the velocity is relative to the Earth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fix {
    /// Time, s.
    pub time_s: f64,
    /// Position, m.
    pub position_m: Vector<Fixed>,
    /// Velocity, m/s; not finite if there is none.
    pub velocity_m_s: Vector<Fixed>,
    /// 1-sigma of each component of the position, m; NaN if the file does not have it.
    pub position_sigma_m: f64,
    /// 1-sigma of each component of the velocity, m/s; NaN if the file does not have it.
    pub velocity_sigma_m_s: f64,
}

const NAMES: [&str; 9] =
    ["time_s", "x_m", "y_m", "z_m", "vx_mps", "vy_mps", "vz_mps", "position_sigma_m", "velocity_sigma_mps"];

/// Reads a gnss.csv with the columns `time_s`, `x_m`, `y_m`, `z_m` and, if there are some, `vx_mps`, `vy_mps`,
/// `vz_mps`, `position_sigma_m`, `velocity_sigma_mps`.
///
/// # Errors
/// The file cannot be read, a column is missing, or a cell is not a number.
pub fn gnss(path: &Path) -> Result<Vec<Fix>, Error> {
    let table = Table::read(path, &NAMES, 4)?;
    if (4..7).any(|i| table.has(i)) && !(4..7).all(|i| table.has(i)) {
        let what = "of the columns vx_mps, vy_mps, vz_mps some are missing: give all three or none";
        return Err(Error::unusable(format!("{}: {what}", path.display())));
    }
    let fix = |row: &[f64]| {
        let [time_s, x, y, z, vx, vy, vz, position_sigma_m, velocity_sigma_m_s] =
            row.try_into().unwrap_or([f64::NAN; 9]);
        Fix {
            time_s,
            position_m: Vector::new(x, y, z),
            velocity_m_s: Vector::new(vx, vy, vz),
            position_sigma_m,
            velocity_sigma_m_s,
        }
    };
    Ok(table.rows().map(fix).collect())
}
