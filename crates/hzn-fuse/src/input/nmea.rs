//! NMEA 0183: the sentences of a satellite navigation receiver that have a position, a date or a sigma.
//!
//! A position comes from GGA or GNS, a date from RMC or ZDA, and sigmas from GST, whoever the talker is (GP, GN, GL,
//! ...). A velocity is not taken: RMC and VTG have the speed over ground, and a vehicle that climbs has another one.
//! Source: the sentences as the interface descriptions of receivers print them (u-blox M8, section 31).

use std::path::Path;

use hzn_files::limited;
use hzn_nav::frames::Vector;
use jiff::civil::Date;

use super::fix::{Fix, Receiver, ecef_m};
use crate::error::Error;

/// Largest file in bytes: a week of ten sentences a second.
const MAX_BYTES: u64 = 1 << 29;
const DAY_S: f64 = 86_400.0;
/// 1-sigma of a height above mean sea level that counts as one above the ellipsoid, m: the RMS of the geoid over the
/// globe (EGM2008) is 31 m.
const GEOID_M: f64 = 31.0;

/// Returns whether a file is NMEA 0183: its first line that is not empty begins with `$` or `!`.
///
/// # Errors
/// The file cannot be read.
pub(super) fn is_nmea(path: &Path) -> Result<bool, Error> {
    use std::io::Read;
    let refuse = |e: std::io::Error| Error::unusable(format!("{}: {e}", path.display()));
    let mut begin = Vec::new();
    std::fs::File::open(path).map_err(refuse)?.take(256).read_to_end(&mut begin).map_err(refuse)?;
    Ok(begin.iter().find(|b| !b.is_ascii_whitespace()).is_some_and(|b| b"$!".contains(b)))
}

/// Reads the fixes of a file; see [`super::gnss`].
pub(super) fn read(path: &Path, utc_unix_s: Option<f64>) -> Result<Receiver, Error> {
    let shown = path.display();
    let bytes = limited::read(path, MAX_BYTES).map_err(|e| Error::unusable(format!("{shown}: {e}")))?;
    let text = String::from_utf8_lossy(&bytes);
    let mut log = Log::default();
    text.lines().map(str::trim).filter(|line| !line.is_empty()).for_each(|line| log.add(line));
    if log.places.is_empty() {
        let Log { sentences, damaged, without_fix, .. } = log;
        let what = format!(
            "no sentence GGA or GNS has a position: {sentences} sentences have a right checksum, {damaged} lines do \
             not, and {without_fix} positions have no fix"
        );
        return Err(Error::unusable(format!("{shown}: {what}")));
    }
    let notes = log.notes(utc_unix_s).into_iter().map(|note| format!("{shown}: {note}")).collect();
    Ok(Receiver { fixes: log.fixes(utc_unix_s), notes })
}

/// A position at a time of the log.
struct Place {
    at: Moment,
    lat_deg: f64,
    lon_deg: f64,
    height_m: f64,
    sigma_m: f64,
}

/// A time of day, and the number of midnights since the begin of the log.
#[derive(Clone, Copy, PartialEq)]
struct Moment {
    second: f64,
    midnights: i32,
}

/// What the sentences said.
#[derive(Default)]
struct Log {
    places: Vec<Place>,
    /// Days since 1970 of the log's first midnight, and the index of the first place for which they hold.
    dates: Vec<(usize, i32)>,
    last: Option<Moment>,
    /// Sigma of the last GST.
    sigma: Option<(Moment, f64)>,
    sentences: usize,
    damaged: usize,
    without_fix: usize,
    without_geoid: usize,
}

