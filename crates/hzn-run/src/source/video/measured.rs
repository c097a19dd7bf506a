//! What an action camera measured while it filmed: positions, rates of rotation, accelerations, and how long a picture
//! is read out.
//!
//! The axes are those of hzn: x to the right, y down, z along the line of sight. GoPro's axes point to the left, back
//! and up, seen from behind the camera, and follow the right-hand rule.

use std::path::Path;

use hzn_core::ellipsoid::{WGS84_A_M, WGS84_B_M, from_geodetic};
use hzn_files::FrameData;

use super::gpmf::{Entry, entries};
use super::mp4::{self, Payload};

/// Longest time between a picture and the fixes around it, seconds. The receiver has ten or eighteen a second.
const MAX_FIX_GAP_S: f64 = 2.0;
/// Half of the time over which the rates of a picture are averaged, seconds: longer than a picture is read out.
const HALF_RATE_S: f64 = 0.01;
/// Longest time in which a picture can be read out, seconds.
const MAX_READOUT_S: f64 = 0.2;
/// Seconds from 1970 to 2000, from which the receiver counts days.
const Y2000_S: f64 = 946_684_800.0;
/// The order of the axes of a camera that does not tell it: that of the first one.
const FIRST_ORDER: &str = "ZXY";

/// A vector at a time of the video.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Time in seconds on the clock of the video.
    pub time_s: f64,
    /// The vector, in the axes of the camera.
    pub xyz: [f64; 3],
}

/// A position at a time of the video.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fix {
    /// Time in seconds on the clock of the video.
    pub time_s: f64,
    /// Latitude and longitude (WGS-84), degrees.
    pub lat_lon_deg: [f64; 2],
    /// Height in metres. Some cameras give it above the sea level, and not above the ellipsoid, which differs by up to
    /// 0.1 km.
    pub height_m: f64,
    /// Time in UTC, seconds since 1970, if the receiver tells it.
    pub utc_s: Option<f64>,
}

/// What an action camera measured.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Measured {
    /// The camera, as it names itself.
    pub camera: String,
    /// Rates of rotation, rad/s.
    pub rates: Vec<Sample>,
    /// Accelerations without gravity (specific forces), m/s².
    pub accelerations: Vec<Sample>,
    /// Positions with a fix.
    pub fixes: Vec<Fix>,
    /// Number of positions without a fix.
    pub without_fix: u64,
    /// Time from the first to the last row of a picture, seconds.
    pub readout_s: Option<f64>,
}

/// Reads what the camera of a video measured; `None` if the video does not have it.
///
/// # Errors
/// The file cannot be read.
pub fn read(path: &Path) -> std::io::Result<Option<Measured>> {
    let Some(metadata) = mp4::read(path)? else { return Ok(None) };
    let mut measured = Measured::default();
    for device in entries(&metadata.global).filter(|entry| entry.key == b"DEVC") {
        device.entries().for_each(|entry| measured.add_setting(entry));
    }
    for payload in &metadata.payloads {
        for device in entries(&payload.bytes).filter(|entry| entry.key == b"DEVC") {
            for entry in device.entries() {
                measured.add_setting(entry);
                if entry.key == b"STRM" {
                    measured.add_stream(entry, payload);
                }
            }
        }
    }
    let Measured { rates, accelerations, fixes, readout_s, .. } = &measured;
    let is_empty = rates.is_empty() && accelerations.is_empty() && fixes.is_empty() && readout_s.is_none();
    Ok((!is_empty).then_some(measured))
}

impl Measured {
    fn add_setting(&mut self, entry: Entry<'_>) {
        match entry.key {
            b"MINF" => self.camera = entry.text(),
            b"DVNM" if self.camera.is_empty() => self.camera = entry.text(),
            b"SROT" => self.add_readout(entry),
            _ => {}
        }
    }

    fn add_readout(&mut self, entry: Entry<'_>) {
        let seconds = entry.value().map(|milliseconds| 1e-3 * milliseconds);
        self.readout_s = self.readout_s.or(seconds.filter(|s| *s > 0.0 && *s < MAX_READOUT_S));
    }

