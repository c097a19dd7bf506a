//! The one way to open a sequence with its sensor: which files are read, which bits and channel the pictures have, and
//! what is refused before the first picture is processed. The command line, the Python package and the viewer use the
//! same rules, because a picture must have the same answer in each of them.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use hzn_core::Config;
use hzn_core::body::{self, PriorError};
use hzn_core::camera;
use hzn_core::config::Orient;
use hzn_files::{Frames, Problem, Sensor, plausible};
use toml_edit::DocumentMut;

use crate::engine::{self, AnySensor};
use crate::error::{Error, Remedy, unusable};
use crate::source::measured::Measured;
use crate::source::{self, FoundTone, Raw, Source};

/// The files to open, and the values that replace those of the files.
#[derive(Debug, Clone, Default)]
pub struct Request {
    /// A folder, pictures, a pattern, a video or a recording.
    pub inputs: Vec<PathBuf>,
    /// Size and format of headerless pictures.
    pub raw: Option<Raw>,
    /// Topic of the pictures in an MCAP; without it, the first topic with pictures.
    pub topic: Option<String>,
    /// The sensor.
    pub sensor: SensorChoice,
    /// The frames.csv; without it, the data in the recording of an earlier run, or the one next to the pictures.
    pub frames: Option<PathBuf>,
    /// Altitude of the camera, km, which replaces `body.altitude_km`.
    pub altitude_km: Option<f64>,
    /// Whether the sensor is that of the flight computer: single precision and 2048 points.
    pub flight: bool,
    /// If the input is a folder that grows: the flag that ends the wait for further pictures.
    pub watch: Option<Arc<AtomicBool>>,
}

/// Where the sensor comes from.
#[derive(Debug, Clone, Default)]
pub enum SensorChoice {
    /// The one in the recording, or else the sensor.toml next to the pictures.
    #[default]
    Neighbour,
    /// This sensor.toml.
    File(PathBuf),
    /// This sensor, which the caller has read or made.
    Ready(Box<Sensor>),
}

/// An open sequence.
pub struct Opened {
    /// The pictures.
    pub source: Box<dyn Source>,
    /// The sensor, with the bits and the tone of the pictures.
    pub sensor: Sensor,
    /// The frames.csv, if one is read.
    pub frames: Option<Frames>,
    /// Values that are possible but look wrong, in the sensor and in frames.csv.
    pub warnings: Vec<String>,
    /// What the user should know about the pictures.
    pub notes: Vec<String>,
}

/// Opens a sequence with its sensor and its frames.csv, and checks each row of the table.
///
/// ```
/// use hzn_run::open::{Request, open};
///
/// # let folder = tempfile::tempdir()?;
/// image::GrayImage::new(320, 240).save(folder.path().join("0001.png"))?;
/// let camera = "[camera]\nwidth = 320\nheight = 240\nmodel = \"pinhole\"\nfx_px = 300.0\nfy_px = 300.0\n";
/// let rest = "cx_px = 159.5\ncy_px = 119.5\n[body]\naltitude_km = 400.0\n";
/// std::fs::write(folder.path().join("sensor.toml"), camera.to_owned() + rest)?;
/// let opened = open(&Request { inputs: vec![folder.path().to_path_buf()], ..Request::default() })?;
/// opened.check_size()?;
/// opened.check_altitude()?;
/// assert_eq!((opened.source.total(), opened.sensor.config.camera.width), (Some(1), 320));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// The pictures, the sensor or frames.csv cannot be used.
pub fn open(request: &Request) -> Result<Opened, Error> {
    let mut source = match &request.watch {
        Some(stop) => source::watch(&request.inputs, request.raw, Arc::clone(stop))?,
        None => source::open(&request.inputs, request.raw, request.topic.as_deref())?,
    };
    let mut sensor = read_sensor(request, source.as_ref())?;
    let aspect = source.pixel_aspect();
    let mut warnings: Vec<String> = sensor.warnings.iter().map(Problem::to_string).collect();
    warnings.retain(|text| aspect == 1.0 || !text.contains(plausible::NOT_SQUARE));
    warnings.extend(request.altitude_km.map(|km| set_altitude(&mut sensor, km)).transpose()?.flatten());
    let mut notes = source.notes();
    // Nobody named this sensor, and it may be of another camera.
    let above =
        matches!(request.sensor, SensorChoice::Neighbour).then(|| sensor_path(request, source.as_ref())).flatten();
    let above = above.filter(|path| path.parent() != Some(&source.folder()));
    notes.extend(above.map(|path| format!("the sensor is {}, in a folder above the pictures", path.display())));
    notes.extend(complete(source.as_mut(), &mut sensor)?);
    warnings.extend(doubt_pixels(aspect, &sensor.config.camera));
    let frames = frames_path(request, source.as_ref()).map(|path| load_frames(&path, source.as_ref())).transpose()?;
    if let Some(frames) = &frames {
        warnings.extend(frames.warnings.iter().map(Problem::to_string));
        warnings.extend(frames.check_sensor(&sensor.config).iter().map(Problem::to_string));
    }
    notes.extend(explain_shutter(&sensor, frames.as_ref(), source.measured()));
    engine::check_frames(&sensor.config, request.flight, frames.as_ref())?;
    Ok(Opened { source, sensor, frames, warnings, notes })
}

