//! CCSDS orbit ephemeris message (OEM), version 2.0, in keyword = value notation.
//!
//! Source: CCSDS 502.0-B-2, section 5. Positions are in km and velocities in km/s, in the rotating frame.

use std::fmt::Write as _;
use std::io::Write;

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
    for epoch in epochs {
        let [x, y, z] = epoch.state.position_m.xyz().map(|m| 1e-3 * m);
        let [vx, vy, vz] = epoch.state.velocity_m_s.xyz().map(|v| 1e-3 * v);
        let _ = writeln!(text, "{} {x:.6} {y:.6} {z:.6} {vx:.9} {vy:.9} {vz:.9}", iso(epoch));
    }
    out.write_all(text.as_bytes()).and_then(|()| out.flush()).map_err(Error::failed)
}
