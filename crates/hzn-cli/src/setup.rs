//! The common preparations of several commands: sensor, frames.csv, sequence.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::Args;
use hzn_run::open::{Opened, Request, SensorChoice, frames_path, sensor_path};
use hzn_run::sink::Target;
use hzn_run::source::{Raw, is_stdin};

use crate::exit::{Exit, Stop, usage};
use crate::kind_of_file;
use crate::tell;

/// The arguments that select the sensor.
#[derive(Debug, Clone, Args)]
pub(crate) struct SensorArgs {
    /// The sensor.toml; without it, the one in the recording, next to the pictures, or in the nearest folder above them
    #[arg(short, long, value_name = "FILE")]
    pub(crate) sensor: Option<PathBuf>,
    /// Altitude of the camera in kilometres, for pictures without one in frames.csv or the recording; replaces
    /// body.altitude_km
    #[arg(long, value_name = "KM", allow_negative_numbers = true)]
    pub(crate) altitude_km: Option<f64>,
    /// Use single precision and at most 2048 points, as `FlightHorizon` has
    #[arg(long)]
    pub(crate) flight: bool,
}

/// The format of a table on stdout.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum TableFormat {
    /// A table with a header
    Csv,
    /// JSON Lines: one JSON object a line
    Jsonl,
}

impl TableFormat {
    /// Returns the format of a table on stdout.
    pub(crate) fn or_csv(given: Option<Self>) -> Target {
        given.unwrap_or(Self::Csv).into()
    }

    /// Tells that a format was given for files, which have the format of their ending.
    pub(crate) fn tell_unused<'a>(given: Option<Self>, mut outputs: impl Iterator<Item = &'a PathBuf>) {
        let Some(first) = outputs.next().filter(|_| given.is_some()) else { return };
        if !is_stdin(first) && outputs.all(|path| !is_stdin(path)) {
            let name = first.display();
            tell::warning(format_args!("--format is for a table on stdout: {name} has the format of its ending"));
        }
    }
}

impl From<TableFormat> for Target {
    fn from(format: TableFormat) -> Self {
        match format {
            TableFormat::Csv => Self::Csv,
            TableFormat::Jsonl => Self::Jsonl,
        }
    }
}

/// The arguments that select the pictures.
#[derive(Debug, Clone, Args)]
pub(crate) struct InputArgs {
    /// Table with time, altitude, position and attitude of the pictures; without it, the data in the recording of an
    /// earlier run, or frames.csv next to the pictures
    #[arg(long, value_name = "FILE")]
    pub(crate) frames: Option<PathBuf>,
    /// Frames per second, for pictures without a time in frames.csv, the container or EXIF
    #[arg(long, value_name = "RATE", default_value_t = 1.0, allow_negative_numbers = true)]
    pub(crate) fps: f64,
    /// Size and format of headerless pictures (mono8, mono10, mono12, mono16: little-endian words; mono10p, mono12p:
    /// packed; bayer8: every 2x2 cell becomes one pixel)
    #[arg(long, value_name = "WIDTHxHEIGHT:FORMAT")]
    pub(crate) raw: Option<Raw>,
    /// Topic of the pictures in an MCAP; without it, the first topic with pictures
    #[arg(long, value_name = "TOPIC")]
    pub(crate) topic: Option<String>,
}

/// Opens a sequence with its sensor. Warnings are printed to stderr; notes are left to the command.
pub(crate) fn open(inputs: &[PathBuf], sensor: &SensorArgs, input: &InputArgs) -> Result<Opened, Stop> {
    open_request(&request(inputs, sensor, input)?)
}

