//! UTC times as they are written in files.

/// Seconds since 1970-01-01T00:00:00 UTC of an ISO 8601 time such as `2020-11-20T08:30:00.25Z`. The `Z` may be left
/// out, a blank may stand for the `T`, and the time of day may end after the minutes. `None` when it is no such time
/// or has an offset from UTC.
pub fn unix_seconds(text: &str) -> Option<f64> {
    let text = text.trim();
    let text = text.strip_suffix(['Z', 'z']).or_else(|| text.strip_suffix("+00:00")).unwrap_or(text);
    let (date, clock) = text.split_once(['T', 't', ' ']).unwrap_or((text, "00:00"));
    let mut date =
        date.split('-').map(|p| if p.bytes().all(|b| b.is_ascii_digit()) { p.parse::<i64>().ok() } else { None });
    let (year, month, day) = (date.next()??, date.next()??, date.next()??);
    let mut clock = clock.split(':');
    let whole = |p: &str| (p.len() == 2).then(|| p.parse::<u32>().ok()).flatten();
    let (hour, minute) = (whole(clock.next()?)?, whole(clock.next()?)?);
    let second: f64 = match clock.next() {
        Some(s) if s.bytes().all(|b| b.is_ascii_digit() || b == b'.') => s.parse().ok()?,
        Some(_) => return None,
        None => 0.0,
    };
    let valid = (1..=12).contains(&month) && (1..=31).contains(&day) && hour < 24 && minute < 60 && second < 61.0;
    if !valid || date.next().is_some() || clock.next().is_some() || !(0..=9999).contains(&year) {
        return None;
    }
    let days = days_since_1970(year, month, day);
    Some((days * 86_400 + i64::from(hour) * 3600 + i64::from(minute) * 60) as f64 + second)
}

/// Days of the proleptic Gregorian calendar; years are counted from March so that the leap day comes last.
fn days_since_1970(year: i64, month: i64, day: i64) -> i64 {
    let y = if month <= 2 { year - 1 } else { year };
    let era = y.div_euclid(400);
    let year_of_era = y.rem_euclid(400);
    let day_of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    era * 146_097 + year_of_era * 365 + year_of_era / 4 - year_of_era / 100 + day_of_year - 719_468
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
        assert_eq!(unix_seconds("2020-13-20T08:30:00"), None);
    }
}
