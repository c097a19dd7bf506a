//! CCSDS attitude ephemeris message (AEM) in keyword = value notation.
//!
//! Sources: CCSDS 504.0-B-1 (version 1.0) and 504.0-B-2 (version 2.0), section 4. The quaternion turns the axes of
//! frame A onto those of frame B; it is that of the rotation from the vehicle's frame to ECEF, scalar last.

use std::io::Write;

use super::Utc;
use crate::error::Error;
use crate::results::{Epoch, Fused};

/// Version of a message. Programs read one or the other: GMAT and ccsds-ndm the first, brahe the second, Orekit both.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum AemVersion {
    /// 1.0 of 2008.
    #[default]
    One,
    /// 2.0 of 2024. The direction A to B and the place of the scalar are no keywords any more, because they are fixed.
    Two,
}

/// Header of a message.
#[derive(Debug, Clone, PartialEq)]
pub struct AemOptions {
    /// Version of the message.
    pub version: AemVersion,
    /// UTC of time 0.
    pub utc: Utc,
    /// Name of the vehicle.
    pub object_name: String,
    /// International designator of the vehicle.
    pub object_id: String,
    /// UTC at which the message is made.
    pub created: String,
}

/// Writes the attitude as an AEM: the smoothed solution if there is one, else the filter's.
///
/// # Errors
/// There is no solution, or the output cannot be written.
pub fn write_aem(fused: &Fused, options: &AemOptions, mut out: impl Write) -> Result<(), Error> {
    let epochs = rising(best(fused));
    let (Some(first), Some(last)) = (epochs.first(), epochs.last()) else {
        return Err(Error::unusable("there is no solution to write as an AEM"));
    };
    let iso = |epoch: &Epoch| options.utc.iso(epoch.state.time_s);
    let AemOptions { object_name, object_id, created, .. } = options;
    let [version, frame, direction, scalar] = match options.version {
        AemVersion::One => ["1.0", "ITRF-97", "ATTITUDE_DIR = A2B\n", "QUATERNION_TYPE = LAST\n"],
        AemVersion::Two => ["2.0", "ITRF1997", "", ""],
    };
    let mut text = format!(
        "CCSDS_AEM_VERS = {version}\nCREATION_DATE = {created}\nORIGINATOR = HZN\n\nMETA_START\nOBJECT_NAME = \
         {object_name}\nOBJECT_ID = {object_id}\nCENTER_NAME = EARTH\nREF_FRAME_A = {frame}\nREF_FRAME_B = \
         SC_BODY_1\n{direction}TIME_SYSTEM = UTC\nSTART_TIME = {}\nSTOP_TIME = {}\nATTITUDE_TYPE = \
         QUATERNION\n{scalar}INTERPOLATION_METHOD = LINEAR\nINTERPOLATION_DEGREE = 1\nMETA_STOP\n\nDATA_START\n",
        iso(first),
        iso(last)
    );
    for epoch in epochs {
        let [w, x, y, z] = epoch.state.attitude.wxyz();
        text.push_str(&format!("{} {x:.12} {y:.12} {z:.12} {w:.12}\n", iso(epoch)));
    }
    text.push_str("DATA_STOP\n");
    out.write_all(text.as_bytes()).and_then(|()| out.flush()).map_err(Error::failed)
}

/// Returns the best solution: the smoothed one if there is one.
pub(super) fn best(fused: &Fused) -> &[Epoch] {
    if fused.smoothed.is_empty() { &fused.epochs } else { &fused.smoothed }
}

/// Returns the solutions whose times rise by at least a microsecond. Of several at one time it is the last.
pub(super) fn rising(epochs: &[Epoch]) -> Vec<&Epoch> {
    let mut out: Vec<&Epoch> = Vec::with_capacity(epochs.len());
    for epoch in epochs {
        match out.last_mut() {
            Some(last) if epoch.state.time_s - last.state.time_s < 2e-6 => *last = epoch,
            _ => out.push(epoch),
        }
    }
    out
}
