//! `hzn fly`: the flight software on a Linux computer.

use std::path::PathBuf;

use hzn_flight::authentication::KEYS;
use hzn_fly::Which;
use hzn_fly::camera::Ended;
use hzn_fly::flight::{Settings, Source, Summary};
use hzn_fly::link::Address;
use hzn_run::disk;
use hzn_run::source::Raw;

use crate::exit::{Exit, Outcome, failed, usage};
use crate::tell;

/// Fly: process a camera's pictures on this Linux computer, with telecommands and telemetry
///
/// The flight loop is that of the microcontrollers, in single precision with lists of fixed size: its answers are those
/// of `hzn run --flight`. They go to the ground and into a log (STATE/log/*.mcap). book/guide/fly.md has examples.
///
/// The parameters of the sensor are stored at the first start; after that, telecommands change them. SIGTERM or Ctrl-C
/// ends the flight. SIGPWR says that power will be cut: the log is closed, and the program waits. SIGUSR1 is lift-off.
///
/// Exit codes: 0 the flight was stopped, or the pipe was closed after a whole picture; 3 the pipe was closed within a
/// picture.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The device of a camera, such as /dev/video0; - for pictures without headers on standard input; or a rig.toml,
    /// whose heads have devices, named pipes or pictures with times
    source: PathBuf,
    /// The sensor.toml whose parameters are stored, if none are stored yet
    #[arg(short, long, value_name = "FILE")]
    sensor: Option<PathBuf>,
    /// Store the parameters of --sensor, or those of a rig.toml, even if other parameters are stored already
    #[arg(long)]
    load: bool,
    /// Size and format of the pictures on standard input (formats as for `hzn run`); without it, those of the
    /// parameters as mono8
    #[arg(long, value_name = "WIDTHxHEIGHT:FORMAT")]
    raw: Option<Raw>,
    /// The line to the ground: udp:LOCAL,REMOTE, tcp-listen:HOST:PORT, tcp:HOST:PORT or serial:DEVICE[:BAUD]; without
    /// it, there is only the log
    #[arg(long, value_name = "LINE")]
    line: Option<Address>,
    /// The key of telecommands, a file that `hzn key` makes, with its counter beside it; given twice for the change to
    /// another key. Telecommands of others are then refused
    #[arg(long, value_name = "FILE")]
    key: Vec<PathBuf>,
    /// The folder for parameters and log; without it, $STATE_DIRECTORY (of systemd), or ./hzn-fly
    #[arg(long, value_name = "DIR")]
    state: Option<PathBuf>,
    /// Largest size of the log in megabytes; beyond it, the oldest files are removed
    #[arg(long, value_name = "MB", default_value_t = 1000, value_parser = clap::value_parser!(u64).range(2..1_000_000))]
    log_mb: u64,
    /// Keep pictures with their answers (STATE/pictures/*.mcap), for `hzn run --flight`: every N-th, those without an
    /// answer (refused), or both, as in 25,refused
    #[arg(long, value_name = "N,refused")]
    keep_pictures: Option<Which>,
    /// Largest size of the kept pictures in megabytes, for each head; beyond it, the oldest files are removed
    #[arg(long, value_name = "MB", default_value_t = 1000, requires = "keep_pictures",
          value_parser = clap::value_parser!(u64).range(2..1_000_000))]
    pictures_mb: u64,
}

pub(super) fn run(args: Args) -> Outcome {
    if let Some(Address::Udp { remote: None, .. }) = &args.line {
        return Err(usage("--line: udp needs the ground's address too, as in udp:0.0.0.0:5001,192.168.1.2:5000"));
    }
    if args.key.len() > KEYS {
        return Err(usage(format!("--key: {} keys are given, but a computer has at most {KEYS}", args.key.len())));
    }
    let is_rig = args.source.is_file() && hzn_files::rig::is_rig(&args.source);
    if is_rig && args.sensor.is_some() {
        return Err(usage("--sensor: the sensors of a rig are those that rig.toml names"));
    }
    if args.load && args.sensor.is_none() && !is_rig {
        return Err(usage("--load stores the parameters of --sensor FILE: give this file, too"));
    }
    let sensor = args.sensor.as_deref().map(hzn_files::sensor::load).transpose()?;
    sensor.iter().flat_map(|sensor| &sensor.warnings).for_each(tell::warning);
    let from_systemd = || std::env::var_os("STATE_DIRECTORY").map(PathBuf::from);
    let state = args.state.or_else(from_systemd).unwrap_or_else(|| "hzn-fly".into());
    let read = args.sensor.as_deref().map(hzn_files::files_of_sensor).unwrap_or_default();
    let read = if is_rig { vec![args.source.clone()] } else { read };
    disk::refuse_inputs(&read, &hzn_fly::flash::files(&state))?;
    let settings = Settings {
        source: match args.source {
            path if is_rig => Source::Rig(path),
            path if path.as_os_str() == "-" => Source::Stdin,
            path => Source::Device(path),
        },
        raw: args.raw,
        sensor: sensor.map(|sensor| sensor.config),
        replaces_parameters: args.load,
        line: args.line,
        keys: args.key,
        state,
        log_bytes: args.log_mb * 1_000_000,
        kept_pictures: args.keep_pictures.map(|which| (which, args.pictures_mb * 1_000_000)),
    };
    let summary =
        hzn_fly::fly(&settings, tell::to_stderr()).map_err(|e| if e.is_usage { usage(e) } else { failed(e) })?;
    tell_summary(&summary);
    match summary.ended {
        Some(Ended::Failed(why)) => Err(failed(why)),
        Some(Ended::Partial { .. }) => Ok(Exit::SomeUnreadable),
        Some(Ended::Whole) | None if summary.counts.refused > 0 => Ok(Exit::SomeUnreadable),
        Some(Ended::Whole) | None => Ok(Exit::Done),
    }
}

fn tell_summary(summary: &Summary) {
    if let Some(Ended::Partial { bytes, expected }) = summary.ended {
        let what = format!("the last picture has {bytes} of {expected} bytes and is not processed");
        tell::warning(format_args!("{what}; are width, height and format right?"));
    }
    let counts = summary.counts;
    let mut text = format!("{} pictures, {} answers", counts.pictures, counts.answers);
    if counts.lost > 0 {
        text += &format!(", {} pictures lost", counts.lost);
    }
    if counts.refused > 0 {
        let what = "refused without an answer (the events say why: a wrong size, no altitude, stuck pixels)";
        text += &format!(", {} pictures {what}", counts.refused);
    }
    if let (epochs @ 1.., joint) = summary.epochs {
        text += &format!("; {epochs} epochs, {joint} joint answers");
    }
    let (logged, missing) = summary.logged;
    text += &format!("; {logged} in the log");
    if missing > 0 {
        text += &format!(", {missing} are missing there");
    }
    if let (kept @ 1.., _) | (kept, 1..) = summary.kept {
        text += &format!("; {kept} pictures kept");
    }
    if summary.kept.1 > 0 {
        text += &format!(", {} could not be kept", summary.kept.1);
    }
    if summary.dropped_packets > 0 {
        text += &format!("; {} packets had no room on the line", summary.dropped_packets);
    }
    tell::line(text);
    if let Some(latency) = summary.latency {
        let ms = |d: std::time::Duration| d.as_secs_f64() * 1e3;
        let (median, most, longest) = (ms(latency.median), ms(latency.percent99), ms(latency.longest));
        tell::line(format!(
            "from the last byte of a picture to its packet: {median:.2} ms median, {most:.2} ms for 99 %, {longest:.2} \
             ms at most"
        ));
    }
}
