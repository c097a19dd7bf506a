//! The arguments of `hzn calibrate sky`, and what follows from them for every kind of flight.

use std::path::PathBuf;

use hzn_calib::sky::{Parameter, Unknowns, Written};
use hzn_files::Sensor;
use hzn_run::disk;
use hzn_run::source::ending;

use crate::exit::{Exit, Outcome};
use crate::setup::{InputArgs, SensorArgs};
use crate::tell;

/// Measure focal length and principal point on the pictures of a flight: limb, Sun or Moon
///
/// The flight needs an altitude or a position for each picture (frames.csv, --altitude-km, body.altitude_km), but no
/// truth. The lens is estimated together with the limb height, whose value and sigma in [body] are the prior. The
/// range of altitudes and directions separates the two; the report says how well. The sigmas of the calibration in
/// [camera] are the prior of the lens; without them, the focal length is free within 10 %. The report goes to stdout.
/// `-o sensor.toml` writes the determined parameters with their covariance into a copy of the sensor.toml; `-o
/// report.html` writes plots. A parameter is written only if the flight at least halves its sigma. If it halves none,
/// nothing is written and the exit code is 1; the report still has the measured numbers.
///
/// A sensor that looks for the Sun or the Moon measures the lens on the track of the disc instead. frames.csv must give
/// the direction: sun_x, sun_y, sun_z, or qw, qx, qy, qz with utc (for the Moon with x_km, y_km, z_km too). The
/// mounting is then estimated together with the lens.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A folder, a pattern in quotes, pictures, a video, or an MCAP
    #[arg(required = true, value_name = "FLIGHT")]
    pub(super) input: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) sensor: SensorArgs,
    #[command(flatten)]
    pub(super) source: InputArgs,
    /// Also estimate this parameter; may be given twice
    #[arg(long, value_enum, value_name = "PARAMETER")]
    also: Vec<Also>,
    /// Ignore the sigmas of the calibration in [camera], for example after damage
    #[arg(long)]
    pub(super) ignore_sigmas: bool,
    /// Ignore the limb height in [body]; the altitude span alone then separates it from the focal length
    #[arg(long)]
    pub(super) free_limb_height: bool,
    /// Also measure the mounting of the camera; needs a position and an attitude (computed with the nominal mounting)
    /// for each picture
    #[arg(long)]
    pub(super) mount: bool,
    /// Also write the sensor (.toml) or a report with plots (.html); may be given twice
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: Vec<PathBuf>,
    /// Replace files that exist
    #[arg(long)]
    pub(super) force: bool,
    /// Number of threads; without it, all cores
    #[arg(short, long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(super) jobs: Option<u16>,
    /// Print no progress on stderr
    #[arg(short, long)]
    pub(super) quiet: bool,
}

/// A parameter that is estimated on request.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Also {
    /// The first coefficient of the lens
    K1,
    /// fx and fy separately
    Aspect,
}

impl From<Also> for Parameter {
    fn from(also: Also) -> Self {
        match also {
            Also::K1 => Self::K1,
            Also::Aspect => Self::Aspect,
        }
    }
}

/// Returns the parameters to estimate.
pub(super) fn unknowns(args: &Args, sensor: &Sensor) -> Unknowns {
    let also: Vec<Parameter> = args.also.iter().map(|a| (*a).into()).collect();
    if args.ignore_sigmas {
        Unknowns::ignoring_sigmas(&sensor.config.camera, &also)
    } else {
        Unknowns::new(&sensor.config.camera, &also)
    }
}

/// Prints the keys, and writes the copies of the sensor.toml.
pub(super) fn write_sensors(args: &Args, written: &Written) -> Outcome {
    tell::report(format_args!("\n{}\n", written.keys.join("\n")))?;
    let sensors: Vec<_> = args.output.iter().filter(|p| ending(p) == "toml").collect();
    for path in &sensors {
        disk::write_whole(path, &written.text)?;
    }
    if sensors.is_empty() && !args.quiet {
        tell::line("note: -o sensor.toml writes these keys into a copy of the sensor.toml");
    }
    Ok(Exit::Done)
}