    /// Adds a stream of samples. What describes them comes before them.
    fn add_stream(&mut self, stream: Entry<'_>, payload: &Payload) {
        let (mut scale, mut types, mut order) = (Vec::new(), Vec::new(), FIRST_ORDER.to_owned());
        let (mut has_fix, mut utc_s) = (true, None);
        for entry in stream.entries() {
            match entry.key {
                b"SCAL" => scale = entry.samples(&[]).into_iter().flatten().collect(),
                b"TYPE" => types = entry.text().into_bytes(),
                b"ORIN" => order = entry.text(),
                b"GPSF" => has_fix = entry.value().is_some_and(|fix| fix >= 2.0),
                b"GPSU" => utc_s = utc(&entry.text()),
                b"SROT" => self.add_readout(entry),
                b"GYRO" => self.rates.extend(vectors(&scaled(entry, &scale, &types), &order, payload)),
                b"ACCL" => self.accelerations.extend(vectors(&scaled(entry, &scale, &types), &order, payload)),
                b"GPS5" => {
                    let rows = scaled(entry, &scale, &types);
                    let begin_s = payload.time_s;
                    self.add_fixes(&rows, payload, |_, time_s| (has_fix, utc_s.map(|utc_s| utc_s + time_s - begin_s)));
                }
                b"GPS9" => {
                    let rows = scaled(entry, &scale, &types);
                    self.add_fixes(&rows, payload, |row, _| match *row {
                        [_, _, _, _, _, days, seconds, _, fix, ..] => {
                            (fix >= 2.0, Some(Y2000_S + 86_400.0 * days + seconds))
                        }
                        _ => (false, None),
                    });
                }
                _ => {}
            }
        }
    }

    /// Adds the positions of a payload. A camera writes the same ones in the old and in the new form; those of a time
    /// that is there already are left out.
    fn add_fixes(&mut self, rows: &[Vec<f64>], payload: &Payload, facts: impl Fn(&[f64], f64) -> (bool, Option<f64>)) {
        if self.fixes.last().is_some_and(|last| last.time_s >= payload.time_s) {
            return;
        }
        for (row, time_s) in rows.iter().zip(times(rows.len(), payload)) {
            let [lat, lon, height_m, ..] = row[..] else { continue };
            let (has_fix, utc_s) = facts(row, time_s);
            if has_fix && lat.abs() <= 90.0 && lon.abs() <= 180.0 {
                self.fixes.push(Fix { time_s, lat_lon_deg: [lat, lon], height_m, utc_s });
            } else {
                self.without_fix += 1;
            }
        }
    }

    /// Returns what is known about the picture of a time, as a row of frames.csv.
    pub(super) fn at(&self, time_s: f64) -> FrameData {
        let fix = self.fix_at(time_s);
        let position_km = |fix: Fix| {
            let [lat, lon] = fix.lat_lon_deg.map(f64::to_radians);
            from_geodetic(lat, lon, fix.height_m, WGS84_A_M, WGS84_B_M).map(|m| 1e-3 * m)
        };
        FrameData {
            time_s: Some(time_s),
            utc_s: fix.and_then(|fix| fix.utc_s),
            altitude_km: fix.map(|fix| 1e-3 * fix.height_m),
            position_km: fix.map(position_km),
            rate_rad_s: self.rate_at(time_s),
            ..FrameData::default()
        }
    }

    /// Returns the position at a time, between the two fixes around it.
    fn fix_at(&self, time_s: f64) -> Option<Fix> {
        let next = self.fixes.partition_point(|fix| fix.time_s < time_s);
        let is_near = |fix: &&Fix| (fix.time_s - time_s).abs() <= MAX_FIX_GAP_S;
        let after = self.fixes.get(next).filter(is_near);
        let before = next.checked_sub(1).and_then(|i| self.fixes.get(i)).filter(is_near);
        let (Some(before), Some(after)) = (before, after) else {
            let fix = *before.or(after)?;
            return Some(Fix { time_s, utc_s: fix.utc_s.map(|utc_s| utc_s + time_s - fix.time_s), ..fix });
        };
        let part = (time_s - before.time_s) / (after.time_s - before.time_s).max(1e-9);
        let between = |a: f64, b: f64| a + part * (b - a);
        let [lat, lon] = before.lat_lon_deg;
        // At the date line, two longitudes that are 360 degrees apart are the same.
        let turn = (after.lat_lon_deg[1] - lon + 180.0).rem_euclid(360.0) - 180.0;
        Some(Fix {
            time_s,
            lat_lon_deg: [between(lat, after.lat_lon_deg[0]), lon + part * turn],
            height_m: between(before.height_m, after.height_m),
            utc_s: before.utc_s.map(|utc_s| utc_s + time_s - before.time_s),
        })
    }

