//! Finds altitudes and positions in a frames.csv that are possible but look wrong.

use std::path::Path;

use hzn_core::Config;
use hzn_core::body::Kind;
use hzn_core::ellipsoid::{WGS84_A_M, WGS84_B_M, geodetic};

use super::data::{FrameData, Frames};
use crate::rig::turn_after;
use crate::{Problem, plausible};

/// Largest plausible distance of a camera, in radii of the body: about twice the Moon's distance from the Earth.
const MAX_DISTANCE_RADII: f64 = 120.0;
/// Largest plausible rate of the altitude, in km/s. Objects that fly by the Earth reach 11 to 20 km/s.
const MAX_CLIMB_KM_S: f64 = 30.0;

/// Largest plausible time, in seconds: the year 5138 as seconds since 1970. The milliseconds since 1970 are above it
/// from 1973 on.
const MAX_TIME_S: f64 = 1e11;
/// Altitudes above the equator at which a vehicle is ballistic or in orbit, and moves against the ground, in
/// kilometres. A geostationary satellite does not move against the ground.
const SLOW_ALTITUDES_KM: std::ops::Range<f64> = 150.0..10_000.0;
/// Smallest plausible speed over ground at these altitudes, in km/s. An orbit has at least 1.5 km/s there. A sounding
/// rocket is slower only around its highest point, while all rows must be this slow.
const MIN_SPEED_KM_S: f64 = 0.02;

/// Largest plausible rate, in rad/s: ten turns a second, twice the spin of a sounding rocket (5 turns a second).
const MAX_RATE_RAD_S: f64 = 10.0 * core::f64::consts::TAU;
/// Largest plausible turn while a picture is read out, rad. A limb that moves as far has no place in the picture. A
/// rocket that spins at 5 turns a second reaches it with a readout time of 3 ms.
const MAX_TURN_RAD: f64 = 0.1;
/// Fewest turns between rows that say something about the rates. With a faster turn than half a circle from row to row,
/// one or two may disagree by chance.
const MIN_TURNS: usize = 3;
/// Right rates leave less of the turns between rows than no rates do, and rates with a wrong sign twice as much. The
/// limit lies in the middle.
const MAX_REST: f64 = 1.5;

/// Number of warnings of a kind that are listed one by one; the others are only counted.
const MAX_LISTED: usize = 3;

/// Returns the altitude in kilometres of a position (ECEF, kilometres): above WGS-84 for `earth`, else above the
/// radius. The result is `None` for Sun and Moon, because a position relative to the Earth does not give their
/// distance.
pub fn altitude_at_km(position_km: [f64; 3], kind: Kind, radius_km: f64) -> Option<f64> {
    match kind {
        Kind::Earth => Some(geodetic(position_km.map(|km| km * 1e3), WGS84_A_M, WGS84_B_M).0 / 1e3),
        Kind::Sun | Kind::Moon => None,
        _ => Some(position_km.iter().map(|x| x * x).sum::<f64>().sqrt() - radius_km),
    }
}

impl FrameData {
    /// Returns what looks wrong in the data of a single picture, as [`Frames::check_sensor`] finds it in a file.
    pub fn check_sensor(&self, config: &Config) -> Vec<String> {
        let mut one = Frames::new(Path::new(""));
        one.push(self.clone());
        one.check_sensor(config).into_iter().map(|problem| problem.what).collect()
    }
}

