//! The common preparations of several commands: sensor, frames.csv, sequence.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::Args;
use hzn_core::Config;
use hzn_core::body::{self, PriorError};
use hzn_core::config::Orient;
use hzn_files::truth::Truth;
use hzn_files::{FrameData, Frames, Sensor, plausible};
use hzn_run::disk;
use hzn_run::engine::{self, AnySensor};
use hzn_run::source::{self, Raw, Source};

use crate::exit::{Exit, Stop, usage};
use crate::tell;

/// The arguments that select the sensor.
#[derive(Debug, Clone, Args)]
pub(crate) struct SensorArgs {
    /// The sensor.toml; without it, the one in the recording or next to the pictures
    #[arg(short, long, value_name = "FILE")]
    pub(crate) sensor: Option<PathBuf>,
    /// Altitude of the camera for pictures without one in frames.csv or the recording; replaces body.altitude_km
    #[arg(long, value_name = "KM", allow_negative_numbers = true)]
    pub(crate) altitude_km: Option<f64>,
    /// Use single precision and 2048 points, as on the flight computer
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
    /// Frames a second, for pictures without a time in frames.csv, the container or EXIF
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

impl SensorArgs {
    /// Returns the sensor.toml that is read; `None` if the sensor is that of the recording, or if there is none.
    pub(crate) fn path(&self, source: &dyn Source) -> Option<PathBuf> {
        let neighbour = source.folder().join("sensor.toml");
        let is_read = source.sensor_toml().is_none() && neighbour.exists();
        self.sensor.clone().or_else(|| is_read.then_some(neighbour))
    }

