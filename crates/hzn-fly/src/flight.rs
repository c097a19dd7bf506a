//! The flight on a Linux computer: preparation, loop, end.

use std::path::PathBuf;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use hzn_core::Config;
use hzn_core::config::Orient;
use hzn_flight::flight::{Buffers, Flight, Lists};
use hzn_flight::messages::Mode;
use hzn_run::source::raw::{Format, Raw};

use crate::board::{Linux, Parts};
use crate::camera::{Camera, Capture, DeviceCamera, Ended, Pipe, Samples, V4l2};
use crate::error::Error;
use crate::flash::{self, Flash};
use crate::head::{Counts, Feed, Head};
use crate::keeper::{Keeper, Which};
use crate::key_file::Keys;
use crate::latency::{Latency, LatencySummary};
use crate::link::{Address, Link, Patience};
use crate::log::{Limits, Log, Sensors, Spare};
use crate::notify::Notify;
use crate::prepare::{parameters_for, prepare_parameters};
use crate::signals::Lines;
use crate::tell::Tell;

/// Where the pictures come from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Source {
    /// Pictures without headers on standard input.
    Stdin,
    /// A camera of Video4Linux 2, by its device.
    Device(PathBuf),
    /// The heads of a rig.toml, each with its own pictures.
    Rig(PathBuf),
}

/// The settings of a flight.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Where the pictures come from.
    pub source: Source,
    /// Size and format of the pictures; without it, those of the parameters, with one byte for each pixel.
    pub raw: Option<Raw>,
    /// The sensor whose parameters are stored if none are.
    pub sensor: Option<Config>,
    /// Whether the parameters of `sensor` are stored in any case.
    pub replaces_parameters: bool,
    /// The line for telecommands and telemetry; without it, there is only the log.
    pub line: Option<Address>,
    /// The files of the keys of telecommands, at most two; without them, every telecommand is taken.
    pub keys: Vec<PathBuf>,
    /// The folder for parameters and log.
    pub state: PathBuf,
    /// Most bytes of the log.
    pub log_bytes: u64,
    /// Which pictures are kept, and the most bytes of them, for each head.
    pub kept_pictures: Option<(Which, u64)>,
}

/// What happened in a flight.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Summary {
    /// Pictures, answers, losses.
    pub counts: Counts,
    /// Epochs of a rig, and those with a joint answer.
    pub epochs: (u64, u64),
    /// Pictures that were kept, and those that could not be.
    pub kept: (u64, u64),
    /// Answers in the log, and answers that are missing there.
    pub logged: (u64, u64),
    /// Packets for which the line had no room.
    pub dropped_packets: u64,
    /// Time from the last byte of a picture to its packet on the line.
    pub latency: Option<LatencySummary>,
    /// Why the pictures ended; `None` if the flight was stopped.
    pub ended: Option<Ended>,
}

/// Flies one camera until the pictures end or a signal stops the program.
pub(crate) fn fly(settings: &Settings, lines: Arc<Lines>, tell: Tell) -> Result<Summary, Error> {
    let state = &settings.state;
    let in_state = |e: std::io::Error| Error::failed(format!("{}: {e}", state.display()));
    let flash = Flash::open(state).map_err(|e| flash::refused(state, &e))?;
    let given = settings.sensor.clone().map(parameters_for);
    let replaces = (settings.replaces_parameters, "sensor.toml");
    let config = prepare_parameters(given.as_ref(), replaces, &flash, &tell)?.sensor;
    let spare = Spare::default();
    let keeper = settings.kept_pictures.map(|kept| Keeper::open(kept, &flash, &config, &spare, &tell)).transpose()?;
    let capture = Capture::start(open_camera(settings, &config, &tell)?).map_err(in_state)?;
    let sensors = Sensors { configs: vec![config], rig: None };
    let parts = open_parts(settings, sensors, spare, lines, &tell)?;
    let head = Head::new(None, Feed::Camera(capture), flash, keeper, tell);
    run(Linux::new(parts, vec![head], None))
}

