//! The time of values from navigation, and how long they are used.

use super::clock::Clock;
use crate::cuc::Cuc;
use crate::messages::Code;

/// Largest distance of the time of the values from the time of their telecommand, s. More is an error of the sender.
const LARGEST_AGE_S: f32 = 3600.0;

/// Why values from navigation are refused, and the place of the number in the arguments of the telecommand, from 1; 0
/// for all of them.
pub(super) type Refusal = (Code, u16);

/// Time and expiry of values from navigation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Validity {
    pub(super) epoch_us: u64,
    pub(super) expires_s: Option<f32>,
}

impl Validity {
    /// Makes it from the first two numbers of a telecommand that arrived at `now_us`. NaN says that the values do not
    /// expire.
    pub(super) fn read(epoch: u64, expires_s: f32, clock: &Clock, now_us: u64) -> Result<Self, Refusal> {
        let expires_s = (!expires_s.is_nan()).then_some(expires_s);
        let validity = Self { epoch_us: epoch_us(epoch, clock)?, expires_s };
        if validity.age_s(now_us).abs() > LARGEST_AGE_S {
            return Err((Code::Refused, 1));
        }
        // NaN says that the values do not expire, so that infinity is an error.
        if expires_s.is_some_and(|limit| limit <= 0.0 || limit.is_infinite()) {
            return Err((Code::Refused, 2));
        }
        Ok(validity)
    }

    /// Returns the time from the values to the exposure, s; negative if the exposure was before.
    pub(super) fn age_s(&self, exposure_us: u64) -> f32 {
        // The difference is taken in whole numbers, because an f32 of microseconds has steps of 256 µs after an hour.
        // It has a sign, because values may be predicted.
        exposure_us.wrapping_sub(self.epoch_us).cast_signed() as f32 * 1e-6
    }
    pub(super) fn has_expired(&self, exposure_us: u64) -> bool {
        // In both directions, because a prediction is as uncertain as an old value.
        self.expires_s.is_some_and(|limit| self.age_s(exposure_us).abs() > limit)
    }
}

/// Returns the time of the values on the board's clock.
fn epoch_us(epoch: u64, clock: &Clock) -> Result<u64, Refusal> {
    let bytes = epoch.to_be_bytes();
    match (bytes, Cuc::from_bytes(bytes)) {
        // No P-field is 0, so that a number of microseconds is never taken for a time code.
        (_, Some(time)) => clock.clock_us(time).ok_or((Code::NoClock, 1)),
        ([0, ..], None) => Ok(epoch),
        _ => Err((Code::Refused, 1)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_expire_in_both_directions() {
        let validity = Validity { epoch_us: 50_000_000, expires_s: Some(20.0) };
        let has_expired = [29_000_000, 31_000_000, 69_000_000, 71_000_000].map(|us| validity.has_expired(us));
        assert_eq!(has_expired, [true, false, false, true]);
    }
}