    /// Reads the sensor for the pictures.
    pub(crate) fn load(&self, source: &dyn Source) -> Result<Sensor, Stop> {
        let folder = source.folder();
        let mut sensor = match (self.path(source), source.sensor_toml()) {
            (Some(path), _) => hzn_files::sensor::load(&path)?,
            // If the text names a camera file, the file is expected next to the recording.
            (None, Some(text)) => hzn_files::sensor::parse(text, &folder.join("sensor.toml"))
                .map_err(|e| usage(format!("the sensor.toml in the recording: {e}; --sensor FILE replaces it")))?,
            (None, None) => {
                let what = format!("no sensor: give --sensor FILE, or put a sensor.toml into {}", folder_name(&folder));
                return Err(usage(format!("{what} (`hzn init` writes a first one)")));
            }
        };
        sensor.warnings.iter().for_each(tell::warning);
        if let Some(km) = self.altitude_km {
            let only_free = sensor.config.each_body().iter().all(body::Config::half_angle_is_free);
            // The altitude above the Earth is not the altitude above a Moon in the same picture.
            let mut changed = Vec::new();
            for (which, body) in sensor.config.each_body_mut().iter_mut().enumerate() {
                if only_free || !body.half_angle_is_free() {
                    body.altitude_km = Some(km);
                    changed.push(which);
                }
            }
            // With the changed text, a recording is processed again with the same altitude.
            sensor.text = with_altitude(&sensor.text, km, &changed);
            hzn_files::sensor::check(&sensor.config).map_err(|e| usage(format!("--altitude-km: {e}")))?;
            let doubts = plausible::find_implausible(&sensor.config);
            if let Some(doubt) = doubts.iter().find(|d| d.key == "body.altitude_km") {
                tell::warning(format_args!("--altitude-km: {}", doubt.what));
            }
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
        Ok(source::open(inputs, self.raw, self.topic.as_deref())?)
    }

    /// Returns the frames.csv that is read, if there is one.
    pub(crate) fn frames_path(&self, source: &dyn Source) -> Option<PathBuf> {
        let neighbour = source.folder().join("frames.csv");
        let is_read = source.sensor_toml().is_none() && neighbour.exists();
        self.frames.clone().or_else(|| is_read.then_some(neighbour))
    }

    /// Reads frames.csv, if there is one, and checks every row against the sensor. Warnings are printed to stderr.
    pub(crate) fn frames(&self, source: &dyn Source, sensor: &Sensor, flight: bool) -> Result<Option<Frames>, Stop> {
        let Some(path) = self.frames_path(source) else { return Ok(None) };
        let frames = hzn_files::frames::load(&path)?;
        for warning in &frames.warnings {
            tell::warning(warning);
        }
        for warning in frames.check_sensor(&sensor.config) {
            tell::warning(warning);
        }
        engine::check_frames(&sensor.config, flight, Some(&frames))?;
        Ok(Some(frames))
    }
}

/// Returns the text of a sensor.toml with this altitude for these bodies.
fn with_altitude(text: &str, km: f64, bodies: &[usize]) -> String {
    let Ok(mut document) = text.parse::<toml_edit::DocumentMut>() else { return text.to_owned() };
    let several = document.contains_key("bodies");
    if !several {
        document.entry("body").or_insert_with(toml_edit::table);
    }
    for &which in bodies {
        let body = if several { document["bodies"].get_mut(which) } else { document.get_mut("body") };
        if let Some(body) = body.and_then(toml_edit::Item::as_table_like_mut) {
            body.insert("altitude_km", toml_edit::value(km));
        }
    }
    document.to_string()
}

/// Requests the colour channel from the source. If sensor.toml does not state the number of bits, finds it from the
/// pictures and sets it in the sensor and its text. Returns notes for the user.
pub(crate) fn find_input(source: &mut dyn Source, sensor: &mut Sensor) -> Result<Vec<String>, Stop> {
    let mut notes = Vec::new();
    source.want_channel(sensor.config.input.channel)?;
    if sensor.config.input.bits.is_none() {
        let found = source::find_bits(source);
        // Recorded pictures are PNG, which has room for more bits. Therefore the recorded sensor states the number of
        // bits.
        let bits = source.bits().filter(|bits| *bits > 8).or(found.map(|f| f.bits));
        if let Some(bits) = bits {
            sensor.config.input.bits = Some(bits);
            sensor.text = source::with_key(&sensor.text, "bits", i64::from(bits));
        }
        notes.extend(found.filter(|f| f.bits < 16).map(|f| f.to_string()));
    }
    if sensor.config.input.orient == Orient::AsStored
        && let Some((name, how)) = source.display_turn()
    {
        notes.push(format!(
            "{name} is to be shown {how}; its pixels are used as stored. If the camera was calibrated with turned \
             pictures, as OpenCV's imread returns them, turn them with orient in [input] of sensor.toml"
        ));
    }
    Ok(notes)
}

/// Checks that at least one picture has the sensor's size. Otherwise the command fails once, before it begins. Single
/// pictures of another size are not an error here; their status becomes `unreadable`.
pub(crate) fn check_size(source: &dyn Source, sensor: &Sensor) -> Result<(), Stop> {
    let camera = &sensor.config.camera;
    let own = (u32::from(camera.width), u32::from(camera.height));
    let mut first = None;
    let orient = sensor.config.input.orient;
    for (name, (width, height)) in source.sizes() {
        let turned = matches!(orient, Orient::Rotate90 | Orient::Rotate270);
        let size = if turned { (height, width) } else { (width, height) };
        if size == own || (orient == Orient::Exif && (height, width) == own) {
            return Ok(());
        }
        first.get_or_insert((name, size));
    }
    let Some((name, (width, height))) = first else { return Ok(()) };
    let hint = if (height, width) == own { "turn the pictures with orient in [input], " } else { "" };
    Err(usage(format!(
        "the sensor is for pictures of {} x {} px, but none of the pictures has this size: {name} is {width} x \
         {height}; {hint}give the sensor of this camera with --sensor, or set camera.width and height and scale focal \
         lengths and centre with them",
        own.0, own.1
    )))
}

/// Checks that an altitude is known from any source. Without one, every picture would fail.
pub(crate) fn check_altitude(sensor: &Sensor, source: &dyn Source, frames: Option<&Frames>) -> Result<(), Stop> {
    // A position can come from the limb alone.
    let known = |b: &body::Config| b.half_angle_is_free() || b.altitude_km.is_some() || sensor.config.fits_position(b);
    let has_altitude =
        |row: &FrameData| row.altitude_km.is_some() || row.position_km.is_some() || row.range_km.is_some();
    let rows = frames.map_or(source.sensor_toml().is_some(), |f| f.rows.iter().any(has_altitude));
    if rows {
        return Ok(());
    }
    if sensor.config.each_body().iter().any(known) {
        return check_above_limb(&sensor.config);
    }
    let what = "no altitude: set altitude_km in [body] of sensor.toml, give --altitude-km, or give a frames.csv with \
                altitudes";
    Err(usage(what))
}

/// Checks the sensor's own altitude if no other is known: it must be above the limb height of at least one body.
fn check_above_limb(config: &Config) -> Result<(), Stop> {
    let Ok(sensor) = AnySensor::new(config, false) else { return Ok(()) };
    let half_angles = sensor.expected_half_angles_rad(None);
    let below = |e: &Result<f64, PriorError>| e.err().filter(|e| matches!(e, PriorError::BelowLimb { .. }));
    match half_angles.iter().map(below).collect::<Option<Vec<_>>>().and_then(|each| each.first().copied()) {
        Some(why) => {
            Err(usage(format!("body.altitude_km: {why}, so no limb can be seen; give the altitude of the camera")))
        }
        None => Ok(()),
    }
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

/// Returns a folder's name for messages.
pub(crate) fn folder_name(folder: &Path) -> String {
    if folder.as_os_str().is_empty() { "this folder".into() } else { folder.display().to_string() }
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