/// Opens what all heads share: the line to the ground and the log.
pub(crate) fn open_parts(
    settings: &Settings,
    sensors: Sensors,
    spare: Spare,
    lines: Arc<Lines>,
    tell: &Tell,
) -> Result<Parts, Error> {
    let latency = Arc::new(Latency::default());
    let line = match &settings.line {
        None => None,
        Some(address) => {
            let opened = Link::open(address, Patience::Waits, Arc::clone(&latency), tell.clone());
            Some(opened.map_err(Error::failed)?)
        }
    };
    let log_folder = settings.state.join("log");
    let limits = Limits { bytes: settings.log_bytes, picture_bytes: 0 };
    let log = Log::open(&log_folder, limits, sensors, spare, tell.clone())
        .map_err(|e| Error::failed(format!("{}: {e}", log_folder.display())))?;
    let notify = Notify::from_environment();
    let keys = Keys::new(&settings.keys, tell);
    Ok(Parts { line, latency, log, lines, keys, notify, tell: tell.clone() })
}

fn run(board: Linux) -> Result<Summary, Error> {
    let (mut buffers, mut lists) = (Box::new(Buffers::new()), Box::new(Lists::new()));
    let flight = Flight::start(board, &mut buffers, &mut lists);
    let mut flight = Box::new(flight.ok_or_else(|| Error::failed("the default parameters are refused"))?);
    flight.turn();
    flight.board().parts().notify.ready();
    let mut mode = None;
    loop {
        if mode != Some(flight.mode()) {
            let now = flight.mode();
            mode = Some(now);
            flight.board().parts().notify.status(&format!("{} mode", now.name()));
            (flight.board().parts().tell)(&format!("{} mode", now.name()));
        }
        let takes_pictures = flight.mode() == Mode::Flight;
        if flight.mode() == Mode::ShutDown || flight.board().ended(|_| takes_pictures).is_some() {
            break;
        }
        flight.board().wait(|_| takes_pictures);
        flight.turn();
    }
    let is_shut_down = flight.mode() == Mode::ShutDown;
    Ok(end(flight.board(), is_shut_down))
}

/// Closes log and line. A computer that is shut down then waits for the end of power, or for a signal to stop.
pub(crate) fn end(board: &mut Linux, is_shut_down: bool) -> Summary {
    let kept = board.finish_heads();
    let parts = board.parts();
    let logged = parts.log.finish();
    let dropped_packets = parts.line.as_ref().map_or(0, |(link, _)| {
        link.drain(Duration::from_secs(1));
        link.dropped()
    });
    if is_shut_down && !parts.lines.stop() {
        (parts.tell)("shut down: the log is closed, and power may be cut");
        while !parts.lines.stop() {
            parts.notify.feed();
            thread::sleep(Duration::from_millis(20));
        }
    }
    let parts = board.parts();
    parts.notify.stopping();
    Summary {
        logged,
        dropped_packets,
        latency: parts.latency.summary(),
        counts: board.counts(),
        epochs: board.epochs(),
        kept,
        ended: board.ended(|_| false).cloned(),
    }
}

fn open_camera(settings: &Settings, config: &Config, tell: &Tell) -> Result<Box<dyn Camera>, Error> {
    let (width, height) = (u32::from(config.camera.width), u32::from(config.camera.height));
    check_input(settings.sensor.as_ref())?;
    let raw = settings.raw.unwrap_or(Raw { width, height, format: Format::Mono8 });
    check_raw(raw, config, tell)?;
    match &settings.source {
        Source::Stdin => Ok(Box::new(Pipe::new(std::io::stdin(), Samples::Raw(raw)))),
        Source::Device(path) if settings.raw.is_some() => {
            Err(Error::usage(format!("{}: --raw is for pictures on standard input only", path.display())))
        }
        // The heads of a rig open their own.
        Source::Rig(path) | Source::Device(path) => {
            let opener = Box::new(V4l2::new(path, width, height));
            let camera = DeviceCamera::open(opener, tell.clone())
                .map_err(|e| Error::failed(format!("{}: {e}", path.display())))?;
            Ok(Box::new(camera))
        }
    }
}

