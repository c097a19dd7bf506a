//! UTC as seconds since 1970, as dates, and the step to terrestrial time.

/// Days since 1970-01-01 of a date of the Gregorian calendar; years are counted from March, so that the leap day
/// comes last.
fn days_since_1970(year: i64, month: i64, day: i64) -> i64 {
    let y = if month <= 2 { year - 1 } else { year };
    let era = y.div_euclid(400);
    let year_of_era = y.rem_euclid(400);
    let day_of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    era * 146_097 + year_of_era * 365 + year_of_era / 4 - year_of_era / 100 + day_of_year - 719_468
}

/// The date (year, month, day) that many days after 1970-01-01: the inverse of the above.
fn date(days: i64) -> (i64, i64, i64) {
    let z = days + 719_468;
    let era = z.div_euclid(146_097);
    let day_of_era = z.rem_euclid(146_097);
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let m = (5 * day_of_year + 2) / 153;
    let month = if m < 10 { m + 3 } else { m - 9 };
    (year_of_era + era * 400 + i64::from(month <= 2), month, day_of_year - (153 * m + 2) / 5 + 1)
}

/// Seconds since 1970-01-01T00:00:00 UTC of a TOML date and time without offset from UTC. `None` where it has no date,
/// or an offset.
pub fn unix_s(time: &toml::value::Datetime) -> Option<f64> {
    let date = time.date?;
    if !matches!(time.offset, None | Some(toml::value::Offset::Z)) {
        return None;
    }
    let days = days_since_1970(date.year.into(), date.month.into(), date.day.into());
    let (clock, nanoseconds) = time.time.map_or((0, 0), |t| {
        let whole = 3600 * i64::from(t.hour) + 60 * i64::from(t.minute) + i64::from(t.second.unwrap_or(0));
        (whole, t.nanosecond.unwrap_or(0))
    });
    Some((days * 86_400 + clock) as f64 + f64::from(nanoseconds) * 1e-9)
}

/// `2019-06-13T02:25:51.250Z`, to the millisecond.
pub fn iso8601(unix_s: f64) -> String {
    let ms = (unix_s * 1e3).round() as i64;
    let (year, month, day) = date(ms.div_euclid(86_400_000));
    let ms = ms.rem_euclid(86_400_000);
    let (h, m, s, ms) = (ms / 3_600_000, ms / 60_000 % 60, ms / 1000 % 60, ms % 1000);
    format!("{year:04}-{month:02}-{day:02}T{h:02}:{m:02}:{s:02}.{ms:03}Z")
}

/// TAI − UTC in seconds. Dates before 1999 count as 1999, and no leap second is foreseen.
fn tai_minus_utc_s(unix_s: f64) -> f64 {
    // 2006, 2009, 2012-07, 2015-07, 2017 (IERS Bulletin C).
    let since = [1_136_073_600.0, 1_230_768_000.0, 1_341_100_800.0, 1_435_708_800.0, 1_483_228_800.0];
    32.0 + since.iter().filter(|&&from| unix_s >= from).count() as f64
}

/// Days of terrestrial time since J2000 (2000-01-01T12:00 TT).
pub(crate) fn tt_days_since_j2000(unix_s: f64) -> f64 {
    ut_days_since_j2000(unix_s) + (tai_minus_utc_s(unix_s) + 32.184) / 86_400.0
}

/// Days of UTC, which stands for UT1, since 2000-01-01T12:00.
pub(crate) fn ut_days_since_j2000(unix_s: f64) -> f64 {
    (unix_s - 946_728_000.0) / 86_400.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_there_and_back() {
        let parse = |s: &str| unix_s(&s.parse().unwrap());
        assert_eq!(parse("1970-01-01T00:00:00Z"), Some(0.0));
        // `date -u -d 2020-11-20T08:30:00 +%s`
        assert_eq!(parse("2020-11-20T08:30:00.25Z"), Some(1_605_861_000.25));
        assert_eq!(parse("2020-11-20"), Some(1_605_830_400.0));
        assert_eq!(parse("2020-11-20T08:30:00+02:00"), None);
        for text in ["2000-02-29T12:00:00.000Z", "1999-12-31T23:59:59.999Z", "2024-03-01T00:00:00.000Z"] {
            assert_eq!(iso8601(parse(text).unwrap()), text);
        }
    }
}
