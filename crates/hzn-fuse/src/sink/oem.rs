//! CCSDS orbit ephemeris message (OEM), version 2.0, in keyword = value notation.
//!
//! Source: CCSDS 502.0-B-2, section 5. Positions are in km and velocities in km/s, in the rotating frame. A covariance
//! follows for each state (section 5.2.5): the lower triangle of position and velocity, in km², km²/s and km²/s².

use std::fmt::Write as _;
use std::io::Write;

use nalgebra::Matrix6;

use super::AemOptions;
use super::aem::{best, rising};
use crate::error::Error;
use crate::results::{Epoch, Fused};

/// Writes position and velocity as an OEM: the smoothed solution if there is one, else the filter's. The options are
/// those of an AEM.
///
/// # Errors
/// There is no solution, or the output cannot be written.
pub fn write_oem(fused: &Fused, options: &AemOptions, mut out: impl Write) -> Result<(), Error> {
    let epochs = rising(best(fused));
    let (Some(first), Some(last)) = (epochs.first(), epochs.last()) else {
        return Err(Error::unusable("there is no solution to write as an OEM"));
    };
    let iso = |epoch: &Epoch| options.utc.iso(epoch.state.time_s);
    let AemOptions { object_name, object_id, created, .. } = options;
    let mut text = format!(
        "CCSDS_OEM_VERS = 2.0\nCREATION_DATE = {created}\nORIGINATOR = HZN\n\nMETA_START\nOBJECT_NAME = \
         {object_name}\nOBJECT_ID = {object_id}\nCENTER_NAME = EARTH\nREF_FRAME = ITRF-97\nTIME_SYSTEM = \
         UTC\nSTART_TIME = {}\nSTOP_TIME = {}\nMETA_STOP\n\n",
        iso(first),
        iso(last)
    );
    for epoch in &epochs {
        let [x, y, z] = epoch.state.position_m.xyz().map(|m| 1e-3 * m);
        let [vx, vy, vz] = epoch.state.velocity_m_s.xyz().map(|v| 1e-3 * v);
        let _ = writeln!(text, "{} {x:.6} {y:.6} {z:.6} {vx:.9} {vy:.9} {vz:.9}", iso(epoch));
    }
    text.push_str("\nCOVARIANCE_START\n");
    for epoch in epochs {
        let _ = writeln!(text, "EPOCH = {}\nCOV_REF_FRAME = ITRF-97", iso(epoch));
        let covariance = covariance_m(epoch);
        for row in 0..6 {
            let cells: Vec<String> =
                (0..=row).map(|column| format!("{:.9e}", 1e-6 * covariance[(row, column)])).collect();
            let _ = writeln!(text, "{}", cells.join(" "));
        }
    }
    text.push_str("COVARIANCE_STOP\n");
    out.write_all(text.as_bytes()).and_then(|()| out.flush()).map_err(Error::failed)
}

/// Returns the covariance of position (m) and velocity (m/s).
fn covariance_m(epoch: &Epoch) -> Matrix6<f64> {
    let mut out = Matrix6::zeros();
    let cross = epoch.position_velocity_covariance_m2_s;
    out.fixed_view_mut::<3, 3>(0, 0).copy_from(epoch.position_covariance_m2.as_inner());
    out.fixed_view_mut::<3, 3>(3, 3).copy_from(epoch.velocity_covariance_m2_s2.as_inner());
    out.fixed_view_mut::<3, 3>(0, 3).copy_from(&cross);
    out.fixed_view_mut::<3, 3>(3, 0).copy_from(&cross.transpose());
    out
}
