//! What several commands need before they begin: sensor, frames.csv, sequence.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::Args;
use hzn_calib::{FrameData, Frames, Sensor};
use hzn_core::body;
use hzn_sim::Truth;

use crate::engine;
use crate::exit::{Exit, Stop, usage};
use crate::input::{self, Raw, Source};
use crate::{output, tell};

/// Which sensor.
#[derive(Debug, Clone, Args)]
pub(crate) struct SensorArgs {
    /// The sensor.toml; without it, the one in the recording or beside the pictures
    #[arg(short, long, value_name = "FILE")]
    pub(crate) sensor: Option<PathBuf>,
    /// Altitude of the camera where frames.csv or the recording gives none, instead of body.altitude_km
    #[arg(long, value_name = "KM", allow_negative_numbers = true)]
    pub(crate) altitude_km: Option<f64>,
    /// Single precision and 2048 points, as on the flight computer
    #[arg(long)]
    pub(crate) flight: bool,
}

/// Which pictures.
#[derive(Debug, Clone, Args)]
pub(crate) struct InputArgs {
    /// Table with time, altitude, position, attitude of the pictures; without it, what the recording of an earlier run
    /// holds, or frames.csv beside the pictures
    #[arg(long, value_name = "FILE")]
    pub(crate) frames: Option<PathBuf>,
    /// Frames a second, where neither frames.csv nor the container nor EXIF gives a time
    #[arg(long, value_name = "RATE", default_value_t = 1.0, allow_negative_numbers = true)]
    pub(crate) fps: f64,
    /// Pictures are headerless: their size and format (mono8, mono10, mono12, mono16: little-endian words; mono10p,
    /// mono12p: packed; bayer8: every 2x2 cell becomes one pixel)
    #[arg(long, value_name = "WIDTHxHEIGHT:FORMAT")]
    pub(crate) raw: Option<Raw>,
    /// Topic of the pictures in an MCAP; without it, the first with pictures
    #[arg(long, value_name = "TOPIC")]
    pub(crate) topic: Option<String>,
}

impl SensorArgs {
    /// Reads the sensor of the pictures.
    pub(crate) fn load(&self, source: &dyn Source) -> Result<Sensor, Stop> {
        let folder = source.folder();
        let beside = folder.join("sensor.toml");
        let mut sensor = match (&self.sensor, source.sensor_toml()) {
            (Some(path), _) => hzn_calib::sensor::load(path)?,
            // A camera file that it names is looked for beside the recording.
            (None, Some(text)) => hzn_calib::sensor::parse(text, &beside)
                .map_err(|e| usage(format!("the sensor.toml in the recording: {e}; --sensor FILE takes its place")))?,
            (None, None) if beside.exists() => hzn_calib::sensor::load(&beside)?,
            (None, None) => {
                let what = format!("no sensor: give --sensor FILE, or put a sensor.toml into {}", shown(&folder));
                return Err(usage(format!("{what} (`hzn init` writes one to start from)")));
            }
        };
        if let Some(km) = self.altitude_km {
            for body in sensor.config.each_body_mut() {
                body.altitude_km = Some(km);
            }
            hzn_calib::sensor::check(&sensor.config).map_err(|e| usage(format!("--altitude-km: {e}")))?;
        }
        Ok(sensor)
    }
}

impl InputArgs {
    /// Opens the sequence.
    pub(crate) fn open(&self, inputs: &[PathBuf]) -> Result<Box<dyn Source>, Stop> {
        if !(self.fps > 0.0 && self.fps.is_finite()) {
            return Err(usage("--fps: must be above 0"));
        }
        input::open(inputs, self.raw, self.topic.as_deref())
    }

    /// Reads frames.csv, if there is one, and checks every row against the sensor. Warnings go to stderr.
    pub(crate) fn frames(&self, source: &dyn Source, sensor: &Sensor, flight: bool) -> Result<Option<Frames>, Stop> {
        let beside = source.folder().join("frames.csv");
        let path = match &self.frames {
            Some(path) => path.clone(),
            None if source.sensor_toml().is_none() && beside.exists() => beside,
            None => return Ok(None),
        };
        let frames = hzn_calib::frames::load(&path)?;
        for warning in &frames.warnings {
            tell::warning(warning);
        }
        for body in sensor.config.each_body() {
            for warning in frames.check_altitudes(body.kind, body.mean_radius_km()) {
                tell::warning(warning);
            }
        }
        engine::prepare(&sensor.config, flight, Some(&frames))?;
        Ok(Some(frames))
    }
}

/// A sensor whose pictures have another size than all that are there is the wrong sensor, and that is said once and
/// early. Single pictures of another size are records.
pub(crate) fn check_size(source: &dyn Source, sensor: &Sensor) -> Result<(), Stop> {
    let camera = &sensor.config.camera;
    let own = (u32::from(camera.width), u32::from(camera.height));
    let mut first = None;
    for (name, size) in source.sizes() {
        if size == own {
            return Ok(());
        }
        first.get_or_insert((name, size));
    }
    let Some((name, (width, height))) = first else { return Ok(()) };
    Err(usage(format!(
        "the sensor is for pictures of {} x {} px, but those here are not: {name} is {width} x {height}; give the sensor \
         of this camera with --sensor, or set camera.width and height and scale focal lengths and centre with them",
        own.0, own.1
    )))
}

/// Without an altitude from anywhere, every frame would fail.
pub(crate) fn need_altitude(sensor: &Sensor, source: &dyn Source, frames: Option<&Frames>) -> Result<(), Stop> {
    let known = |b: &body::Config| b.half_angle_is_free() || b.altitude_km.is_some();
    let tells = |row: &FrameData| row.altitude_km.is_some() || row.position_km.is_some();
    let rows = frames.map_or(source.sensor_toml().is_some(), |f| f.rows.iter().any(tells));
    if rows || sensor.config.each_body().iter().any(known) {
        return Ok(());
    }
    let what = "no altitude: set altitude_km in [body] of sensor.toml, give --altitude-km, or a frames.csv with it";
    Err(Stop { exit: Exit::Usage, error: anyhow::anyhow!(what) })
}

/// Removes the pictures of the rendering before, which new tables would not know: those that the folder's truth.csv names,
/// as only rendered pictures have a truth.
pub(crate) fn clear_rendered(folder: &Path) -> Result<(), Stop> {
    let Ok(mut before) = csv::Reader::from_path(folder.join("truth.csv")) else { return Ok(()) };
    for truth in before.deserialize::<Truth>().map_while(Result::ok) {
        let path = folder.join(Path::new(&truth.file).file_name().unwrap_or_default());
        if path.is_file() {
            std::fs::remove_file(&path).map_err(|e| output::cannot(&path, &e))?;
        }
    }
    Ok(())
}

/// A folder's name for messages.
pub(crate) fn shown(folder: &Path) -> String {
    if folder.as_os_str().is_empty() { "this folder".into() } else { folder.display().to_string() }
}

/// Set by Ctrl-C (and by a request to end); a second one leaves at once.
pub(crate) fn stop_flag() -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    let shared = Arc::clone(&flag);
    let handler = ctrlc::set_handler(move || {
        if shared.swap(true, Ordering::SeqCst) {
            std::process::exit(i32::from(Exit::Interrupted as u8));
        }
        tell::line(format_args!("\nfinishing the frames that were begun; press Ctrl-C again to leave at once"));
    });
    // Without a handler Ctrl-C ends the program at once, and the output can still be continued.
    drop(handler);
    flag
}
