//! The text of a command as packets.

use std::path::{Path, PathBuf};

use hzn_files::keys::Limits;
use hzn_flight::attitude::{AttitudeAndSun, Refused};
use hzn_flight::bytes::Writer;
use hzn_flight::cuc::Cuc;
use hzn_flight::messages::{Attitude, Function, MAX_READ, Mode, Navigation};
use hzn_flight::operations::Operations;
use hzn_flight::packet::{self, Apid, ApidBase};
use hzn_flight::{Parameters, parameters};
use hzn_fly::tell::Tell;

use crate::error::Error;
use crate::tai;

/// Returns the packet of a command with these user data.
///
/// # Errors
/// The data do not fit into a packet.
pub fn write_packet(base: ApidBase, sequence: u16, command: &str, user: &[u8]) -> Result<Vec<u8>, Error> {
    let mut bytes = vec![0; packet::MAX_BYTES];
    let n = packet::write(&mut bytes, base, Apid::Command, sequence, None, |w| w.bytes(user))
        .ok_or_else(|| Error::unusable(format!("{command:?}: too long for one packet; split it")))?;
    bytes.truncate(n);
    Ok(bytes)
}

/// Returns the user data of each packet of a command. `tell` gets remarks about it.
///
/// # Errors
/// The text is no command of the flight computer, or a value of it is refused.
pub fn encode(text: &str, tell: &Tell) -> Result<Vec<Vec<u8>>, Error> {
    let words: Vec<&str> = text.split_whitespace().collect();
    let Some((&verb, arguments)) = words.split_first() else { return Err(refuse(text, "is empty")) };
    if verb == "load" {
        let [path] = arguments else { return Err(refuse(text, "load takes one file, a sensor.toml")) };
        return load(Path::new(path), tell);
    }
    // `load` makes the packets that keep parameters and commit them.
    let is_command = |f: &Function| !matches!(f, Function::StageParameters | Function::CommitParameters);
    let commands = || Function::ALL.iter().copied().filter(is_command);
    let Some(function) = commands().find(|f| f.name() == verb) else {
        let names: Vec<&str> = commands().map(Function::name).chain(["load"]).collect();
        let hint = match hzn_files::nearest(verb, names.iter().copied()) {
            Some(near) => format!("did you mean {near:?}?"),
            None => format!("there are {}", names.join(", ")),
        };
        return Err(refuse(text, &format!("there is no such command; {hint}")));
    };
    let command = Command { text, function, arguments, tell };
    let user = match function {
        Function::SetMode => command.set_mode()?,
        Function::SetParameters | Function::TryParameters => command.set_parameters()?,
        Function::ReadParameters => command.read_parameters()?,
        Function::SetKnown => command.set_known()?,
        Function::Navigate => command.navigate()?,
        Function::SetAttitude => command.set_attitude()?,
        Function::SetTime => command.set_time()?,
        _ => command.without_arguments()?,
    };
    Ok(vec![user])
}

/// Returns the files that the commands read: a sensor.toml is loaded with its camera file.
pub fn loaded_files(commands: &[String]) -> Vec<PathBuf> {
    let file = |text: &String| Some(PathBuf::from(text.trim_start().strip_prefix("load")?.trim()));
    commands.iter().filter_map(file).flat_map(|path| hzn_files::files_of_sensor(&path)).collect()
}

/// Returns the error for a refused command.
fn refuse(command: &str, what: &str) -> Error {
    Error::unusable(format!("{command:?}: {what}"))
}

/// One command: its text, its function, and the words after the name of the function.
struct Command<'a> {
    text: &'a str,
    tell: &'a Tell,
    function: Function,
    arguments: &'a [&'a str],
}

