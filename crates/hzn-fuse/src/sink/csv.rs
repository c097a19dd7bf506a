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
        out.write_record(cells(&state)).map_err(Error::failed)?;
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
    for (begin, unit) in [("attitude_cov", "deg2"), ("velocity_cov", "m2ps2"), ("position_cov", "m2")] {
        names.extend(["xx", "xy", "xz", "yy", "yz", "zz"].map(|axes| format!("{begin}_{axes}_{unit}")));
    }
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
        names.extend(["w", "x", "y", "z"].map(|part| format!("{name}_told_q_vehicle_from_camera_{part}")));
    }
    names.push("verdict".to_owned());
    names.extend(["qw", "qx", "qy", "qz"].map(|part| format!("unaided_{part}")));
    names.extend(["xx", "xy", "xz", "yy", "yz", "zz"].map(|axes| format!("unaided_cov_{axes}_deg2")));
    names
}

fn cells(s: &StateRecord) -> Vec<String> {
    let phase = serde_json::to_value(s.phase).ok().and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default();
    let mut numbers = vec![s.qw, s.qx, s.qy, s.qz, s.sigma_x_deg, s.sigma_y_deg, s.sigma_z_deg];
    numbers.extend([s.yaw_deg, s.pitch_deg, s.roll_deg, s.x_m, s.y_m, s.z_m, s.vx_mps, s.vy_mps, s.vz_mps]);
    numbers.extend([s.position_sigma_m, s.velocity_sigma_mps]);
    numbers.extend([s.attitude_cov_deg2, s.velocity_cov_m2ps2, s.position_cov_m2].concat());
    numbers.extend([s.gyro_bias_deg_h, s.gyro_bias_sigma_deg_h, s.accel_bias_mps2, s.accel_bias_sigma_mps2].concat());
    numbers.extend([s.limb_height_km, s.limb_height_sigma_km]);
    numbers.extend([s.limb_latitude_km, s.limb_latitude_sigma_km].concat());
    for camera in &s.cameras {
        numbers.extend([camera.misalignment_deg, camera.misalignment_sigma_deg].concat());
        numbers.extend([camera.clock_s, camera.clock_sigma_s]);
        numbers.extend(camera.told_q_vehicle_from_camera_wxyz);
    }
    let numbers = numbers.iter().map(f64::to_string);
    let cell = |x: Option<f64>| x.map(|x| x.to_string()).unwrap_or_default();
    let quaternion = (0..4).map(|i| cell(s.unaided_q_wxyz.and_then(|q| q.get(i).copied())));
    let covariance = (0..6).map(|i| cell(s.unaided_cov_deg2.and_then(|c| c.get(i).copied())));
    let unaided = quaternion.chain(covariance);
    [s.time_s.to_string(), phase].into_iter().chain(numbers).chain([s.verdict.to_owned()]).chain(unaided).collect()
}
