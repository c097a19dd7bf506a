//! Directions of other sensors: magnetometers, Sun sensors, antennas.

use std::collections::HashSet;
use std::path::Path;

use hzn_nav::frames::{Cam, Covariance, Fixed, Rotation, Vector};

use super::columns::DIRECTION;
use super::map::Map;
use super::recording::{Body, Recording, Seen, name_of};
use super::table::Table;
use crate::error::Error;

/// Reads a table with the columns `time_s`, the measured direction `x`, `y`, `z` along the vehicle's axes, the same
/// direction in ECEF `ref_x`, `ref_y`, `ref_z`, and `sigma_deg`, or those that the map names. Both may have any length.
/// A column `noise_deg` may have the part of the error that is new in every row; without it, that is half of the
/// variance, because a sigma does not say for how long an error stays.
///
/// The result is a recording whose camera has the vehicle's axes. Its name is that of the file without its ending.
///
/// # Errors
/// The file cannot be read, a column is missing or there twice, a cell is not a number, a sigma is not above 0, or the
/// noise is larger than it.
///
/// ```
/// use hzn_fuse::input::{Map, directions};
///
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("magnetometer.csv");
/// std::fs::write(&path, "t_ms,bx,by,bz,ref_x,ref_y,ref_z,sigma_deg\n500,0,0,-48000,0,2,0,1.5\n")?;
/// let map = Map::parse(["direction:time=t_ms,ms", "direction:measured=bx:by:bz"])?;
/// let magnetometer = directions(&path, &map)?;
/// assert_eq!((magnetometer.name.as_str(), magnetometer.seen[0].time_s), ("magnetometer", 0.5));
/// assert_eq!(magnetometer.seen[0].axis.xyz(), [0.0, 0.0, -1.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn directions(path: &Path, map: &Map) -> Result<Recording, Error> {
    let table = Table::read(path, &DIRECTION, map)?;
    let needed = ["time", "x", "y", "z", "ref_x", "ref_y", "ref_z", "sigma"];
    table.require(&needed)?;
    let mut out =
        Recording { name: name_of(path), mount: Some(Rotation::identity()), is_table: true, ..Recording::default() };
    let mut times = HashSet::new();
    let noise = table.rows(["noise"]);
    for ((row, cells), [noise_deg]) in table.rows(needed).enumerate().zip(noise) {
        let [time_s, x, y, z, ref_x, ref_y, ref_z, sigma_deg] = cells;
        if sigma_deg <= 0.0 {
            return Err(table.refused_row(row, format!("sigma_deg is {sigma_deg}: must be above 0")));
        }
        if noise_deg < 0.0 || noise_deg > sigma_deg {
            let what = format!("noise_deg is {noise_deg}: it is a part of sigma_deg, {sigma_deg}");
            return Err(table.refused_row(row, what));
        }
        let both = unit::<Cam>(x, y, z).zip(unit::<Fixed>(ref_x, ref_y, ref_z));
        let Some((axis, reference)) = both.filter(|_| sigma_deg.is_finite()) else {
            out.incomplete += 1;
            continue;
        };
        if time_s.is_nan() {
            out.without_time += 1;
        } else if times.insert(time_s.to_bits()) {
            out.seen.push(Seen {
                time_s,
                body: Body::Other,
                axis,
                covariance_rad2: Covariance::across(&axis, sigma_deg.to_radians().powi(2)),
                common_rad2: Some(Covariance::across(&axis, slow_rad2(sigma_deg, noise_deg))),
                reference: Some(reference),
                altitude_km: None,
                by_limb_height: Vector::zeros(),
                centre: None,
                cone: None,
                row,
            });
        } else {
            out.duplicate += 1;
        }
    }
    Ok(out)
}

/// Returns the variance of the error that stays from row to row, rad².
fn slow_rad2(sigma_deg: f64, noise_deg: f64) -> f64 {
    let [whole, noise] = [sigma_deg, noise_deg].map(|deg| deg.to_radians().powi(2));
    if noise.is_nan() { 0.5 * whole } else { whole - noise }
}

/// Returns a unit vector; `None` if a component is missing or all are 0.
fn unit<F>(x: f64, y: f64, z: f64) -> Option<Vector<F>> {
    Vector::new(x, y, z).try_normalize(f64::MIN_POSITIVE).filter(Vector::is_finite)
}
