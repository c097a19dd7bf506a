//! The telecommand with the attitude and the direction to the Sun.

use super::clock::Clock;
use super::validity::{Refusal, Validity};
use crate::attitude::{AttitudeAndSun, Refused};
use crate::bytes::Reader;
use crate::messages::{Attitude, Code};

/// The attitude and the Sun, with their time and expiry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TimedAttitude {
    pub(super) values: AttitudeAndSun,
    pub(super) validity: Validity,
}

/// Place of the expiry, and of the first number of the quaternion, in [`Attitude`], from 1.
const EXPIRY: u16 = 2;
const QUATERNION: u16 = 3;

/// Reads the arguments of [`crate::messages::Function::SetAttitude`], which arrived at `now_us`. Returns `None` for
/// values that are all unknown: they remove the earlier ones.
pub(super) fn read_attitude(
    from: &mut Reader<'_>,
    clock: &Clock,
    now_us: u64,
) -> Result<Option<TimedAttitude>, Refusal> {
    let a = Attitude::read(from).filter(|_| from.rest().is_empty()).ok_or((Code::Arguments, 0))?;
    let values = AttitudeAndSun::try_new([a.q_w, a.q_x, a.q_y, a.q_z], a.sigma_rad, [a.sun_x, a.sun_y, a.sun_z]);
    let values = values.map_err(|refused| match refused {
        Refused::Missing(place) => (Code::Missing, QUATERNION + place),
        Refused::Impossible(place) => (Code::Refused, QUATERNION + place),
    })?;
    if values.is_empty() {
        return Ok(None);
    }
    let validity = Validity::read(a.epoch, a.expires_s, clock, now_us)?;
    match validity.expires_s {
        Some(_) => Ok(Some(TimedAttitude { values, validity })),
        None => Err((Code::Missing, EXPIRY)),
    }
}