impl Frames {
    /// Runs [`Self::check_altitudes`] for every body of a sensor. A warning is returned only once.
    pub fn check_sensor(&self, config: &Config) -> Vec<Problem> {
        let bodies = config.each_body();
        // If Sun or Moon are sought together with the Earth, the altitudes are those above the Earth.
        let only_free = bodies.iter().all(|b| b.half_angle_is_free());
        let mut warnings: Vec<Problem> = Vec::new();
        for body in bodies.iter().filter(|b| only_free || !b.half_angle_is_free()) {
            for warning in self.check_altitudes(body.kind, body.mean_radius_km()) {
                if !warnings.contains(&warning) {
                    warnings.push(warning);
                }
            }
        }
        warnings.extend(self.explain_unused_columns(config));
        warnings.extend(self.explain_unused_attitude(config));
        let milliseconds = self.suspect_milliseconds();
        // Positions say nothing about their axes if the times have another unit.
        let is_earth = bodies.first().is_some_and(|body| body.kind == Kind::Earth) && milliseconds.is_none();
        warnings.extend(milliseconds);
        warnings.extend(is_earth.then(|| self.suspect_inertial_positions()).flatten());
        warnings.extend(self.suspect_rates().or_else(|| self.suspect_turn_of_a_picture(config)));
        warnings.extend(self.explain_missing_rates(config));
        warnings
    }

    /// Returns one warning if rows of a rolling shutter have no rate. Their pictures are not corrected, and sigma does
    /// not include the error.
    fn explain_missing_rates(&self, config: &Config) -> Option<Problem> {
        let readout_s = config.camera.readout_s;
        let without: Vec<&FrameData> = self.rows.iter().filter(|row| row.rate_rad_s.is_none()).collect();
        let row = without.first().filter(|_| readout_s != 0.0)?;
        let what = format!(
            "{} of {} rows have no rate_x, rate_y, rate_z, which camera.readout_s = {readout_s} needs: the rows of a \
             picture of a turning camera are not corrected, and sigma does not include this error",
            without.len(),
            self.rows.len()
        );
        Some(self.problem(row, what))
    }

    /// Returns the largest rate of a row in rad/s, 0 without rates.
    pub fn largest_rate_rad_s(&self) -> f64 {
        let size = |[x, y, z]: [f64; 3]| x.hypot(y).hypot(z);
        self.rows.iter().filter_map(|row| row.rate_rad_s.map(size)).fold(0.0, f64::max)
    }

    /// Returns one warning if the rows have an attitude, but neither a position nor an ellipsoid whose position is
    /// fitted. Only with one of them the attitude predicts a direction.
    fn explain_unused_attitude(&self, config: &Config) -> Option<Problem> {
        let has_position = self.rows.iter().any(|row| row.position_km.is_some());
        if has_position || config.each_body().iter().any(|body| config.fits_position(body)) {
            return None;
        }
        let row = self.rows.iter().find(|row| row.q_fixed_from_camera_wxyz.is_some())?;
        let what = "without a position, nothing uses qw, qx, qy, qz: add x_km, y_km, z_km";
        Some(self.problem(row, what))
    }

    /// Returns one warning if a picture turns implausibly far while it is read out. Attitudes, where the table has
    /// them, already confirmed the rates.
    fn suspect_turn_of_a_picture(&self, config: &Config) -> Option<Problem> {
        if self.rows.iter().any(|row| row.q_fixed_from_camera_wxyz.is_some()) {
            return None;
        }
        let readout_s = config.camera.readout_s.abs();
        let rate = |row: &FrameData| row.rate_rad_s.map_or(0.0, |[x, y, z]| x.hypot(y).hypot(z));
        let row = self.rows.iter().find(|row| rate(row) * readout_s > MAX_TURN_RAD)?;
        let what = format!(
            "at {:.2} rad/s the camera turns by {:.1} deg within camera.readout_s = {readout_s}, which is implausibly \
             far: is the rate in degrees per second? rate_x, rate_y, rate_z are rad/s",
            rate(row),
            (rate(row) * readout_s).to_degrees()
        );
        Some(self.problem(row, what))
    }