/// Difference of the ratio of the focal lengths from that of the pixels that is worth a warning. Calibrations of square
/// pixels have differences of 0.3 %, and a container knows no others than ratios of small numbers.
const PIXELS_DIFFER: f64 = 0.02;

/// Returns a warning if the container says that its pixels are not square, and the lens says otherwise.
fn doubt_pixels(aspect: f64, camera: &camera::Config) -> Option<String> {
    let told = camera.fy_px / camera.fx_px;
    // A picture that is turned by 90 degrees has the inverse.
    let differs = |aspect: f64| (told / aspect).ln().abs() > PIXELS_DIFFER;
    (aspect != 1.0 && differs(aspect) && differs(1.0 / aspect)).then(|| {
        format!(
            "the pixels of the video are {aspect:.3} times as wide as high, but fy_px is {told:.3} times fx_px in \
             [camera]: set fy_px to {:.1}, or the answers are wrong by degrees",
            aspect * camera.fx_px
        )
    })
}

/// Readout time of a usual rolling shutter, in seconds: those of small cameras take 10 to 30 ms.
const USUAL_READOUT_S: f64 = 0.02;
/// Turn during that time which is worth a note, in radians (0.1 degrees): more than most limbs are uncertain by.
const WORTH_A_NOTE_RAD: f64 = 0.1 * core::f64::consts::PI / 180.0;

/// Returns a note if only one of the two values that correct a rolling shutter is known: the readout time of the sensor
/// without rates, or rates without a word about the readout time.
fn explain_shutter(sensor: &Sensor, frames: Option<&Frames>, measured: Option<&Measured>) -> Option<String> {
    let readout_s = sensor.config.camera.readout_s;
    if let Some(measured) = measured.filter(|measured| frames.is_none() && !measured.rates.is_empty()) {
        return measured.readout_s.filter(|_| readout_s == 0.0).map(|told_s| {
            format!(
                "the video says that a picture is read out in {told_s:.4} s: set camera.readout_s = {told_s:.4}, so \
                 that its rows are corrected by the rates in the video"
            )
        });
    }
    let Some(frames) = frames else {
        return (readout_s != 0.0).then(|| {
            format!(
                "no rates are known, which camera.readout_s = {readout_s} needs: the rows of a picture of a turning \
                 camera are not corrected, and sigma does not include this error; add rate_x, rate_y, rate_z to \
                 frames.csv"
            )
        });
    };
    let rate_rad_s = frames.largest_rate_rad_s();
    let is_told = sensor
        .text
        .parse::<DocumentMut>()
        .is_ok_and(|text| text.get("camera").and_then(|camera| camera.get("readout_s")).is_some());
    (!is_told && readout_s == 0.0 && rate_rad_s * USUAL_READOUT_S > WORTH_A_NOTE_RAD).then(|| {
        format!(
            "the rates reach {:.1} deg/s, and the sensor does not say how its rows are exposed: this is right for a \
             global shutter (camera.readout_s = 0 says so); with a rolling shutter, set camera.readout_s, because \
             sigma does not include the distortion",
            rate_rad_s.to_degrees()
        )
    })
}

/// Reads a frames.csv. If the names of all pictures are known, only their rows are kept.
///
/// # Errors
/// The errors are those of [`hzn_files::frames::load`].
pub fn load_frames(path: &Path, source: &dyn Source) -> Result<Frames, Problem> {
    match source.names() {
        Some(names) => hzn_files::frames::load_for(path, names),
        None => hzn_files::frames::load(path),
    }
}

impl Opened {
    /// Checks that at least one picture has the sensor's size. Otherwise every picture would be `unreadable`. Single
    /// pictures of another size are no error here.
    ///
    /// # Errors
    /// The sizes of the sensor and of the first picture, and what helps.
    pub fn check_size(&self) -> Result<(), Error> {
        check_size(self.source.as_ref(), &self.sensor.config)
    }