/// Refuses pictures without headers that the flight software would take for others, and tells which it will refuse.
pub(crate) fn check_raw(raw: Raw, config: &Config, tell: &Tell) -> Result<(), Error> {
    let (width, height) = (u32::from(config.camera.width), u32::from(config.camera.height));
    if raw.size() != (width, height) {
        let (w, h) = raw.size();
        if u64::from(w) * u64::from(h) == u64::from(width) * u64::from(height) {
            // The flight software compares the number of bytes, so it would take them for pictures of the camera.
            return Err(Error::usage(format!(
                "pictures of {w}x{h} have as many pixels as the camera of the parameters with {width}x{height}: which \
                 is right? --raw {width}x{height} takes them as they are, --load -s FILE gives another camera"
            )));
        }
        let what = "every picture will be refused until the parameters fit (event 6)";
        tell(&format!("warning: pictures of {w}x{h}, but the camera of the parameters has {width}x{height}: {what}"));
    }
    Ok(())
}

/// Refuses what the flight software does not do to a picture.
pub(crate) fn check_input(sensor: Option<&Config>) -> Result<(), Error> {
    let Some(input) = sensor.map(|config| config.input) else { return Ok(()) };
    let key = match (input.orient, input.invert, input.scale_to_height) {
        (Orient::AsStored, false, None) => return Ok(()),
        (Orient::AsStored, false, Some(_)) => "input.scale_to_height",
        (Orient::AsStored, true, _) => "input.invert",
        _ => "input.orient",
    };
    Err(Error::usage(format!("{key}: the flight software takes pictures as they are; leave it at its default")))
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use hzn_core::camera::{self, Model};
    use hzn_flight::{Parameters, table};

    use super::*;

    #[test]
    fn the_end_of_the_pipe_ends_every_mode() {
        let camera = camera::Config::ideal(Model::Pinhole, 64, 48, 60.0);
        let (done, ends) = mpsc::channel();
        for boot_mode in [Some(0), Some(1), None] {
            let done = done.clone();
            let camera = camera.clone();
            thread::spawn(move || {
                let dir = tempfile::tempdir().unwrap();
                let flash = Flash::open(dir.path()).unwrap();
                let mut parameters = Parameters::new(Config::new(camera));
                parameters.sensor.body.altitude_km = Some(230.0);
                // Without stored parameters the computer starts in safe mode.
                if let Some(mode) = boot_mode {
                    parameters.operations.boot_mode = mode;
                    let mut bytes = vec![0; table::MAX_BYTES];
                    let n = table::write(&parameters, 1, &mut bytes).unwrap();
                    flash.write_copy(1, &bytes[..n]).unwrap();
                }
                let pixels: &[u8] = &[9; 3 * 64 * 48];
                let samples = Samples::Raw("64x48:mono8".parse().unwrap());
                let tell: Tell = Arc::new(|_: &str| ());
                let sensors = Sensors { configs: vec![parameters.sensor.clone()], rig: None };
                let log = Log::open(
                    &dir.path().join("log"),
                    Limits { bytes: 1 << 20, picture_bytes: 0 },
                    sensors,
                    Spare::default(),
                    tell.clone(),
                )
                .unwrap();
                let capture = Capture::start(Box::new(Pipe::new(pixels, samples))).unwrap();
                let head = Head::new(None, Feed::Camera(capture), flash, None, tell.clone());
                let parts = Parts {
                    line: None,
                    latency: Arc::new(Latency::default()),
                    log,
                    lines: Arc::new(Lines::default()),
                    keys: Keys::default(),
                    notify: Notify::from_environment(),
                    tell,
                };
                done.send((boot_mode, run(Linux::new(parts, vec![head], None)).unwrap())).unwrap();
            });
        }
        for _ in 0..3 {
            let (boot_mode, summary) = ends.recv_timeout(Duration::from_secs(30)).expect("a mode does not end");
            assert_eq!(summary.ended, Some(Ended::Whole));
            assert_eq!(summary.counts.pictures, if boot_mode == Some(1) { 3 } else { 0 });
        }
    }
}