    /// Returns one warning if times are probably not in seconds: if they are far in the future as seconds since 1970,
    /// or if the positions are those of a spacecraft that hardly moves.
    fn suspect_milliseconds(&self) -> Option<Problem> {
        if let Some(row) = self.rows.iter().find(|row| row.time_s.is_some_and(|t| t.abs() > MAX_TIME_S)) {
            let t = row.time_s.unwrap_or_default();
            let what =
                format!("time_s is {t}, which as seconds since 1970 is no time of a flight; is it in milliseconds?");
            return Some(self.problem(row, what));
        }
        let known: Vec<_> = self.rows.iter().filter_map(|r| Some((r, r.time_s?, r.position_km?))).collect();
        let is_in_space = |[x, y, z]: [f64; 3]| {
            let above_km = (x * x + y * y + z * z).sqrt() - WGS84_A_M / 1e3;
            SLOW_ALTITUDES_KM.contains(&above_km)
        };
        if known.len() < 3 || !known.iter().all(|(.., position)| is_in_space(*position)) {
            return None;
        }
        let speed = |a: &(_, f64, [f64; 3]), b: &(_, f64, [f64; 3])| {
            let moved: f64 = a.2.iter().zip(b.2).map(|(a, b)| (b - a) * (b - a)).sum();
            moved.sqrt() / (b.1 - a.1)
        };
        let steps = known.iter().zip(known.iter().skip(1)).filter(|(a, b)| b.1 > a.1 && a.2 != b.2);
        let speeds: Vec<f64> = steps.map(|(a, b)| speed(a, b)).collect();
        let fastest = speeds.iter().copied().fold(0.0, f64::max);
        if speeds.is_empty() || fastest > MIN_SPEED_KM_S {
            return None;
        }
        let (row, ..) = known.first()?;
        let what = format!(
            "with time_s in seconds the positions move by at most {:.1} m/s, which is too slow in space; is time_s in \
             milliseconds?",
            fastest * 1e3
        );
        Some(self.problem(row, what))
    }