    /// Returns the mean of the rates around a time.
    fn rate_at(&self, time_s: f64) -> Option<[f64; 3]> {
        let place = |time_s: f64| self.rates.partition_point(|sample| sample.time_s < time_s);
        let around = self.rates.get(place(time_s - HALF_RATE_S)..place(time_s + HALF_RATE_S))?;
        let n = around.len() as f64;
        (n > 0.0).then(|| [0, 1, 2].map(|i| around.iter().filter_map(|s| s.xyz.get(i)).sum::<f64>() / n))
    }

    /// Says what the camera measured, and what is missing.
    pub fn describe(&self) -> String {
        let camera = if self.camera.is_empty() { "the camera" } else { self.camera.as_str() };
        let parts = [
            (!self.fixes.is_empty(), "positions", "no position"),
            (self.fixes.iter().any(|fix| fix.utc_s.is_some()), "UTC", "no UTC"),
            (!self.rates.is_empty(), "rates of rotation", "no rates"),
        ];
        let there: Vec<&str> = parts.iter().filter(|part| part.0).map(|part| part.1).collect();
        let mut missing: Vec<&str> = parts.iter().filter(|part| !part.0).map(|part| part.2).collect();
        missing.push("no attitude");
        let fixes = if self.fixes.is_empty() && self.without_fix > 0 { " (its receiver had no fix)" } else { "" };
        let there = if there.is_empty() { "nothing that a picture needs".to_owned() } else { there.join(", ") };
        format!("{camera} recorded {there}; the video has {}{fixes}", missing.join(", "))
    }
}

/// Returns the samples of an entry in their units. There is one divisor, or one for each value.
fn scaled(entry: Entry<'_>, scale: &[f64], types: &[u8]) -> Vec<Vec<f64>> {
    let mut rows = entry.samples(types);
    for (i, value) in rows.iter_mut().flat_map(|row| row.iter_mut().enumerate()) {
        let divisor = scale.get(i).or(scale.first()).copied().filter(|divisor| *divisor != 0.0);
        *value /= divisor.unwrap_or(1.0);
    }
    rows
}

/// Returns the times of `count` samples that fill a payload evenly.
fn times(count: usize, payload: &Payload) -> impl Iterator<Item = f64> + use<> {
    let (begin_s, step_s) = (payload.time_s, payload.duration_s / count.max(1) as f64);
    (0..count).map(move |i| begin_s + step_s * i as f64)
}

/// Returns vectors in the axes of hzn. `order` names the axis of each value; a small letter has the other sign.
fn vectors(rows: &[Vec<f64>], order: &str, payload: &Payload) -> Vec<Sample> {
    let one = |(row, time_s): (&Vec<f64>, f64)| {
        let axis = |name: char| {
            let (value, letter) = row.iter().zip(order.chars()).find(|(_, c)| c.eq_ignore_ascii_case(&name))?;
            Some(if letter.is_ascii_uppercase() { *value } else { -value })
        };
        let [left, back, up] = [axis('X')?, axis('Y')?, axis('Z')?];
        let xyz = [-left, -up, -back];
        xyz.iter().all(|x| x.is_finite()).then_some(Sample { time_s, xyz })
    };
    rows.iter().zip(times(rows.len(), payload)).filter_map(one).collect()
}

/// Reads a time as the receiver writes it: `yymmddhhmmss.sss`.
fn utc(text: &str) -> Option<f64> {
    let [date, clock] = [text.get(..6)?, text.get(6..)?];
    let pair = |text: &str, at: usize| text.get(at..at + 2).map(str::to_owned);
    let (year, month, day) = (pair(date, 0)?, pair(date, 2)?, pair(date, 4)?);
    let (hour, minute, second) = (pair(clock, 0)?, pair(clock, 2)?, clock.get(4..)?);
    hzn_files::time::unix_seconds(&format!("20{year}-{month}-{day}T{hour}:{minute}:{second}Z"))
}
