//! TAI, the time of a flight computer's packets, and UTC, the time of people.

use hzn_fly::tell::Tell;
use hzn_nav::time::{are_leap_seconds_known, tai_minus_utc_s, unix_from_tai_s};

/// Seconds from 1958-01-01 to 1970-01-01.
const UNIX_EPOCH_S: f64 = 4383.0 * 86_400.0;

/// Returns a time in TAI, in microseconds since 1958, as a text in UTC.
pub fn utc_text(tai_us: u64) -> String {
    hzn_files::utc::iso8601(unix_from_tai_s(tai_us as f64 * 1e-6 - UNIX_EPOCH_S))
}

/// Returns a time in UTC, such as `2026-11-24T12:00:00.5Z`, as microseconds of TAI since 1958. `tell` gets a
/// remark if a later leap second may be missing.
///
/// # Errors
/// The text is no such time, or TAI is not known for it.
pub fn from_utc(text: &str, tell: &Tell) -> Result<u64, String> {
    let unix_s = hzn_files::time::unix_seconds(text)
        .ok_or_else(|| format!("{text:?} is not a time in UTC, such as 2026-11-24T12:00:00.5Z"))?;
    // Four bytes of seconds end in 2094.
    if !(946_684_800.0..3.9e9).contains(&unix_s) {
        return Err(format!("the time {text} is refused: from the year 2000 to 2093"));
    }
    if !are_leap_seconds_known(unix_s) {
        tell(&format!("{text}: no leap second is known after the list of this version ended"));
    }
    // Separate sums keep the microseconds.
    let whole = unix_s.floor();
    let fraction_us = ((unix_s - whole) * 1e6).round() as u64;
    Ok((whole + tai_minus_utc_s(unix_s) + UNIX_EPOCH_S) as u64 * 1_000_000 + fraction_us)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    #[test]
    fn times_there_and_back() {
        let tell: Tell = Arc::new(|text| panic!("{text}"));
        // 1958-01-01 is the Julian day 2436204.5, 2017-01-01 the day 2457754.5; TAI - UTC has been 37 s since then.
        assert_eq!(from_utc("2017-01-01T00:00:00Z", &tell), Ok((21_550 * 86_400 + 37) * 1_000_000));
        for text in ["2016-12-31T23:59:59.000Z", "2017-01-01T00:00:00.000Z", "2026-06-01T12:34:56.789Z"] {
            assert_eq!(utc_text(from_utc(text, &tell).unwrap()), text);
        }
        assert!(from_utc("1990-01-01", &tell).is_err() && from_utc("soon", &tell).is_err());
    }
}