impl Log {
    fn add(&mut self, line: &str) {
        let Some(sentence) = checked(line) else {
            self.damaged += 1;
            return;
        };
        self.sentences += 1;
        let fields: Vec<&str> = sentence.split(',').collect();
        let field = |i: usize| fields.get(i).copied().unwrap_or_default();
        let number = |i: usize| field(i).parse::<f64>().ok().filter(|x| x.is_finite());
        // Two letters of the talker, then the type. A sentence of a maker begins with P.
        let kind = field(0).get(2..).filter(|_| field(0).len() == 5).unwrap_or_default();
        if !matches!(kind, "GGA" | "GNS" | "RMC" | "ZDA" | "GST") {
            return;
        }
        let Some(at) = self.moment(field(1)) else { return };
        match kind {
            "RMC" if field(2) == "A" => self.date(at, date_of(field(9))),
            "ZDA" => {
                let all = (number(4), number(3), number(2));
                let (Some(year), Some(month), Some(day)) = all else { return };
                self.date(at, Date::new(year as i16, month as i8, day as i8).ok());
            }
            "GST" => {
                let sigma = [6, 7, 8].into_iter().filter_map(number).fold(f64::NAN, f64::max);
                // It may come before or after the position of its time.
                self.sigma = Some((at, sigma));
                if let Some(last) = self.places.last_mut().filter(|last| last.at == at) {
                    last.sigma_m = last.sigma_m.max(sigma);
                }
            }
            // 0 is no fix, 6 is dead reckoning, and 7 was entered by hand.
            "GGA" if !matches!(field(6), "" | "0" | "6" | "7") => {
                self.place(at, [field(2), field(3), field(4), field(5)], number(9), number(11));
            }
            "GNS" if field(6).chars().any(|mode| !matches!(mode, 'N' | 'E' | 'M')) => {
                self.place(at, [field(2), field(3), field(4), field(5)], number(9), number(10));
            }
            "GGA" | "GNS" => self.without_fix += 1,
            _ => {}
        }
    }

    /// Returns the time of a sentence. A time of day that falls by more than half a day belongs to the next day.
    fn moment(&mut self, text: &str) -> Option<Moment> {
        let part = |range| text.get(range).and_then(|digits: &str| digits.parse::<f64>().ok());
        let second = part(0..2)? * 3600.0 + part(2..4)? * 60.0 + part(4..text.len())?;
        if !(0.0..DAY_S + 1.0).contains(&second) {
            return None;
        }
        let midnights = self.last.map_or(0, |last| {
            let back = last.second - second;
            last.midnights + i32::from(back > 0.5 * DAY_S) - i32::from(back < -0.5 * DAY_S)
        });
        let moment = Moment { second, midnights };
        self.last = Some(moment);
        Some(moment)
    }

    fn date(&mut self, at: Moment, date: Option<Date>) {
        let epoch = Date::constant(1970, 1, 1);
        let Some(days) = date.and_then(|date| date.since(epoch).ok()).map(|span| span.get_days()) else { return };
        let first_midnight = days - at.midnights;
        if self.dates.last().is_none_or(|(_, known)| *known != first_midnight) {
            self.dates.push((if self.dates.is_empty() { 0 } else { self.places.len() }, first_midnight));
        }
    }

    fn place(&mut self, at: Moment, [lat, north, lon, east]: [&str; 4], altitude: Option<f64>, geoid: Option<f64>) {
        let position = angle(lat, north, ["N", "S"], 90.0).zip(angle(lon, east, ["E", "W"], 180.0));
        let Some(((lat_deg, lon_deg), altitude_m)) = position.zip(altitude) else {
            self.without_fix += 1;
            return;
        };
        // GGA and GNS of one time, or those of several talkers, are one fix.
        if self.places.last().is_some_and(|last| last.at == at) {
            return;
        }
        self.without_geoid += usize::from(geoid.is_none());
        let own = self.sigma.filter(|(when, _)| *when == at).map_or(f64::NAN, |(_, sigma)| sigma);
        let sigma_m = if geoid.is_none() { GEOID_M.max(own) } else { own };
        self.places.push(Place { at, lat_deg, lon_deg, height_m: altitude_m + geoid.unwrap_or(0.0), sigma_m });
    }