    /// Returns one warning if the rates contradict the turns of the table's own attitudes, or without attitudes, if a
    /// rate is implausibly large: rates in degrees per second are 57 times too large.
    fn suspect_rates(&self) -> Option<Problem> {
        let known: Vec<_> = self.rows.iter().filter_map(|r| Some((r, r.time_s?, r.rate_rad_s?))).collect();
        let attitude = |r: &FrameData| r.q_fixed_from_camera_wxyz;
        type Rated<'a> = (&'a FrameData, f64, [f64; 3]);
        let turn = |(a, b): (&Rated<'_>, &Rated<'_>)| {
            let dt_s = b.1 - a.1;
            let [w, x, y, z] = attitude(a.0)?;
            let turned = turn_after([w, -x, -y, -z], attitude(b.0)?);
            // What is left of the turn if the camera turns by the mean of both rates times a factor.
            let rest = |factor: f64| {
                let by = [0, 1, 2].map(|i| -0.5 * factor * dt_s * (a.2[i] + b.2[i]));
                angle(turn_after(turned, from_rotation_vector(by)))
            };
            (dt_s > 0.0).then(|| [rest(1.0), rest(1f64.to_radians()), rest(0.0)])
        };
        let turns: Vec<[f64; 3]> = known.iter().zip(known.iter().skip(1)).filter_map(turn).collect();
        let size = |[x, y, z]: [f64; 3]| x.hypot(y).hypot(z);
        let hint = "is it in degrees per second? rate_x, rate_y, rate_z are rad/s";
        if turns.len() < MIN_TURNS {
            let every = self.rows.iter().filter_map(|r| Some((r, size(r.rate_rad_s?))));
            let (row, rate) = every.into_iter().find(|(_, rate)| *rate > MAX_RATE_RAD_S)?;
            return Some(self.problem(row, format!("the rate is {rate:.1} rad/s, which is implausibly large: {hint}")));
        }
        let [told, in_degrees, none] = [0, 1, 2].map(|i| median(turns.iter().map(|turn| turn[i]).collect()));
        if told <= MAX_REST * none {
            return None;
        }
        let (row, ..) = known.first()?;
        let hint = if MAX_REST * in_degrees < none { hint } else { "are its axes those of the camera, and its signs?" };
        let what = format!(
            "the attitudes turn by {:.2} deg from row to row, and the rates miss that by {:.2} deg (medians): {hint}",
            none.to_degrees(),
            told.to_degrees()
        );
        Some(self.problem(row, what))
    }

    /// Returns one warning if the rows have columns that only the fit of a position uses, and no position is fitted.
    fn explain_unused_columns(&self, config: &Config) -> Option<Problem> {
        if config.each_body().iter().any(|body| config.fits_position(body)) {
            return None;
        }
        let row = self.rows.iter().find(|row| row.range_km.is_some() || row.pole_camera.is_some())?;
        let column = if row.range_km.is_some() { "range_km" } else { "pole_x, pole_y, pole_z" };
        let what = format!("{column} is used only for a position; set fit.position = true in sensor.toml");
        Some(self.problem(row, what))
    }

    /// Returns warnings for values that are possible but look wrong: altitude and position of a row that differ by more
    /// than 0.1 km, altitudes and positions that are probably in metres, and altitudes that are not used.
    pub fn check_altitudes(&self, kind: Kind, radius_km: f64) -> Vec<Problem> {
        let contradiction = |row: &FrameData| {
            let km = altitude_at_km(row.position_km?, kind, radius_km)?;
            // A spacecraft sees a planet from any distance.
            if km > MAX_DISTANCE_RADII * radius_km && kind.planet().is_none() && kind != Kind::Ellipsoid {
                let what = format!(
                    "the position is at {km:.0} km; x_km, y_km, z_km are kilometres: are the values in metres?"
                );
                return Some(self.problem(row, what));
            }
            let altitude_km = row.altitude_km?;
            let what = format!("altitude_km is {altitude_km} but the position is at {km:.3} km; the position is used");
            ((km - altitude_km).abs() > 0.1).then(|| self.problem(row, what))
        };
        let mut all = self.rows.iter().filter_map(contradiction);
        let mut warnings: Vec<Problem> = all.by_ref().take(MAX_LISTED).collect();
        match all.count() {
            0 => {}
            more => warnings.push(Problem::new(&self.path, format!("{more} further rows with a warning of this kind"))),
        }
        warnings.extend(self.suspect_metres(kind, radius_km));
        if let (Some(what), Some(row)) =
            (plausible::explain_unused_altitude(kind), self.rows.iter().find(|r| r.altitude_km.is_some()))
        {
            warnings.push(self.problem(row, format!("altitude_km {what}")));
        }
        warnings
    }

    /// Returns one warning if altitudes, or their change from row to row, are probably in metres.
    fn suspect_metres(&self, kind: Kind, radius_km: f64) -> Option<Problem> {
        if plausible::explain_unused_altitude(kind).is_some() {
            return None;
        }
        let is_far =
            |row: &&FrameData| row.altitude_km.is_some_and(|h| h > plausible::max_altitude_km(kind, radius_km));
        if let Some(row) = self.rows.iter().find(is_far) {
            let h = row.altitude_km.unwrap_or_default();
            let what = format!("altitude_km is {h}, which {}", plausible::suspect_metres(kind, h));
            return Some(self.problem(row, what));
        }
        let known: Vec<_> = self.rows.iter().filter_map(|r| Some((r, r.time_s?, r.altitude_km?))).collect();
        let rate = |(a, b): (&(_, f64, f64), &(_, f64, f64))| (b.2 - a.2) / (b.1 - a.1);
        let pairs = known.iter().zip(known.iter().skip(1)).filter(|(a, b)| b.1 > a.1);
        let (row, km_s) = pairs.map(|pair| (pair.1.0, rate(pair))).find(|(_, rate)| rate.abs() > MAX_CLIMB_KM_S)?;
        let what = format!("altitude_km changes by {km_s:.0} km/s, which is implausible; is it in metres?");
        Some(self.problem(row, what))
    }
}

/// Returns the angle of a rotation in radians, from 0 to pi.
fn angle([w, x, y, z]: [f64; 4]) -> f64 {
    2.0 * x.hypot(y).hypot(z).atan2(w.abs())
}

