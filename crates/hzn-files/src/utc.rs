//! UTC as seconds since 1970 and as text.

use jiff::Timestamp;
use jiff::civil::DateTime;
use jiff::tz::Offset;

/// Returns the seconds from 1970-01-01T00:00:00 UTC to a TOML date and time in UTC. A time without an offset counts as
/// UTC. Returns `None` if the value has no date or has an offset other than `Z`.
pub fn unix_s(time: &toml::value::Datetime) -> Option<f64> {
    if time.date.is_none() || !matches!(time.offset, None | Some(toml::value::Offset::Z)) {
        return None;
    }
    let civil = toml::value::Datetime { offset: None, ..*time };
    let since = Offset::UTC.to_timestamp(civil.to_string().parse::<DateTime>().ok()?).ok()?;
    Some(since.as_second() as f64 + f64::from(since.subsec_nanosecond()) * 1e-9)
}

/// Formats a time as `2019-06-13T02:25:51.250Z`, to the millisecond.
pub fn iso8601(unix_s: f64) -> String {
    let time = Timestamp::from_millisecond((unix_s * 1e3).round() as i64).unwrap_or_default();
    format!("{time:.3}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_there_and_back() {
        let parse = |s: &str| unix_s(&s.parse().unwrap());
        assert_eq!(parse("1970-01-01T00:00:00Z"), Some(0.0));
        // The number comes from `date -u -d 2020-11-20T08:30:00 +%s`.
        assert_eq!(parse("2020-11-20T08:30:00.25Z"), Some(1_605_861_000.25));
        assert_eq!(parse("2020-11-20"), Some(1_605_830_400.0));
        assert_eq!(parse("2020-11-20T08:30:00+02:00"), None);
        for text in ["2000-02-29T12:00:00.000Z", "1999-12-31T23:59:59.999Z", "2024-03-01T00:00:00.000Z"] {
            assert_eq!(iso8601(parse(text).unwrap()), text);
        }
    }
}