impl Command<'_> {
    fn refuse(&self, what: &str) -> Error {
        refuse(self.text, what)
    }

    /// Returns the user data of the packet: the number of the function, and what `fill` writes.
    fn user_data(&self, fill: impl FnOnce(&mut Writer<'_>)) -> Result<Vec<u8>, Error> {
        let mut bytes = vec![0; packet::MAX_BYTES];
        let mut out = Writer::new(&mut bytes);
        out.u8(self.function as u8);
        fill(&mut out);
        let n = out.finish().ok_or_else(|| self.refuse("is too long for one packet; split it"))?;
        bytes.truncate(n);
        Ok(bytes)
    }

    fn set_mode(&self) -> Result<Vec<u8>, Error> {
        let mode = self.arguments.first().and_then(|w| Mode::ALL.iter().find(|m| m.name() == *w));
        match (mode, self.arguments.len()) {
            (Some(&mode), 1) => self.user_data(|w| w.u8(mode as u8)),
            _ => Err(self.refuse("modes are standby, flight, safe, shut-down")),
        }
    }

    fn set_parameters(&self) -> Result<Vec<u8>, Error> {
        let words = self.arguments;
        if words.is_empty() || !words.len().is_multiple_of(2) || words.len() > 160 {
            let what = format!("{} takes pairs of a name and a value, up to 80", self.function.name());
            return Err(self.refuse(&what));
        }
        let mut pairs = Vec::new();
        for pair in words.chunks(2) {
            let id = parameter_number(pair[0]).map_err(|e| self.refuse(&e))?;
            pairs.push((id, parse_value(id, pair[1]).map_err(|e| self.refuse(&e))?));
        }
        self.user_data(|w| write_pairs(w, &pairs))
    }

    fn read_parameters(&self) -> Result<Vec<u8>, Error> {
        let words = self.arguments;
        if words.is_empty() || words.len() > usize::from(MAX_READ) {
            return Err(self.refuse(&format!("read takes the names of parameters, up to {MAX_READ}")));
        }
        let ids =
            words.iter().map(|w| parameter_number(w).map_err(|e| self.refuse(&e))).collect::<Result<Vec<_>, _>>()?;
        self.user_data(|w| {
            w.u8(ids.len() as u8);
            ids.iter().for_each(|&id| w.u16(id));
        })
    }

    /// Returns words as numbers.
    fn numbers(&self, words: &[&str]) -> Result<Vec<f64>, Error> {
        let number = |word: &str| word.parse::<f64>().map_err(|_| self.refuse(&format!("{word:?} is not a number")));
        words.iter().map(|w| number(w)).collect()
    }

    /// Returns a time in UTC as microseconds of TAI.
    fn tai_us(&self, word: &str) -> Result<u64, Error> {
        tai::from_utc(word, self.tell).map_err(|e| self.refuse(&e))
    }

    /// Returns the time of values from navigation, as in their packet.
    fn epoch(&self, word: &str) -> Result<u64, Error> {
        let Ok(seconds) = word.parse::<f64>() else {
            let tai_us = self.tai_us(word)?;
            return Ok(u64::from_be_bytes(Cuc::tai(tai_us).to_bytes()));
        };
        // The clock of the computer begins with its start.
        if !(0.0..1e9).contains(&seconds) {
            let what = format!("the time {seconds} s is refused: seconds since the computer's start, or UTC");
            return Err(self.refuse(&what));
        }
        Ok((seconds * 1e6) as u64)
    }

    fn set_time(&self) -> Result<Vec<u8>, Error> {
        let (time, at_pulse) = match self.arguments {
            [time] => (time, 0),
            [time, "pulse"] => (time, 1),
            _ => {
                return Err(self.refuse("time takes a time in UTC, and the word pulse if it is that of the last pulse"));
            }
        };
        let tai_us = self.tai_us(time)?;
        if at_pulse == 1 && !tai_us.is_multiple_of(1_000_000) {
            return Err(self.refuse("a pulse comes at a whole second"));
        }
        self.user_data(|w| {
            w.bytes(&Cuc::tai(tai_us).to_bytes());
            w.u8(at_pulse);
        })
    }

    fn navigate(&self) -> Result<Vec<u8>, Error> {
        let refuse_count = || {
            let what = "navigate takes a time, the expiry in seconds, altitude and ECEF position in kilometres, \
                        velocity in m/s, and the rate of rotation in rad/s if it is known: 9 or 12 numbers";
            self.refuse(what)
        };
        let (epoch, numbers) = self.arguments.split_first().ok_or_else(refuse_count)?;
        if !matches!(numbers.len(), 8 | 11) {
            return Err(refuse_count());
        }
        let epoch = self.epoch(epoch)?;
        let (values, rate) = match self.numbers(numbers)?[..] {
            [t, h, x, y, z, u, v, w] => ([t, h, x, y, z, u, v, w], [f64::NAN; 3]),
            [t, h, x, y, z, u, v, w, p, q, r] => ([t, h, x, y, z, u, v, w], [p, q, r]),
            _ => return Err(refuse_count()),
        };
        let [expires_s, altitude_km, km @ .., vx, vy, vz] = values;
        if let Some(x) = values.iter().chain(&rate).find(|x| x.is_infinite() || (**x * 1e3).abs() > f64::from(f32::MAX))
        {
            return Err(self.refuse(&format!("{x} is not a finite number")));
        }
        let vectors = [("position", km), ("velocity", [vx, vy, vz]), ("rate of rotation", rate)];
        let is_partly_known = |v: [f64; 3]| matches!(v.iter().filter(|x| x.is_nan()).count(), 1 | 2);
        if let Some((name, v)) = vectors.iter().find(|(_, v)| is_partly_known(*v)) {
            let missing = ["x", "y", "z"].into_iter().zip(v).find(|(_, x)| x.is_nan()).map_or("?", |(axis, _)| axis);
            let what = format!("all three numbers of the {name} must be known, or none: {missing} is NaN");
            return Err(self.refuse(&what));
        }
        let m = |km: f64| (km * 1e3) as f32;
        let [x, y, z] = km;
        let [rate_x, rate_y, rate_z] = rate.map(|x| x as f32);
        let values = Navigation {
            epoch,
            expires_s: expires_s as f32,
            altitude_m: m(altitude_km),
            position_x_m: m(x),
            position_y_m: m(y),
            position_z_m: m(z),
            velocity_x_m_s: vx as f32,
            velocity_y_m_s: vy as f32,
            velocity_z_m_s: vz as f32,
            rate_x_rad_s: rate_x,
            rate_y_rad_s: rate_y,
            rate_z_rad_s: rate_z,
        };
        self.user_data(|w| values.write(w))
    }

    fn set_attitude(&self) -> Result<Vec<u8>, Error> {
        let refuse_count = || {
            let what = "attitude takes a time, the expiry in seconds, the quaternion from the camera to ECEF (scalar \
                        first), its 1-sigma in degrees, and the direction to the Sun in the camera frame if it is \
                        known: 7 or 10 numbers";
            self.refuse(what)
        };
        let (epoch, numbers) = self.arguments.split_first().ok_or_else(refuse_count)?;
        if !matches!(numbers.len(), 6 | 9) {
            return Err(refuse_count());
        }
        let epoch = self.epoch(epoch)?;
        let (values, [sun_x, sun_y, sun_z]) =
            match self.numbers(numbers)?.iter().map(|x| *x as f32).collect::<Vec<_>>()[..] {
                [t, w, x, y, z, sigma] => ([t, w, x, y, z, sigma], [f32::NAN; 3]),
                [t, w, x, y, z, sigma, u, v, s] => ([t, w, x, y, z, sigma], [u, v, s]),
                _ => return Err(refuse_count()),
            };
        let [expires_s, q_w, q_x, q_y, q_z, sigma_deg] = values;
        if !(expires_s > 0.0 && expires_s.is_finite()) {
            return Err(self.refuse(&format!("the expiry {expires_s} s is refused: must be a finite number above 0")));
        }
        let sigma_rad = sigma_deg.to_radians();
        AttitudeAndSun::try_new([q_w, q_x, q_y, q_z], sigma_rad, [sun_x, sun_y, sun_z]).map_err(|refused| {
            const NAMES: [&str; 8] = ["QW", "QX", "QY", "QZ", "SIGMA_DEG", "SUN_X", "SUN_Y", "SUN_Z"];
            let name = |place: u16| NAMES.get(usize::from(place)).unwrap_or(&"?");
            self.refuse(&match refused {
                Refused::Missing(place) => format!("{} is NaN, but other numbers need it", name(place)),
                Refused::Impossible(0) => "the length of the quaternion must be 1 within 0.01".to_owned(),
                Refused::Impossible(place) => format!("{} is impossible", name(place)),
            })
        })?;
        let values = Attitude { epoch, expires_s, q_w, q_x, q_y, q_z, sigma_rad, sun_x, sun_y, sun_z };
        self.user_data(|w| values.write(w))
    }

    fn set_known(&self) -> Result<Vec<u8>, Error> {
        let numbers = self.numbers(self.arguments)?;
        let (km, rate) = numbers.split_at(numbers.len().min(4));
        if let Some(x) = km.iter().find(|km| !((**km * 1e3) as f32).is_finite()) {
            return Err(self.refuse(&format!("{x} is not a finite number of kilometres")));
        }
        if let Some(h) = km.first().filter(|h| **h <= 0.0) {
            return Err(self.refuse(&format!("the altitude {h} km is refused: must be above 0")));
        }
        let [h, x, y, z] = match km[..] {
            [h] => [h, f64::NAN, f64::NAN, f64::NAN],
            [h, x, y, z] => [h, x, y, z],
            _ => {
                let what = "known takes the altitude in kilometres, and the ECEF position if there is one";
                return Err(self.refuse(what));
            }
        };
        if !matches!(rate.len(), 0 | 3) {
            let what = "known takes the rate of rotation as three numbers, rad/s, after the position";
            return Err(self.refuse(what));
        }
        self.user_data(|w| {
            [h, x, y, z].iter().for_each(|v| w.f32((v * 1e3) as f32));
            rate.iter().for_each(|v| w.f32(*v as f32));
        })
    }

    fn without_arguments(&self) -> Result<Vec<u8>, Error> {
        if self.arguments.is_empty() { self.user_data(|_| {}) } else { Err(self.refuse("takes no arguments")) }
    }
}