/// Returns the rotation about a vector by its length in radians.
fn from_rotation_vector([x, y, z]: [f64; 3]) -> [f64; 4] {
    let angle = x.hypot(y).hypot(z);
    let (sin, cos) = (0.5 * angle).sin_cos();
    let scale = if angle > 0.0 { sin / angle } else { 0.5 };
    [cos, scale * x, scale * y, scale * z]
}

/// Returns the middle value; 0 without values.
pub(super) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::parse;

    fn read(text: &str) -> Result<Frames, String> {
        parse(text, Path::new("frames.csv")).map_err(|e| e.to_string())
    }

    #[test]
    fn altitude_and_position_that_disagree_are_reported() {
        let f = read("file,altitude_km,x_km,y_km,z_km\na,400,6778.137,0,0\nb,401,6778.137,0,0\n").unwrap();
        let warnings = f.check_altitudes(Kind::Earth, 6371.0);
        assert_eq!(warnings.len(), 1);
        assert!(warnings[0].to_string().starts_with("frames.csv:3: b: altitude_km is 401 but"), "{}", warnings[0]);
    }

    #[test]
    fn altitudes_in_metres_are_suspected_once() {
        let warnings = |text: &str, kind| {
            let all = read(text).unwrap().check_altitudes(kind, 6371.0);
            all.iter().map(ToString::to_string).collect::<Vec<_>>()
        };
        // A balloon: no altitude is too large, but the ascent is too fast.
        let balloon = "file,time_s,altitude_km\na,0,300\nb,60,600\nc,120,3900\n";
        let found = warnings(balloon, Kind::Earth);
        assert_eq!(found.len(), 1);
        assert!(found[0].starts_with("frames.csv:4: c: altitude_km changes by 55 km/s"), "{found:?}");
        let orbit = warnings("file,altitude_km\na,517500\nb,517600\n", Kind::Earth);
        assert_eq!(orbit, ["frames.csv:2: a: altitude_km is 517500, which is implausibly large: is it in metres?"]);
        assert!(warnings("file,time_s,altitude_km\na,0,60\nb,1,61.5\nc,1,90\n", Kind::Earth).is_empty());
        let moon = warnings("file,altitude_km\na,100\nb,100\n", Kind::Moon);
        assert!(moon.len() == 1 && moon[0].contains("altitude_km is not used: kind = \"moon\""), "{moon:?}");
    }

    #[test]
    fn milliseconds_are_suspected() {
        let told = |text: &str| read(text).unwrap().suspect_milliseconds().map(|w| w.to_string());
        let unix = told("file,time_s\na,1605861000250\nb,1605861000750\n").unwrap();
        assert!(
            unix.starts_with("frames.csv:2: a: time_s is 1605861000250") && unix.ends_with("milliseconds?"),
            "{unix}"
        );
        // 7.6 km/s, once with seconds and once with milliseconds.
        let orbit = |unit: f64| {
            let row = |i: u32| {
                let angle = 0.00112 * f64::from(i);
                format!("{i},{},{},{},0\n", f64::from(i) * unit, 6778.0 * angle.cos(), 6778.0 * angle.sin())
            };
            told(&("file,time_s,x_km,y_km,z_km\n".to_owned() + &(0..4).map(row).collect::<String>()))
        };
        assert_eq!(orbit(1.0), None);
        let slow = orbit(1000.0).unwrap();
        assert!(slow.contains("at most 7.6 m/s") && slow.ends_with("is time_s in milliseconds?"), "{slow}");
        // A balloon is as slow, and a geostationary satellite slower.
        for radius_km in [6400.0, 42_164.0] {
            let rows = format!(
                "file,time_s,x_km,y_km,z_km\na,0,{radius_km},0,0\nb,1,{radius_km},0.005,0\nc,2,{radius_km},0.01,0\n"
            );
            assert_eq!(told(&rows), None);
        }
    }

    #[test]
    fn rates_in_degrees_per_second_are_suspected() {
        let told = |text: &str| read(text).unwrap().suspect_rates().map(|w| w.to_string());
        // About an axis that is none of the camera's, with a rate that changes: the attitudes of `turn`, told as
        // `rate`.
        let flight = |turn_rad_s: f64, rate_rad_s: f64, dt_s: f64, has_attitude: bool| {
            let mut text = "file,time_s,rate_x,rate_y,rate_z,qw,qx,qy,qz\n".to_owned();
            let axis = [0.48, -0.6, 0.64];
            let mut q = [0.5, 0.5, -0.5, 0.5];
            for i in 0..12 {
                let faster = 1.0 + 0.01 * f64::from(i);
                let [x, y, z] = axis.map(|a| a * rate_rad_s * faster);
                let [qw, qx, qy, qz] = q.map(|q: f64| if has_attitude { q.to_string() } else { String::new() });
                text += &format!("{i},{},{x},{y},{z},{qw},{qx},{qy},{qz}\n", f64::from(i) * dt_s);
                q = turn_after(q, from_rotation_vector(axis.map(|a| a * turn_rad_s * (faster + 0.005) * dt_s)));
            }
            told(&text)
        };
        for (rate, dt_s) in [(1e-3, 1.0), (0.035, 1.0), (0.5, 1.0), (0.5, 10.0), (6.0, 0.05), (31.4, 0.25), (31.4, 1.0)]
        {
            assert_eq!(flight(rate, rate, dt_s, true), None, "{rate} rad/s");
            assert_eq!(flight(rate, rate, dt_s, false), None, "{rate} rad/s");
        }
        for (rate, dt_s) in [(1e-3, 1.0), (0.035, 1.0), (0.5, 1.0), (6.0, 0.05)] {
            let found = flight(rate, rate.to_degrees(), dt_s, true).unwrap_or_default();
            assert!(found.contains("is it in degrees per second?"), "{rate} rad/s: {found}");
            let found = flight(rate, -rate, dt_s, true).unwrap_or_default();
            assert!(found.contains("are its axes those of the camera"), "{rate} rad/s: {found}");
        }
        let fast = flight(6.0, 6f64.to_degrees(), 0.1, false).unwrap_or_default();
        assert!(fast.contains("the rate is 343.8 rad/s, which is implausibly large: is it in degrees"), "{fast}");
    }

    #[test]
    fn no_picture_turns_far_while_it_is_read_out() {
        let mut camera = hzn_core::camera::Config::ideal(hzn_core::camera::Model::Pinhole, 64, 48, 60.0);
        camera.readout_s = -0.03;
        let told = |rate: f64| {
            let table = format!("file,altitude_km,rate_x,rate_y,rate_z\na,400,0,0,{rate}\n");
            read(&table).unwrap().check_sensor(&Config::new(camera.clone()))
        };
        // 5 deg/s in the wrong unit, and a fast turn in the right one.
        let wrong = told(5.0);
        assert!(wrong.len() == 1 && wrong[0].what.contains("turns by 8.6 deg within"), "{wrong:?}");
        assert!(told(90f64.to_radians()).is_empty());
    }

    #[test]
    fn an_attitude_without_a_position_is_reported() {
        let camera = hzn_core::camera::Config::ideal(hzn_core::camera::Model::Pinhole, 64, 48, 60.0);
        let told = |text: &str| read(text).unwrap().check_sensor(&Config::new(camera.clone()));
        let alone = told("file,altitude_km,qw,qx,qy,qz\na,400,1,0,0,0\n");
        assert!(alone.len() == 1 && alone[0].what.contains("nothing uses qw, qx, qy, qz"), "{alone:?}");
        assert!(told("file,x_km,y_km,z_km,qw,qx,qy,qz\na,6778,0,0,1,0,0,0\nb,,,,1,0,0,0\n").is_empty());
    }

    #[test]
    fn metres_are_suspected() {
        let f = read("file,x_km,y_km,z_km\na,6778137,0,0\nb,6778.137,0,0\n").unwrap();
        let warnings = f.check_altitudes(Kind::Earth, 6371.0);
        assert_eq!(warnings.len(), 1);
        assert!(warnings[0].to_string().contains("are the values in metres?"), "{}", warnings[0]);
    }
}
