//! `hzn fuse`: attitude and position from horizon sensors, Sun, inertial unit and receiver.

mod args;
mod output;
mod page;
mod summary;

use std::path::Path;

use hzn_fuse::finding::Level;
use hzn_fuse::flight::Wanted;
use hzn_fuse::input::{self, Inputs, Map};
use hzn_fuse::sink::Utc;
use hzn_fuse::{Fused, Settings, truth};

use crate::exit::{Exit, Outcome, Stop, unreadable, usage};
use crate::tell::{self, one_line};
pub(super) use args::Args;
use args::names;
use output::Outputs;

impl From<hzn_fuse::Error> for Stop {
    fn from(error: hzn_fuse::Error) -> Self {
        let exit = match error {
            hzn_fuse::Error::Unusable(_) => Exit::Usage,
            hzn_fuse::Error::Failed(_) | hzn_fuse::Error::Contradicts { .. } => Exit::Failed,
        };
        Self::new(exit, error.into())
    }
}

pub(super) fn run(args: &Args) -> Outcome {
    if args.show_config {
        tell::file(toml::to_string(&Settings::default()).map_err(crate::exit::failed)?)?;
        return Ok(Exit::Done);
    }
    let settings = args.config.as_deref().map_or_else(|| Ok(Settings::default()), Settings::load)?;
    if !(args.rate > 0.0) {
        return Err(usage(format!("--rate {}: must be above 0", args.rate)));
    }
    // A star tracker replaces the receiver, and gravity the inertial unit; a message of clap could not say so.
    let orbit = "for the orbit of a satellite give --solve and --attitude FILE, and neither of the two";
    if args.imu.is_none() && !args.solve {
        return Err(usage(format!("--imu FILE is missing, and --gnss FILE or --attitude FILE goes with it; {orbit}")));
    }
    if args.gnss.is_none() && args.attitude.is_none() {
        return Err(usage(format!("--gnss FILE or --attitude FILE is missing; {orbit}")));
    }
    if args.imu.is_none() && !args.direction.is_empty() {
        return Err(usage(
            "--direction needs --imu FILE: the orbit of a satellite comes from limbs and a star tracker",
        ));
    }
    if args.oem.is_some() && args.imu.is_some() && args.gnss.is_none() {
        return Err(usage("--oem needs --gnss: without a receiver the inertial unit gives no position"));
    }
    let outputs = Outputs::new(args)?;
    let inputs = inputs(args)?;
    let unknown = settings.cameras.keys().find(|name| inputs.recordings.iter().all(|r| r.name != **name));
    if let Some(name) = unknown {
        return Err(usage(format!("[cameras.{name}]: there is no recording of this name; {}", names(&inputs))));
    }
    let truth = args.truth.as_deref().map(truth::read).transpose()?;
    let wanted = Wanted { smoothed: args.smooth, solved: args.solve, points: args.points, rate_hz: Some(args.rate) };
    let fused = hzn_fuse::fuse(&inputs, &settings, wanted)?;
    if let Some(warning) = outputs.leap_seconds(&fused) {
        tell::line(format_args!("note: {warning}"));
    }
    let written = outputs.write(&fused, &inputs, &settings)?;
    summary::print(&fused, truth.as_deref())?;
    verdict(args, &fused, &outputs);
    let written: Vec<String> = written.iter().map(one_line).collect();
    tell::report(format_args!("\n{}\n", written.join("\n")))?;
    let lost: Vec<_> = inputs.recordings.iter().filter_map(|recording| recording.lost.as_ref()).collect();
    lost.iter().for_each(tell::warning);
    Ok(match (fused.verdict.level(), lost.is_empty()) {
        (Level::Contradicts, _) => Exit::Failed,
        (_, false) => Exit::SomeUnreadable,
        (_, true) => Exit::Done,
    })
}