    /// Returns the day of the log's first midnight for a place: since 1970, or so that times are near that of time 0.
    fn first_day(&self, index: usize, utc_unix_s: Option<f64>) -> f64 {
        let known = self.dates.iter().rev().find(|(from, _)| *from <= index).map(|(_, days)| f64::from(*days));
        known.unwrap_or_else(|| {
            let first = self.places.first().map_or(0.0, |place| place.at.second);
            utc_unix_s.map_or(0.0, |utc| ((utc - first) / DAY_S).round())
        })
    }

    fn fixes(&self, utc_unix_s: Option<f64>) -> Vec<Fix> {
        let fix = |(index, place): (usize, &Place)| {
            let day = self.first_day(index, utc_unix_s) + f64::from(place.at.midnights);
            Fix {
                time_s: day * DAY_S + place.at.second - utc_unix_s.unwrap_or(0.0),
                position_m: ecef_m(place.lat_deg, place.lon_deg, place.height_m).into(),
                velocity_m_s: Vector::new(f64::NAN, f64::NAN, f64::NAN),
                position_sigma_m: place.sigma_m,
                velocity_sigma_m_s: f64::NAN,
            }
        };
        self.places.iter().enumerate().map(fix).collect()
    }

    /// Returns what was assumed or left out.
    fn notes(&self, utc_unix_s: Option<f64>) -> Vec<String> {
        let n = self.places.len();
        let time = match (utc_unix_s.is_some(), self.dates.is_empty()) {
            (true, false) => "times count from --utc",
            (true, true) => "no sentence has a date, so the day is that of --utc, from which times count",
            (false, false) => "times are in seconds since 1970; with --utc they count from the time 0 of the flight",
            (false, true) => "no sentence has a date, so times are seconds of the first day; --utc gives time 0",
        };
        let mut notes = vec![format!("{n} positions, without velocities; {time}")];
        if self.without_geoid > 0 {
            notes.push(format!(
                "{} positions do not say the height of the geoid: their height above mean sea level counts as that \
                 above the ellipsoid, with a sigma of {GEOID_M} m",
                self.without_geoid
            ));
        }
        if self.places.iter().any(|place| place.sigma_m.is_nan()) {
            notes.push("not all positions have a sigma (GST); that of [gnss] in fuse.toml counts".to_owned());
        }
        for (count, what) in
            [(self.damaged, "lines have no right checksum"), (self.without_fix, "sentences have no fix")]
        {
            if count > 0 {
                notes.push(format!("{count} {what}, and were left out"));
            }
        }
        notes
    }
}

/// Returns the sentence between `$` and `*`, if its checksum is right.
fn checked(line: &str) -> Option<&str> {
    let (sentence, sum) = line.get(line.find(['$', '!'])? + 1..)?.split_once('*')?;
    let told = u8::from_str_radix(sum.get(..2)?, 16).ok()?;
    (sentence.bytes().fold(0, |sum, byte| sum ^ byte) == told).then_some(sentence)
}

/// Returns the date of `ddmmyy`. The receivers that wrote years before 1980 do not exist.
fn date_of(text: &str) -> Option<Date> {
    let part = |range| text.get(range).and_then(|digits: &str| digits.parse::<i16>().ok());
    let (day, month, year) = (part(0..2)?, part(2..4)?, part(4..6)?);
    let year = if year < 80 { 2000 + year } else { 1900 + year };
    Date::new(year, i8::try_from(month).ok()?, i8::try_from(day).ok()?).ok()
}

/// Returns an angle of degrees and minutes, `dddmm.mmmm`, in degrees.
fn angle(text: &str, side: &str, [plus, minus]: [&str; 2], most_deg: f64) -> Option<f64> {
    let value = text.parse::<f64>().ok().filter(|value| *value >= 0.0)?;
    let degrees = (value / 100.0).trunc();
    let minutes = value - 100.0 * degrees;
    let sign = if side == plus { 1.0 } else { -1.0 };
    let angle = sign * (degrees + minutes / 60.0);
    ((side == plus || side == minus) && minutes < 60.0 && angle.abs() <= most_deg).then_some(angle)
}
