//! `hzn prepare`: a checked sensor as bytes for a flight computer.

use std::path::{Path, PathBuf};

use hzn_core::real::Real;
use hzn_core::{Config, Sensor, prepared};
use hzn_files::files_of_sensor;
use hzn_run::disk;

use crate::exit::{Exit, Outcome, Stop, failed, usage};
use crate::files;
use crate::tell;

/// Check a sensor.toml and write the sensor as bytes that a flight computer reads
///
/// The bytes have the configuration with the series of the lens and the region of the picture. The flight computer
/// reads them with `Sensor::from_prepared` or `FlightHorizon::load`, and then needs neither the checks nor the
/// functions that make a lens. Its answers are the same to the last bit. Another version of hzn refuses the bytes.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The sensor.toml
    sensor: PathBuf,
    /// File to write
    #[arg(short, long, value_name = "FILE", default_value = "sensor.bin")]
    output: PathBuf,
    /// Precision of the numbers: f32 is that of a flight computer
    #[arg(long, value_name = "TYPE", default_value = "f32")]
    precision: Precision,
    /// Replace the file if it exists
    #[arg(short, long)]
    force: bool,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Precision {
    F32,
    F64,
}

pub(super) fn run(args: &Args) -> Outcome {
    let Args { sensor, output, .. } = args;
    files::check_outputs(&files_of_sensor(sensor), std::slice::from_ref(output), args.force)?;
    let loaded = hzn_files::sensor::load(sensor)?;
    let bytes = match args.precision {
        Precision::F32 => prepare::<f32>(&loaded.config, sensor)?,
        Precision::F64 => prepare::<f64>(&loaded.config, sensor)?,
    };
    disk::write(output, &bytes)?;
    for warning in &loaded.warnings {
        tell::warning(warning);
    }
    tell::line(format_args!("{} written: {} bytes", output.display(), bytes.len()));
    let needed = hzn_files::features::needed(&loaded.config).map_err(|e| failed(e.to_string()))?;
    if !needed.is_empty() {
        tell::line(format_args!("the flight computer's hzn-core needs the features {}", needed.join(", ")));
    }
    Ok(Exit::Done)
}

/// Returns the bytes of a sensor.
fn prepare<T: Real>(config: &Config, path: &Path) -> Result<Vec<u8>, Stop> {
    let sensor = Sensor::<T>::new(config).map_err(|e| usage(format!("{}: {e}", path.display())))?;
    let mut bytes = vec![0; prepared::MAX_BYTES];
    let length = sensor.prepare(&mut bytes).map_err(|e| failed(e.to_string()))?;
    bytes.truncate(length);
    Ok(bytes)
}