/// Opens a sequence as [`open`] does.
pub(crate) fn open_request(request: &Request) -> Result<Opened, Stop> {
    // With a format for headerless pictures, any bytes are pictures.
    if let ([one], None) = (request.inputs.as_slice(), request.raw) {
        kind_of_file::refuse_without_pictures(one)?;
    }
    if let SensorChoice::File(sensor) = &request.sensor {
        kind_of_file::refuse_no_sensor(sensor)?;
    }
    let opened = hzn_run::open::open(request)?;
    opened.warnings.iter().for_each(tell::warning);
    let source = opened.source.as_ref();
    tell::detail(|| match source.total() {
        Some(n) => format!("input: {n} pictures in {}", shown(&source.folder())),
        None => format!("input: {}", request.inputs.iter().map(|p| shown(p)).collect::<Vec<_>>().join(", ")),
    });
    tell::detail(|| match sensor_path(request, source) {
        Some(path) => format!("sensor: {}", path.display()),
        None => "sensor: that of the recording".to_owned(),
    });
    tell::detail(|| match frames_path(request, source) {
        Some(path) => format!("table of the pictures: {}", path.display()),
        None => "table of the pictures: none".to_owned(),
    });
    let config = &opened.sensor.config;
    tell::detail(|| {
        let (camera, input) = (&config.camera, &config.input);
        let bits = input.bits.map_or("8".to_owned(), |bits| bits.to_string());
        let tone = input.tone.map_or("not known".to_owned(), |tone| tone.to_string());
        let bodies: Vec<&str> = config.each_body().iter().map(|body| body.kind.name()).collect();
        format!(
            "camera: {} x {} px, {}; bits {bits}, tone {tone}; looks for {}",
            camera.width,
            camera.height,
            camera.model.name(),
            bodies.join(", ")
        )
    });
    Ok(opened)
}

/// Returns a path in words.
fn shown(path: &Path) -> String {
    if path.as_os_str().is_empty() { "this folder".to_owned() } else { path.display().to_string() }
}

/// Largest list of pictures on standard input, in bytes.
const MAX_LIST_BYTES: u64 = 64 << 20;

/// Replaces `-` among the inputs by the names on standard input: one a line, or with a zero byte after each, as
/// `find -print0` writes them. With `raw`, standard input has the pictures themselves.
pub(crate) fn list_stdin(inputs: &mut Vec<PathBuf>, raw: Option<Raw>) -> Result<(), Stop> {
    if raw.is_some() || !inputs.iter().any(|input| is_stdin(input)) {
        return Ok(());
    }
    if inputs.len() > 1 {
        return Err(usage("-: the list on standard input cannot be combined with other inputs"));
    }
    let mut list = Vec::new();
    std::io::stdin().take(MAX_LIST_BYTES + 1).read_to_end(&mut list)?;
    if list.len() as u64 > MAX_LIST_BYTES {
        return Err(usage("standard input has more than 64 MB, which is no list of pictures; --raw reads pictures"));
    }
    let end = if list.contains(&0) { 0 } else { b'\n' };
    let names = list.split(|byte| *byte == end).map(|name| name.strip_suffix(b"\r").unwrap_or(name));
    *inputs = names.filter(|name| !name.is_empty()).map(path_of).collect::<Result<_, _>>()?;
    if inputs.is_empty() {
        return Err(usage("standard input has no names of pictures; write one a line, or give --raw for a stream"));
    }
    Ok(())
}

/// Returns the path with these bytes.
fn path_of(bytes: &[u8]) -> Result<PathBuf, Stop> {
    #[cfg(unix)]
    let path = Some(std::os::unix::ffi::OsStrExt::from_bytes(bytes)).map(|name: &std::ffi::OsStr| PathBuf::from(name));
    #[cfg(not(unix))]
    let path = std::str::from_utf8(bytes).ok().map(PathBuf::from);
    path.ok_or_else(|| usage("standard input is no list of names; --raw reads pictures from it"))
}

/// Returns what the arguments say about the files to open.
pub(crate) fn request(inputs: &[PathBuf], sensor: &SensorArgs, input: &InputArgs) -> Result<Request, Stop> {
    if !(input.fps > 0.0 && input.fps.is_finite()) {
        return Err(usage("--fps: must be above 0"));
    }
    Ok(Request {
        inputs: inputs.to_vec(),
        raw: input.raw,
        topic: input.topic.clone(),
        sensor: sensor.sensor.clone().map_or(SensorChoice::Neighbour, SensorChoice::File),
        frames: input.frames.clone(),
        altitude_km: sensor.altitude_km,
        flight: sensor.flight,
        watch: None,
    })
}

/// Returns a flag that Ctrl-C or a request to terminate sets. A second Ctrl-C ends the program at once.
pub(crate) fn stop_flag() -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    let shared = Arc::clone(&flag);
    let handler = ctrlc::set_handler(move || {
        if shared.swap(true, Ordering::SeqCst) {
            std::process::exit(i32::from(Exit::Interrupted as u8));
        }
        // The terminal shows ^C at the end of the line before.
        tell::line("");
        tell::line("finishing the pictures that were begun; press Ctrl-C again to stop at once");
    });
    // Without a handler, Ctrl-C ends the program at once; the output can still be continued.
    drop(handler);
    flag
}
