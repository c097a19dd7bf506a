//! CCSDS orbit ephemeris message (OEM) in keyword = value notation, instead of a receiver.
//!
//! Source: CCSDS 502.0-B-3, sections 5.2 and 7. Positions are in km and velocities in km/s. The frame must turn with
//! the Earth: another one needs the orientation of the Earth, whose tables hzn does not have.

use std::path::Path;

use hzn_files::{limited, quoted};
use hzn_nav::frames::Vector;
use hzn_nav::time::unix_from_tai_s;
use jiff::civil::{Date, DateTime};
use nalgebra::{Matrix3, Matrix6, Vector3};

use super::fix::{Fix, Receiver};
use crate::error::Error;

/// Largest file in bytes: a week of a state each second with its covariance.
const MAX_BYTES: u64 = 1 << 29;
/// First word of a message.
const FIRST: &str = "CCSDS_OEM_VERS";
/// Longest time between two states that are filled in, s. With states every 2 minutes the polynomial of third degree is
/// 6 m off in low orbit.
const FILLED_S: f64 = 120.0;
/// Time between the states that are filled in, s: the filter looks for a position within 5 s of its start.
const FILL_S: f64 = 4.0;

/// Returns whether a file begins as an OEM, in keyword = value notation or in XML.
///
/// # Errors
/// The file cannot be read.
pub(super) fn is_oem(path: &Path) -> Result<bool, Error> {
    use std::io::Read;
    let refuse = |e: std::io::Error| Error::unusable(format!("{}: {e}", path.display()));
    let mut begin = Vec::new();
    std::fs::File::open(path).map_err(refuse)?.take(1024).read_to_end(&mut begin).map_err(refuse)?;
    let begin = String::from_utf8_lossy(&begin);
    let begin = begin.trim_start_matches(['\u{feff}', ' ', '\t', '\r', '\n']);
    Ok(begin.starts_with("CCSDS_") || begin.starts_with("<?xml") || begin.starts_with("<oem"))
}

/// Reads the states of a message; see [`super::gnss`].
pub(super) fn read(path: &Path, utc_unix_s: Option<f64>) -> Result<Receiver, Error> {
    let shown = path.display();
    let text = limited::read_text(path, MAX_BYTES).map_err(|e| Error::unusable(format!("{shown}: {e}")))?;
    let refuse = |what: String| Error::unusable(format!("{shown}: {what}"));
    let text = text.trim_start_matches('\u{feff}');
    if text.trim_start().starts_with('<') {
        return Err(refuse(
            "is XML; an OEM in keyword = value notation (KVN) is read, which begins with \
                           CCSDS_OEM_VERS"
                .to_owned(),
        ));
    }
    if !text.trim_start().starts_with(FIRST) {
        let kind = text.split_whitespace().next().unwrap_or_default();
        return Err(refuse(format!("begins with {}; of the messages of CCSDS, OEM is read", quoted(kind))));
    }
    let mut message = Message::default();
    for (number, line) in text.lines().enumerate() {
        message.add(line.trim()).map_err(|what| Error::unusable(format!("{shown}:{}: {what}", number + 1)))?;
    }
    if message.states.is_empty() {
        return Err(refuse("the message has no state: lines with an epoch, x, y, z, vx, vy, vz".to_owned()));
    }
    let count = message.states.len();
    let (fixes, filled) = message.fixes(utc_unix_s.unwrap_or(0.0));
    let mut notes = vec![match utc_unix_s {
        Some(_) => format!("{count} states; times count from --utc"),
        None => format!("{count} states; times are in seconds since 1970; with --utc they count from time 0"),
    }];
    if filled > 0 {
        notes.push(format!(
            "{filled} states in between are filled in (polynomials of third degree); a state and those after it count \
             together as much as one"
        ));
    }
    if fixes.iter().any(|fix| fix.position_sigma_m.is_nan()) {
        notes.push("states without a covariance have the sigmas of [gnss] in fuse.toml".to_owned());
    }
    let notes = notes.into_iter().map(|note| format!("{shown}: {note}")).collect();
    Ok(Receiver { fixes, notes })
}

/// A state.
#[derive(Debug, Clone, Copy)]
struct State {
    unix_s: f64,
    /// Number of its segment.
    segment: usize,
    position_m: Vector3<f64>,
    velocity_m_s: Vector3<f64>,
}

/// The part of the message that a line is in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Part {
    #[default]
    Header,
    Meta,
    States,
    Covariance,
}

/// A message as far as it was read.
#[derive(Default)]
struct Message {
    part: Part,
    segment: usize,
    /// What the time system adds to UTC.
    time: TimeSystem,
    has_frame: bool,
    has_time: bool,
    states: Vec<State>,
    /// Epochs with the largest sigma of position (m) and velocity (m/s).
    sigmas: Vec<(f64, [f64; 2])>,
    epoch: Option<f64>,
    triangle: Vec<f64>,
}

