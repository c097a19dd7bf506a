//! Reads the UTC times in files.

use jiff::civil::Time;
use jiff::fmt::temporal::Pieces;
use jiff::tz::Offset;

/// Converts an ISO 8601 time, for example `2020-11-20T08:30:00.25Z`, to seconds since 1970-01-01T00:00:00 UTC. The `Z`
/// may be omitted, and a space may replace the `T`. The time of day may end after the minutes or be missing; it is then
/// midnight. The result is `None` if the text is not a valid time, or has an offset from UTC or a time zone.
pub fn unix_seconds(text: &str) -> Option<f64> {
    let pieces = Pieces::parse(text.trim()).ok()?;
    let utc = pieces.to_numeric_offset().is_none_or(|offset| offset == Offset::UTC);
    if !utc || pieces.to_time_zone().is_ok_and(|zone| zone.is_some()) {
        return None;
    }
    let time = pieces.date().to_datetime(pieces.time().unwrap_or(Time::midnight()));
    let since = Offset::UTC.to_timestamp(time).ok()?;
    Some(since.as_second() as f64 + f64::from(since.subsec_nanosecond()) * 1e-9)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_times() {
        assert_eq!(unix_seconds("1970-01-01T00:00:00Z"), Some(0.0));
        // `date -u -d 2020-11-20T08:30:00 +%s`
        assert_eq!(unix_seconds("2020-11-20T08:30:00.25Z"), Some(1_605_861_000.25));
        assert_eq!(unix_seconds("2000-02-29 12:00"), Some(951_825_600.0));
        assert_eq!(unix_seconds("2020-11-20T08:30:00+02:00"), None);
        assert_eq!(unix_seconds("20.11.2020"), None);
        assert_eq!(unix_seconds("2021-02-29"), None);
        assert_eq!(unix_seconds("2020-13-20T08:30:00"), None);
    }
}