fn write_pairs(out: &mut Writer<'_>, pairs: &[(u16, f64)]) {
    out.u8(pairs.len() as u8);
    for &(id, value) in pairs {
        out.u16(id);
        out.f64(value);
    }
}

/// Returns the number of a parameter, from its name or its number.
fn parameter_number(word: &str) -> Result<u16, String> {
    if let Ok(id) = word.parse::<u16>() {
        return parameters::name(id).map(|_| id).ok_or_else(|| format!("no parameter has the number {id}"));
    }
    Parameters::number_of(word).ok_or_else(|| {
        let ids = Parameters::defaults();
        let names = ids.numbers().filter_map(parameters::name);
        let near = hzn_files::nearest(word, names).map(|n| format!("; did you mean {n}?"));
        format!("{word} is not a parameter{}", near.unwrap_or_default())
    })
}

/// Returns a value that this parameter can have, from a number or the name of a choice. The flight computer checks
/// whether the value fits the other parameters, because only it has them.
fn parse_value(id: u16, word: &str) -> Result<f64, String> {
    let name = parameters::name(id).unwrap_or("?");
    let cannot = |what: String| Err(format!("{name} cannot be {word}: it must be {what}"));
    let number = word.parse::<f64>();
    let is_accepted = |x: f64| Parameters::defaults().set(id, x).is_ok();
    let choices = choices(name);
    if !choices.is_empty() {
        let named = choices.iter().find(|(choice, _)| *choice == word).map(|(_, number)| *number);
        if let Some(number) = named.or(number.ok().filter(|x| is_accepted(*x))) {
            return Ok(number);
        }
        let each: Vec<String> = choices.iter().map(|(choice, number)| format!("{number} {choice}")).collect();
        return cannot(format!("one of {}", each.join(", ")));
    }
    let limits = match hzn_files::keys::find(name).map(|key| &key.limits) {
        // The watchdog sets the limit of a flight computer.
        Some(Limits::Number { low, above, .. }) if name == "limits.max_work" => {
            Some((*low, *above, f64::from(parameters::MAX_WORK)))
        }
        Some(Limits::Number { low, above, high }) => Some((*low, *above, *high)),
        _ => Operations::limits(id).map(|(low, high)| (low, false, high)),
    };
    let within = |x: f64| limits.is_none_or(|(low, above, high)| x <= high && if above { x > low } else { x >= low });
    // The corners of a mask are set one after another. The earlier corners are not known here, so a corner is not
    // checked against them.
    let is_mask = name.starts_with("mask");
    let optional = !is_mask && is_accepted(f64::NAN);
    match number {
        Ok(x) if x.is_nan() && optional => return Ok(x),
        Ok(x) if x.is_finite() && within(x) && (is_mask || is_accepted(x)) => return Ok(x),
        _ => {}
    }
    let kind = if is_mask || is_accepted(0.5) { "a finite number" } else { "a whole number" };
    let range = match limits {
        Some((low, true, high)) if high.is_finite() => format!(" above {low}, to {high}"),
        Some((low, true, _)) => format!(" above {low}"),
        Some((low, false, high)) if high.is_finite() => format!(" from {low} to {high}"),
        Some((low, false, _)) => format!(" from {low} on"),
        None => String::new(),
    };
    cannot(format!("{kind}{range}{}", if optional { ", or NaN to leave it out" } else { "" }))
}