/// A time system of the messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum TimeSystem {
    #[default]
    Utc,
    /// Seconds of TAI minus those of this system, in milliseconds.
    FromTai(i32),
}

impl Message {
    fn add(&mut self, line: &str) -> Result<(), String> {
        if line.is_empty() || line.starts_with("COMMENT") {
            return Ok(());
        }
        match line {
            "META_START" => {
                (self.part, self.segment) = (Part::Meta, self.segment + 1);
                (self.has_frame, self.has_time) = (false, false);
            }
            "META_STOP" => {
                if !(self.has_frame && self.has_time) {
                    return Err("REF_FRAME and TIME_SYSTEM are expected before it".to_owned());
                }
                self.part = Part::States;
            }
            "COVARIANCE_START" => self.part = Part::Covariance,
            "COVARIANCE_STOP" => self.part = Part::States,
            _ => match self.part {
                Part::Header => {}
                Part::Meta => self.meta(line)?,
                Part::States => self.state(line)?,
                Part::Covariance => self.covariance(line)?,
            },
        }
        Ok(())
    }

    fn meta(&mut self, line: &str) -> Result<(), String> {
        let Some((key, value)) = line.split_once('=').map(|(key, value)| (key.trim(), value.trim())) else {
            return Err(format!("{} is not KEY = VALUE", quoted(line)));
        };
        match key {
            "CENTER_NAME" if !value.eq_ignore_ascii_case("EARTH") => {
                return Err(format!("CENTER_NAME is {}, but EARTH is expected", quoted(value)));
            }
            "REF_FRAME" => {
                let upper = value.to_ascii_uppercase();
                let is_fixed = upper.starts_with("ITRF") || ["ECEF", "WGS84", "WGS-84"].contains(&upper.as_str());
                if !is_fixed {
                    return Err(format!(
                        "REF_FRAME is {}, but a frame that turns with the Earth is expected (ITRF, ITRF-97, ITRF2000, \
                         ...): convert the message, or write it in ITRF",
                        quoted(value)
                    ));
                }
                self.has_frame = true;
            }
            "TIME_SYSTEM" => {
                self.time = match value {
                    "UTC" => TimeSystem::Utc,
                    "TAI" => TimeSystem::FromTai(0),
                    "GPS" => TimeSystem::FromTai(19_000),
                    "TT" => TimeSystem::FromTai(-32_184),
                    _ => return Err(format!("TIME_SYSTEM is {}, but UTC, GPS, TAI or TT is expected", quoted(value))),
                };
                self.has_time = true;
            }
            _ => {}
        }
        Ok(())
    }

    fn state(&mut self, line: &str) -> Result<(), String> {
        let mut words = line.split_whitespace();
        let epoch = words.next().unwrap_or_default();
        let unix_s = self.unix_s(epoch)?;
        let numbers = words.map(number).collect::<Result<Vec<f64>, String>>()?;
        let [x, y, z, vx, vy, vz] = match numbers.as_slice() {
            [x, y, z, vx, vy, vz] | [x, y, z, vx, vy, vz, _, _, _] => [*x, *y, *z, *vx, *vy, *vz],
            other => {
                let what = "x, y, z, vx, vy, vz (km, km/s) are expected after the epoch, and maybe an acceleration";
                return Err(format!("{what}, but there are {} numbers", other.len()));
            }
        };
        let [position_m, velocity_m_s] = [[x, y, z], [vx, vy, vz]].map(|km| Vector3::from(km) * 1e3);
        self.states.push(State { unix_s, segment: self.segment, position_m, velocity_m_s });
        Ok(())
    }

    fn covariance(&mut self, line: &str) -> Result<(), String> {
        if let Some((key, value)) = line.split_once('=') {
            if key.trim() == "EPOCH" {
                self.epoch = Some(self.unix_s(value.trim())?);
                self.triangle.clear();
            }
            return Ok(());
        }
        self.triangle.extend(line.split_whitespace().map(number).collect::<Result<Vec<f64>, String>>()?);
        if self.triangle.len() < 21 {
            return Ok(());
        }
        let epoch = self.epoch.take().ok_or("a covariance has no EPOCH")?;
        let mut matrix = Matrix6::zeros();
        let places = (0..6).flat_map(|row| (0..=row).map(move |column| (row, column)));
        for ((row, column), value) in places.zip(&self.triangle) {
            (matrix[(row, column)], matrix[(column, row)]) = (*value, *value);
        }
        // The largest sigma of any direction is the same in every frame, and no axis is surer than it.
        let largest = |first: usize| -> f64 {
            let block: Matrix3<f64> = matrix.fixed_view::<3, 3>(first, first).into_owned();
            1e3 * block.symmetric_eigenvalues().max().max(0.0).sqrt()
        };
        self.sigmas.push((epoch, [largest(0), largest(3)]));
        self.triangle.clear();
        Ok(())
    }