/// Says what is probably wrong with which file, and what was not written.
fn verdict(args: &Args, fused: &Fused, outputs: &Outputs<'_>) {
    let level = fused.verdict.level();
    for (i, finding) in fused.verdict.findings.iter().enumerate() {
        let head = if i == 0 { "likeliest cause" } else { "also" };
        let file = args.file_of(finding).map(|file| format!(" [{}]", file.display())).unwrap_or_default();
        tell::line(format_args!("{head}, {}: {}{file}", finding.level.name(), one_line(&finding.what)));
    }
    let held: Vec<String> = outputs.attitudes().iter().map(|path| path.display().to_string()).collect();
    if level == Level::Contradicts && !args.force && !held.is_empty() {
        let why = "the inputs contradict each other; --force writes them all the same";
        tell::line(format_args!("not written: {}: {why}", held.join(", ")));
    }
}

/// Reads all inputs.
fn inputs(args: &Args) -> Result<Inputs, Stop> {
    let mut inputs = Inputs::default();
    for path in &args.nadir {
        // A table has no sensor.toml in it, as an MCAP recording has: it may come with the mount.
        let name = input::name_of(path);
        let of_camera = args.mount.iter().find(|(camera, _)| *camera == name).map(|(_, file)| Path::new(file));
        let recording = input::recording(path, of_camera.filter(|file| input::is_sensor(file)))?;
        if let Some(lost) = recording.lost.as_ref().filter(|_| recording.rows.is_empty()) {
            return Err(unreadable(lost));
        }
        inputs.recordings.push(recording);
    }
    let map = Map::parse(args.map.iter().map(String::as_str))?;
    for path in &args.direction {
        inputs.recordings.push(input::directions(path, &map)?);
    }
    let known = names(&inputs);
    for (name, file) in &args.mount {
        let found = inputs.recordings.iter_mut().find(|r| r.name == *name);
        let recording = found.ok_or_else(|| usage(format!("--mount {name}: no such camera; {known}")))?;
        recording.mount = Some(input::mount(Path::new(file))?);
    }
    tables(args, &map, &mut inputs)?;
    for (name, seconds) in &args.clock {
        let offset_s = match seconds.parse::<f64>() {
            Ok(offset) if offset.is_finite() => offset,
            _ => return Err(usage(format!("--clock {name}={seconds}: a number of seconds is expected"))),
        };
        if let Some(recording) = inputs.recordings.iter_mut().find(|r| r.name == *name) {
            recording.clock_offset_s = offset_s;
        } else if name == "gnss" {
            inputs.gnss.iter_mut().for_each(|fix| fix.time_s += offset_s);
        } else if name == "attitude" {
            inputs.attitudes.iter_mut().for_each(|attitude| attitude.time_s += offset_s);
        } else {
            return Err(usage(format!("--clock {name}: no such camera, and neither gnss nor attitude; {known}")));
        }
    }
    Ok(inputs)
}

/// Reads the tables of inertial unit, receiver and star tracker.
fn tables(args: &Args, map: &Map, inputs: &mut Inputs) -> Result<(), Stop> {
    let given = [
        ("imu", args.imu.is_some()),
        ("gnss", args.gnss.is_some()),
        ("attitude", args.attitude.is_some()),
        ("direction", !args.direction.is_empty()),
    ];
    for (table, is_given) in given {
        if map.has(table) && !is_given {
            return Err(usage(format!("--map {table}:... needs --{table} FILE")));
        }
    }
    if let Some(path) = &args.imu {
        inputs.imu = input::imu(path, map)?;
    }
    if let Some(path) = &args.gnss {
        let utc = args.utc.as_deref().map(Utc::parse).transpose()?;
        let receiver = input::gnss(path, map, utc.map(|utc| utc.unix_s))?;
        receiver.notes.iter().for_each(|note| tell::line(format_args!("note: {note}")));
        inputs.gnss = receiver.fixes;
    }
    if let Some(path) = &args.attitude {
        inputs.attitudes = input::attitudes(path, map)?;
    }
    Ok(())
}
