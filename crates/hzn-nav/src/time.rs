//! Time scales. UTC is counted in seconds since 1970-01-01T00:00:00 without leap seconds, as Unix does.

/// Time in UTC until which the leap seconds are known: 2026-06-28, the expiry of the list of the IERS that this version
/// holds. Later dates count as if no leap second came; each one that does moves Sun and Moon by 0.004°, and positions
/// of a receiver in GPS time by a second.
pub const LEAP_SECONDS_EXPIRE_UNIX_S: f64 = 1_782_604_800.0;

/// Returns whether the leap seconds up to a time in UTC are known; see [`LEAP_SECONDS_EXPIRE_UNIX_S`].
pub fn are_leap_seconds_known(unix_s: f64) -> bool {
    unix_s < LEAP_SECONDS_EXPIRE_UNIX_S
}

/// Returns TAI − UTC in seconds at a time in UTC. Dates before 1999 count as 1999, and no leap second after 2017 is
/// known.
pub fn tai_minus_utc_s(unix_s: f64) -> f64 {
    // Leap seconds of 2006, 2009, 2012-07, 2015-07 and 2017 (IERS Bulletin C).
    let since = [1_136_073_600.0, 1_230_768_000.0, 1_341_100_800.0, 1_435_708_800.0, 1_483_228_800.0];
    32.0 + since.iter().filter(|&&from| unix_s >= from).count() as f64
}

/// Returns a time in UTC, in seconds since 1970, from TAI in seconds since 1970-01-01T00:00 TAI.
// The difference is a function of UTC, which is only looked for here, so a first UTC comes with the difference at the
// TAI. It changes only at the end of a month; near it the result may be one second off.
pub fn unix_from_tai_s(tai_s: f64) -> f64 {
    tai_s - tai_minus_utc_s(tai_s - tai_minus_utc_s(tai_s))
}

/// Returns the days of terrestrial time since J2000 (2000-01-01T12:00 TT), from UTC in seconds since 1970.
pub fn tt_days_since_j2000(unix_s: f64) -> f64 {
    ut_days_since_j2000(unix_s) + (tai_minus_utc_s(unix_s) + 32.184) / 86_400.0
}

/// Returns the days since 2000-01-01T12:00 in UTC, which is used as UT1, because UT1 needs tables that are published
/// anew every week. The two differ by less than 0.9 s, in which the Earth turns by 0.004°.
pub fn ut_days_since_j2000(unix_s: f64) -> f64 {
    (unix_s - 946_728_000.0) / 86_400.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leap_seconds_begin_at_midnight() {
        // The time comes from `date -u -d 2017-01-01 +%s`.
        assert_eq!(tai_minus_utc_s(1_483_228_799.0), 36.0);
        assert_eq!(tai_minus_utc_s(1_483_228_800.0), 37.0);
        assert_eq!(tai_minus_utc_s(0.0), 32.0);
    }

    #[test]
    fn leap_seconds_expire() {
        // `date -u -d 2026-06-28 +%s`
        assert!(are_leap_seconds_known(1_782_604_799.0) && !are_leap_seconds_known(1_782_604_800.0));
        assert!(!are_leap_seconds_known(f64::NAN));
    }

    #[test]
    fn j2000_is_at_noon_of_terrestrial_time() {
        // This is 2000-01-01T11:58:55.816 UTC, with 32 leap seconds and 32.184 s from TAI to TT.
        assert!(tt_days_since_j2000(946_727_935.816).abs() < 1e-12);
    }
}