    /// Returns a time of the message in seconds since 1970, UTC.
    fn unix_s(&self, text: &str) -> Result<f64, String> {
        let seconds = seconds_since_1970(text)
            .ok_or_else(|| format!("{} is no epoch such as 2019-06-13T04:00:00.000", quoted(text)))?;
        Ok(match self.time {
            TimeSystem::Utc => seconds,
            TimeSystem::FromTai(ms) => unix_from_tai_s(seconds + 1e-3 * f64::from(ms)),
        })
    }

    /// Returns the states as fixes, with those in between, and the number of these.
    fn fixes(mut self, utc_unix_s: f64) -> (Vec<Fix>, usize) {
        self.states.sort_by(|a, b| a.unix_s.total_cmp(&b.unix_s));
        self.sigmas.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (mut out, mut filled) = (Vec::new(), 0);
        for (i, state) in self.states.iter().enumerate() {
            let next = self.states.get(i + 1).filter(|next| next.segment == state.segment);
            let step_s = next.map_or(0.0, |next| next.unix_s - state.unix_s);
            let parts = if step_s <= FILLED_S { (step_s / FILL_S).ceil().max(1.0) } else { 1.0 };
            let before = self.sigmas.partition_point(|(epoch, _)| *epoch <= state.unix_s + 1e-6);
            let known = before.checked_sub(1).or((!self.sigmas.is_empty()).then_some(0));
            let sigmas = known.and_then(|i| self.sigmas.get(i)).map_or([f64::NAN; 2], |(_, sigmas)| *sigmas);
            // The errors of states in between are those of the states themselves.
            let [position_sigma_m, velocity_sigma_m_s] = sigmas.map(|sigma| sigma * parts.sqrt());
            for part in 0..parts as usize {
                let (position_m, velocity_m_s) = match next {
                    Some(next) if part > 0 => between(state, next, part as f64 / parts),
                    _ => (state.position_m, state.velocity_m_s),
                };
                out.push(Fix {
                    time_s: state.unix_s + step_s * part as f64 / parts - utc_unix_s,
                    position_m: Vector::from(position_m),
                    velocity_m_s: Vector::from(velocity_m_s),
                    position_sigma_m,
                    velocity_sigma_m_s,
                });
            }
            filled += parts as usize - 1;
        }
        (out, filled)
    }
}

/// Returns position and velocity between two states, by the polynomial of third degree through both (Hermite).
fn between(a: &State, b: &State, t: f64) -> (Vector3<f64>, Vector3<f64>) {
    let h = b.unix_s - a.unix_s;
    let (t2, t3) = (t * t, t * t * t);
    let [pa, pb, va, vb] = [a.position_m, b.position_m, a.velocity_m_s * h, b.velocity_m_s * h];
    let position =
        pa * (2.0 * t3 - 3.0 * t2 + 1.0) + va * (t3 - 2.0 * t2 + t) + pb * (3.0 * t2 - 2.0 * t3) + vb * (t3 - t2);
    let slope = (pa - pb) * (6.0 * t2 - 6.0 * t) + va * (3.0 * t2 - 4.0 * t + 1.0) + vb * (3.0 * t2 - 2.0 * t);
    (position, slope / h)
}

fn number(word: &str) -> Result<f64, String> {
    word.parse::<f64>().ok().filter(|x| x.is_finite()).ok_or_else(|| format!("{} is not a number", quoted(word)))
}

/// Returns the seconds since 1970 of a calendar date or of a day of the year (CCSDS 301.0-B-4, codes A and B).
fn seconds_since_1970(text: &str) -> Option<f64> {
    let (date, time) = text.trim_end_matches('Z').split_once('T')?;
    let parts: Vec<i16> = date.split('-').map(|part| part.parse().ok()).collect::<Option<_>>()?;
    let date = match *parts.as_slice() {
        [year, month, day] => Date::new(year, i8::try_from(month).ok()?, i8::try_from(day).ok()?).ok()?,
        [year, day] => Date::new(year, 1, 1).ok()?.checked_add(jiff::Span::new().days(day - 1)).ok()?,
        _ => return None,
    };
    let mut clock = time.splitn(3, ':');
    let mut part = || clock.next()?.parse::<f64>().ok().filter(|x| (0.0..61.0).contains(x));
    let (hours, minutes, seconds) = (part()?, part()?, part()?);
    let midnight = DateTime::from_parts(date, jiff::civil::Time::midnight()).to_zoned(jiff::tz::TimeZone::UTC).ok()?;
    Some(midnight.timestamp().as_second() as f64 + 3600.0 * hours + 60.0 * minutes + seconds)
}
