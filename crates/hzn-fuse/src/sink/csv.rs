//! Results as tables.

use std::io::Write;

use super::record::{StateRecord, innovations, states};
use crate::error::Error;
use crate::results::Fused;

/// Writes the solutions as CSV: the numbers of a [`StateRecord`], with one column for each axis and camera.
///
/// # Errors
/// The output cannot be written.
pub fn write_states(fused: &Fused, out: impl Write) -> Result<(), Error> {
    let mut out = csv::Writer::from_writer(out);
    out.write_record(header(fused)).map_err(Error::failed)?;
    for state in states(fused) {
        out.write_record(cells(fused, &state)).map_err(Error::failed)?;
    }
    out.flush().map_err(Error::failed)
}

/// Writes the innovations as CSV.
///
/// # Errors
/// The output cannot be written.
pub fn write_innovations(fused: &Fused, out: impl Write) -> Result<(), Error> {
    let mut out = csv::Writer::from_writer(out);
    innovations(fused).try_for_each(|record| out.serialize(record)).map_err(Error::failed)?;
    out.flush().map_err(Error::failed)
}

/// The columns of a state that are not those of a camera or of three axes.
const SINGLE: [&str; 20] = [
    "time_s",
    "phase",
    "qw",
    "qx",
    "qy",
    "qz",
    "sigma_x_deg",
    "sigma_y_deg",
    "sigma_z_deg",
    "yaw_deg",
    "pitch_deg",
    "roll_deg",
    "x_m",
    "y_m",
    "z_m",
    "vx_mps",
    "vy_mps",
    "vz_mps",
    "position_sigma_m",
    "velocity_sigma_mps",
];

fn header(fused: &Fused) -> Vec<String> {
    let mut names: Vec<String> = SINGLE.map(str::to_owned).into();
    let mut three =
        |begin: &str, unit: &str| names.extend(["x", "y", "z"].map(|axis| format!("{begin}_{axis}_{unit}")));
    three("gyro_bias", "deg_h");
    three("gyro_bias_sigma", "deg_h");
    three("accel_bias", "mps2");
    three("accel_bias_sigma", "mps2");
    names.extend(["limb_height_km", "limb_height_sigma_km"].map(str::to_owned));
    names.extend(["limb_latitude_1_km", "limb_latitude_2_km"].map(str::to_owned));
    names.extend(["limb_latitude_sigma_1_km", "limb_latitude_sigma_2_km"].map(str::to_owned));
    for name in &fused.cameras {
        let mut three = |begin: &str| names.extend(["x", "y", "z"].map(|axis| format!("{name}_{begin}_{axis}_deg")));
        three("misalignment");
        three("misalignment_sigma");
        names.extend(["clock_s", "clock_sigma_s"].map(|what| format!("{name}_{what}")));
    }
    names
}

fn cells(fused: &Fused, s: &StateRecord) -> Vec<String> {
    let phase = serde_json::to_value(s.phase).ok().and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default();
    let number = |x: f64| x.to_string();
    let maybe = |x: Option<f64>| x.map(|x| x.to_string()).unwrap_or_default();
    let mut out = vec![number(s.time_s), phase];
    out.extend([s.qw, s.qx, s.qy, s.qz].map(number));
    out.extend([s.sigma_x_deg, s.sigma_y_deg, s.sigma_z_deg].map(maybe));
    out.extend([s.yaw_deg, s.pitch_deg, s.roll_deg, s.x_m, s.y_m, s.z_m, s.vx_mps, s.vy_mps, s.vz_mps].map(number));
    out.extend([s.position_sigma_m, s.velocity_sigma_mps].map(maybe));
    for three in [s.gyro_bias_deg_h, s.gyro_bias_sigma_deg_h, s.accel_bias_mps2, s.accel_bias_sigma_mps2] {
        out.extend([0, 1, 2].map(|i| maybe(three.map(|x| x[i]))));
    }
    out.extend([s.limb_height_km, s.limb_height_sigma_km].map(maybe));
    for two in [s.limb_latitude_km, s.limb_latitude_sigma_km] {
        out.extend([0, 1].map(|i| maybe(two.map(|x| x[i]))));
    }
    for camera in 0..fused.cameras.len() {
        let camera = s.cameras.get(camera);
        out.extend([0, 1, 2].map(|i| maybe(camera.map(|c| c.misalignment_deg[i]))));
        out.extend([0, 1, 2].map(|i| maybe(camera.map(|c| c.misalignment_sigma_deg[i]))));
        out.extend([maybe(camera.map(|c| c.clock_s)), maybe(camera.map(|c| c.clock_sigma_s))]);
    }
    out
}