/// Returns the choices of a parameter on the flight computer: the words of sensor.toml with their numbers.
fn choices(name: &str) -> Vec<(&'static str, f64)> {
    let choices = hzn_files::keys::find(name).map_or(&[][..], |key| key.choices);
    choices.iter().filter_map(|choice| Some((choice.name, f64::from(choice.flight?)))).collect()
}

/// Number of parameters in one packet of a load.
const LOADED_AT_ONCE: usize = 80;

/// Returns packets with every parameter of a sensor, and the packet that sets and stores all of them, or none. The
/// parameters of the flight software itself stay as they are.
fn load(path: &Path, tell: &Tell) -> Result<Vec<Vec<u8>>, Error> {
    let sensor = hzn_files::sensor::load(path)?;
    let parameters = Parameters::new(sensor.config);
    parameters.check_flyable().map_err(|key| {
        Error::unusable(format!(
            "{}: {key} has a value that the flight computer does not support; leave it at its default \
             (book/reference/telemetry.md)",
            path.display()
        ))
    })?;
    let pairs: Vec<_> = parameters.sensor_numbers().filter_map(|id| Some((id, parameters.get(id)?))).collect();
    let text = path.display().to_string();
    let packet = |function, fill: &dyn Fn(&mut Writer<'_>)| {
        Command { text: &text, tell, function, arguments: &[] }.user_data(fill)
    };
    // An empty packet removes what an earlier load has left.
    let mut packets = vec![packet(Function::StageParameters, &|w| w.u8(0))?];
    for part in pairs.chunks(LOADED_AT_ONCE) {
        packets.push(packet(Function::StageParameters, &|w| write_pairs(w, part))?);
    }
    packets.push(packet(Function::CommitParameters, &|w| w.u16(pairs.len() as u16))?);
    Ok(packets)
}