    /// Checks that an altitude is known from any source. Without one, every picture would be `no-altitude`.
    ///
    /// # Errors
    /// What gives an altitude, or that the only one is below the limb.
    pub fn check_altitude(&self) -> Result<(), Error> {
        check_altitude(self.source.as_ref(), &self.sensor.config, self.frames.as_ref())
    }
}

/// Returns the sensor.toml that is read; `None` if the sensor is that of the caller or of the recording, or if there is
/// none.
pub fn sensor_path(request: &Request, source: &dyn Source) -> Option<PathBuf> {
    match &request.sensor {
        SensorChoice::File(path) => Some(path.clone()),
        SensorChoice::Ready(_) => None,
        SensorChoice::Neighbour => neighbour(source, "sensor.toml").or_else(|| sensor_above(source)),
    }
}

/// Returns the frames.csv that is read, if there is one.
pub fn frames_path(request: &Request, source: &dyn Source) -> Option<PathBuf> {
    request.frames.clone().or_else(|| neighbour(source, "frames.csv"))
}

/// Returns a file next to the pictures. A recording with its own sensor has the data of its files itself.
fn neighbour(source: &dyn Source, name: &str) -> Option<PathBuf> {
    Some(source.folder().join(name)).filter(|path| source.sensor_toml().is_none() && path.exists())
}

/// Returns the sensor.toml in the nearest folder above the pictures that has one.
fn sensor_above(source: &dyn Source) -> Option<PathBuf> {
    if source.sensor_toml().is_some() {
        return None;
    }
    // With links and `..` resolved, so that each next folder contains the one before.
    let folder = source.folder().join(".").canonicalize().ok()?;
    folder.ancestors().skip(1).map(|above| above.join("sensor.toml")).find(|path| path.is_file())
}

fn read_sensor(request: &Request, source: &dyn Source) -> Result<Sensor, Error> {
    if let SensorChoice::Ready(sensor) = &request.sensor {
        return Ok(*sensor.clone());
    }
    let folder = source.folder();
    match (sensor_path(request, source), source.sensor_toml()) {
        (Some(path), _) => Ok(hzn_files::sensor::load(&path)?),
        // If the text names a camera file, the file is expected next to the recording.
        (None, Some(text)) => hzn_files::sensor::parse(text, &folder.join("sensor.toml"))
            .map_err(|e| unusable(format!("the sensor.toml in the recording: {e}")).with_remedy(Remedy::Sensor)),
        (None, None) => {
            let what = format!("no sensor: there is no sensor.toml in {} or above it", folder_name(&folder));
            Err(unusable(format!("{what} (`hzn init` writes a first one)")).with_remedy(Remedy::Sensor))
        }
    }
}

