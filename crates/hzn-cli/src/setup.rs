//! The common preparations of several commands: sensor, frames.csv, sequence.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::Args;
use hzn_files::truth::Truth;
use hzn_run::disk;
use hzn_run::open::{Opened, Request, SensorChoice};
use hzn_run::source::Raw;

use crate::exit::{Exit, Stop, usage};
use crate::tell;

/// The arguments that select the sensor.
#[derive(Debug, Clone, Args)]
pub(crate) struct SensorArgs {
    /// The sensor.toml; without it, the one in the recording or next to the pictures
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
    let opened = hzn_run::open::open(&request(inputs, sensor, input)?)?;
    opened.warnings.iter().for_each(tell::warning);
    Ok(opened)
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
    })
}

/// Returns the pictures of an earlier rendering. These are the pictures that truth.csv in the folder lists, as only
/// rendered pictures have a truth.
pub(crate) fn rendered(folder: &Path) -> Vec<PathBuf> {
    let Ok(mut before) = csv::Reader::from_path(folder.join("truth.csv")) else { return Vec::new() };
    let truths = before.deserialize::<Truth>().map_while(Result::ok);
    let paths = truths.map(|truth| folder.join(Path::new(&truth.file).file_name().unwrap_or_default()));
    paths.filter(|path| path.is_file()).collect()
}

/// Removes the pictures of an earlier rendering, because new tables would not list them.
pub(crate) fn clear_rendered(folder: &Path) -> Result<(), Stop> {
    // A picture of several bodies is listed several times.
    for path in rendered(folder).into_iter().filter(|path| path.is_file()) {
        std::fs::remove_file(&path).map_err(|e| disk::cannot_write(&path, &e))?;
    }
    Ok(())
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
