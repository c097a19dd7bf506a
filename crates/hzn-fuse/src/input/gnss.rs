//! Positions and velocities of a satellite navigation receiver: a table (gnss.csv), NMEA 0183, or an orbit (OEM).

use std::path::Path;

use nalgebra::{Matrix3, Vector3};

use super::columns::GNSS;
use super::fix::{Fix, Receiver, ecef_m};
use super::map::Map;
use super::nmea;
use super::oem;
use super::table::Table;
use crate::error::Error;

/// Reads the file of a receiver.
///
/// A table has the columns `time_s` and either `x_m`, `y_m`, `z_m` (ECEF) or `lat_deg`, `lon_deg`, `height_m` (WGS-84,
/// the height above the ellipsoid), or those that the map names. It may have velocities: `vx_mps`, `vy_mps`, `vz_mps`
/// (ECEF), or `v_north_mps`, `v_east_mps` and `v_down_mps` or `v_up_mps`. It may have sigmas: `position_sigma_m`,
/// `velocity_sigma_mps`, or `horizontal_sigma_m` and `vertical_sigma_m`, of which the larger one counts.
///
/// A file that begins with `$` is NMEA 0183, with the sentences GGA or GNS. The date is that of RMC or ZDA. Times are
/// counted from `utc_unix_s`, the UTC of time 0 in seconds since 1970; without it they are those seconds themselves.
///
/// A file that begins with `CCSDS_OEM_VERS` is an orbit ephemeris message in keyword = value notation, in a frame that
/// turns with the Earth. Its times count from `utc_unix_s`, too, and its covariances are the sigmas. States that are at
/// most two minutes apart are filled in.
///
/// # Errors
/// The file cannot be read, a column is missing or there twice, a cell is not a number, or a latitude or longitude is
/// impossible; no sentence has a position; the message is XML, in another frame, or damaged.
///
/// ```
/// use hzn_fuse::input::{Map, gnss};
///
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("gnss.csv");
/// std::fs::write(&path, "time_s,lat_deg,lon_deg,height_m\n0,0,90,1000\n")?;
/// let fix = gnss(&path, &Map::default(), None)?.fixes[0];
/// assert!((fix.position_m.xyz()[1] - 6_379_137.0).abs() < 1e-3);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn gnss(path: &Path, map: &Map, utc_unix_s: Option<f64>) -> Result<Receiver, Error> {
    if nmea::is_nmea(path)? {
        if map.has(GNSS.table) {
            let what = "is NMEA 0183, which has no columns: leave out --map gnss:...";
            return Err(Error::unusable(format!("{}: {what}", path.display())));
        }
        return nmea::read(path, utc_unix_s);
    }
    if oem::is_oem(path)? {
        if map.has(GNSS.table) {
            let what = "is a message of CCSDS, which has no columns: leave out --map gnss:...";
            return Err(Error::unusable(format!("{}: {what}", path.display())));
        }
        return oem::read(path, utc_unix_s);
    }
    let table = Table::read(path, &GNSS, map)?;
    table.require(&["time"])?;
    let ecef = ["x", "y", "z"].iter().any(|q| table.has(q));
    let mut notes = Vec::new();
    if !ecef && !["lat", "lon", "height"].iter().any(|q| table.has(q)) {
        let what = "has no position: x_m, y_m, z_m (ECEF) or lat_deg, lon_deg, height_m (WGS-84)";
        let how = "--map gnss:lat=COLUMN says which column is the latitude, and so on";
        return Err(table.refused(format!("{what}; the file has {}; {how}", table.header())));
    }
    table.require(if ecef { &["x", "y", "z"] } else { &["lat", "lon", "height"] })?;
    let places = if ecef { table.rows(["x", "y", "z"]).map(Vector3::from).collect() } else { geodetic(&table)? };
    let velocities = velocities(&table, ecef)?;
    if velocities.is_none() {
        notes.push(format!(
            "{}: there are no velocities; the one at the start comes from the differences of positions",
            path.display()
        ));
    }
    let sigmas = table.rows(["time", "position_sigma", "velocity_sigma", "horizontal_sigma", "vertical_sigma"]);
    let fix = |(row, [time_s, position, velocity, horizontal, vertical]): (usize, [f64; 5])| Fix {
        time_s,
        position_m: places.get(row).copied().unwrap_or_else(nowhere).into(),
        velocity_m_s: velocities.as_ref().and_then(|all| all.get(row)).copied().unwrap_or_else(nowhere).into(),
        // One sigma for all axes: the largest, so that no axis is too sure. `max` leaves out NaN.
        position_sigma_m: position.max(horizontal).max(vertical),
        velocity_sigma_m_s: velocity,
    };
    Ok(Receiver { fixes: sigmas.enumerate().map(fix).collect(), notes })
}

fn nowhere() -> Vector3<f64> {
    Vector3::repeat(f64::NAN)
}

/// Returns the positions of latitudes, longitudes and heights; not finite where a cell is empty.
fn geodetic(table: &Table) -> Result<Vec<Vector3<f64>>, Error> {
    let place = |(row, [lat, lon, height]): (usize, [f64; 3])| {
        if lat.abs() > 90.0 || lon.abs() > 360.0 {
            let what = "is no latitude and longitude in degrees; --map gnss:lat=COLUMN,rad gives another unit";
            return Err(table.refused_row(row, format!("{lat}, {lon} {what}")));
        }
        Ok(ecef_m(lat, lon, height))
    };
    table.rows(["lat", "lon", "height"]).enumerate().map(place).collect()
}

/// Returns the velocities in ECEF; `None` if the file has none.
fn velocities(table: &Table, ecef: bool) -> Result<Option<Vec<Vector3<f64>>>, Error> {
    if ["vx", "vy", "vz"].iter().any(|q| table.has(q)) {
        table.require(&["vx", "vy", "vz"])?;
        return Ok(Some(table.rows(["vx", "vy", "vz"]).map(Vector3::from).collect()));
    }
    if !["v_north", "v_east", "v_down", "v_up"].iter().any(|q| table.has(q)) {
        return Ok(None);
    }
    if ecef {
        let what = "velocities to north, east and down need lat_deg, lon_deg and height_m instead of x_m, y_m, z_m";
        return Err(table.refused(what));
    }
    let is_up = table.has("v_up") && !table.has("v_down");
    table.require(&["v_north", "v_east", if is_up { "v_up" } else { "v_down" }])?;
    let velocity = |[lat, lon, north, east, down, up]: [f64; 6]| {
        let ((sf, cf), (sl, cl)) = (lat.to_radians().sin_cos(), lon.to_radians().sin_cos());
        // Columns: north, east, down.
        let turn = Matrix3::new(-sf * cl, -sl, -cf * cl, -sf * sl, cl, -cf * sl, cf, 0.0, -sf);
        turn * Vector3::new(north, east, if is_up { -up } else { down })
    };
    Ok(Some(table.rows(["lat", "lon", "v_north", "v_east", "v_down", "v_up"]).map(velocity).collect()))
}