/// Replaces the altitude, also in the text: with it, a recording is processed again with the same altitude. Returns a
/// warning if the altitude looks wrong.
fn set_altitude(sensor: &mut Sensor, km: f64) -> Result<Option<String>, Error> {
    let only_free = sensor.config.each_body().iter().all(body::Config::half_angle_is_free);
    // The altitude above the Earth is not the altitude above a Moon in the same picture.
    let mut changed = Vec::new();
    for (which, body) in sensor.config.each_body_mut().iter_mut().enumerate() {
        if only_free || !body.half_angle_is_free() {
            body.altitude_km = Some(km);
            changed.push(which);
        }
    }
    sensor.text = with_altitude(&sensor.text, km, &changed);
    hzn_files::sensor::check(&sensor.config).map_err(|e| unusable(format!("the altitude of all pictures: {e}")))?;
    let doubts = plausible::find_implausible(&sensor.config);
    let doubt = doubts.iter().find(|d| d.key == "body.altitude_km");
    Ok(doubt.map(|doubt| format!("the altitude of all pictures: {}", doubt.what)))
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

/// Requests the colour channel from the source. If the sensor does not state the number of bits or the tone, finds them
/// from the pictures and sets them in the sensor and its text. Returns notes for the user.
///
/// # Errors
/// The source has no colours.
pub fn complete(source: &mut dyn Source, sensor: &mut Sensor) -> Result<Vec<String>, Error> {
    let mut notes = Vec::new();
    source.want_channel(sensor.config.input.channel)?;
    if sensor.config.input.bits.is_none() {
        let found = source::find_bits(source, &sensor.config);
        // Recorded pictures are PNG, which has room for more bits. Therefore the recorded sensor states the number of
        // bits.
        let bits = source.bits().filter(|bits| *bits > 8).or(found.map(|f| f.bits));
        if let Some(bits) = bits {
            sensor.config.input.bits = Some(bits);
            sensor.text = source::with_key(&sensor.text, "input", "bits", i64::from(bits));
        }
        notes.extend(found.filter(|f| f.bits < 16).map(|f| f.to_string()));
    }
    notes.extend(complete_tone(source, sensor));
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

/// Takes the tone that the pictures say, if the sensor does not state it. Returns a note if the limb height or the
/// place of the edges follows, or if the pictures differ.
fn complete_tone(source: &dyn Source, sensor: &mut Sensor) -> Option<String> {
    if sensor.config.input.tone.is_some() {
        return None;
    }
    let Some(FoundTone { tone, kind }) = source::find_tone(source) else {
        let body = &sensor.config.body;
        return Some(format!(
            "the pictures do not agree on their tone ({}): it is taken as unknown, and the limb is expected at {:.1} \
             +- {:.1} km; if they all have the same one, set tone = ... in [input] of sensor.toml",
            source::describe_mixed_tones(source)?,
            body.limb_height_km,
            body.limb_height_sigma_km
        ));
    };
    let before = sensor.config.clone();
    sensor.config.set_tone(tone);
    // A recorded sensor states the tone, because recorded pictures may be in another format.
    let value = tone.word().map_or_else(|| tone.gamma().into(), toml_edit::Value::from);
    sensor.text = source::with_key(&sensor.text, "input", "tone", value);
    let changed = before.each_body().iter().zip(sensor.config.each_body()).find(|(old, new)| old != new);
    let is_curved = tone.light_at_half().is_some_and(|light| light != 0.5);
    let limb = match changed {
        Some((_, body)) => {
            format!(", and the limb is expected at {:.1} +- {:.1} km", body.limb_height_km, body.limb_height_sigma_km)
        }
        None if is_curved => ", and edges are located at half of the light".to_owned(),
        None => return None,
    };
    Some(format!(
        "the pictures are {kind}: their tone is taken as {tone}{limb}; if they have another one, set tone = ... in \
         [input] of sensor.toml"
    ))
}

/// See [`Opened::check_size`].
///
/// # Errors
/// See there.
pub fn check_size(source: &dyn Source, config: &Config) -> Result<(), Error> {
    let own = (u32::from(config.camera.width), u32::from(config.camera.height));
    let mut first = None;
    let orient = config.input.orient;
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
    Err(unusable(format!(
        "the sensor is for pictures of {} x {} px, but none of the pictures has this size: {name} is {width} x \
         {height}; {hint}use the sensor of this camera, or set camera.width and height and scale focal lengths and \
         centre with them",
        own.0, own.1
    )))
}

/// See [`Opened::check_altitude`].
///
/// # Errors
/// See there.
pub fn check_altitude(source: &dyn Source, config: &Config, frames: Option<&Frames>) -> Result<(), Error> {
    // A position can come from the limb alone.
    let known = |b: &body::Config| b.half_angle_is_free() || b.altitude_km.is_some() || config.fits_position(b);
    let in_source = || source.sensor_toml().is_some() || source.measured().is_some_and(|m| !m.fixes.is_empty());
    if frames.map_or_else(in_source, Frames::has_distances) {
        return Ok(());
    }
    if config.each_body().iter().any(known) || config.gates.altitude_limits_km.is_some() {
        return check_above_limb(config);
    }
    let what = "no altitude: set altitude_km in [body] of sensor.toml, or write altitudes into a frames.csv; if it is \
                not known, set altitude_limits_km = [LOWEST, HIGHEST] in [gates]: the limb is searched between them";
    Err(unusable(what).with_remedy(Remedy::Altitude))
}

/// Checks the sensor's own altitude if no other is known: it must be above the limb height of at least one body.
fn check_above_limb(config: &Config) -> Result<(), Error> {
    let Ok(sensor) = AnySensor::new(config, false) else { return Ok(()) };
    let half_angles = sensor.expected_half_angles_rad(None);
    let below = |e: &Result<f64, PriorError>| e.err().filter(|e| matches!(e, PriorError::BelowLimb { .. }));
    match half_angles.iter().map(below).collect::<Option<Vec<_>>>().and_then(|each| each.first().copied()) {
        Some(why) => {
            let key = if config.each_body().iter().any(|body| body.altitude_km.is_some()) {
                "body.altitude_km"
            } else {
                "gates.altitude_limits_km"
            };
            Err(unusable(format!("{key}: {why}, so no limb can be seen; give the altitude of the camera")))
        }
        None => Ok(()),
    }
}

/// Returns a folder's name for messages.
fn folder_name(folder: &Path) -> String {
    if folder.as_os_str().is_empty() { "this folder".into() } else { folder.display().to_string() }
}
