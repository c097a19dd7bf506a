//! A sensor to start from, as `hzn init` writes it.

use std::path::{Path, PathBuf};

use hzn_core::Config;
use hzn_core::camera::Model;
use hzn_files::start::{Body, CameraFacts, write_sensor_toml};
use hzn_files::{Problem, sensor};
use hzn_run::open::Request;
use hzn_run::source;
use hzn_run::start::{
    Calibration, Check, LimbSays, check_start, measure_field_of_view, read_calibration, read_camera_facts,
};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

use crate::errors;
use crate::numbers::class_of;

/// The pictures of a camera: a file, a folder, a pattern, a video or a recording, or several of them.
pub(crate) struct Pictures(pub(crate) Vec<PathBuf>);

impl<'py> FromPyObject<'_, 'py> for Pictures {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let paths = object.extract().map(|path| vec![path]).or_else(|_| object.extract());
        paths.map(Self).map_err(|_: PyErr| {
            PyTypeError::new_err(format!(
                "a path or a list of paths is expected, not {}; for arrays, give size=(width, height) instead",
                class_of(&object)
            ))
        })
    }
}

/// What Python says about a camera.
pub(crate) struct Said<'a> {
    pub(crate) pictures: Vec<PathBuf>,
    pub(crate) size: Option<(u32, u32)>,
    pub(crate) fov_deg: Option<f64>,
    pub(crate) lens: Option<&'a str>,
    pub(crate) altitude_km: Option<f64>,
    pub(crate) body: &'a str,
    pub(crate) topic: Option<&'a str>,
}

/// Returns the parameters that `hzn init` writes for this camera.
pub(crate) fn make(py: Python<'_>, said: &Said<'_>) -> PyResult<Config> {
    let (mut known, notes) = errors::detached(py, || read(said))??;
    notes.iter().try_for_each(|note| errors::warn(py, in_python(note)))?;
    if let Some(parsed) = calibrated(py, said, &known)? {
        tell_doubts(py, &known, &parsed.warnings)?;
        return Ok(parsed.config);
    }
    if !said.pictures.is_empty() && !known.has_focal() {
        errors::detached(py, || add_field_of_view(said, &mut known))??;
    }
    let write = |known: &CameraFacts| {
        let start = write_sensor_toml(known).map_err(|why| errors::config(in_python(&why)))?;
        let parsed = parse(&start.text, "Sensor.start")?;
        PyResult::Ok((start, parsed))
    };
    let (mut start, mut parsed) = write(&known)?;
    if known.has_focal() && !said.pictures.is_empty() {
        let request = said.request();
        let check = errors::detached(py, || check_start(&request, &known, &start, &parsed.config))?;
        match check.map_err(errors::image)? {
            Check::Agrees => {}
            Check::Unchecked(text) => errors::warn(py, in_python(&text))?,
            Check::Contradicted(doubt) => {
                errors::warn(py, in_python(&doubt.text))?;
                known.doubt_percent = doubt.focal_percent;
                (start, parsed) = write(&known)?;
            }
        }
    }
    start.warnings.iter().try_for_each(|warning| errors::warn(py, in_python(warning)))?;
    tell_doubts(py, &known, &parsed.warnings)?;
    Ok(parsed.config)
}

/// Reads the text of a sensor that comes `from` there. Nobody sees the text, so its lines say nothing.
fn parse(text: &str, from: &str) -> PyResult<hzn_files::Sensor> {
    let mut parsed = sensor::parse(text, Path::new(from)).map_err(errors::unseen)?;
    parsed.warnings.iter_mut().for_each(|problem| (problem.line, problem.column) = (None, None));
    Ok(parsed)
}

/// Warns of values that look wrong, and of a camera that was turned.
fn tell_doubts(py: Python<'_>, known: &CameraFacts, warnings: &[Problem]) -> PyResult<()> {
    warnings.iter().try_for_each(|warning| errors::warn(py, warning))?;
    if known.exif.turned {
        errors::warn(
            py,
            "the camera was turned by 90 degrees (EXIF Orientation): the width is that of the stored picture",
        )?;
    }
    Ok(())
}

/// Returns the sensor with the calibration that a recording has beside its pictures, as `hzn init` writes it.
fn calibrated(py: Python<'_>, said: &Said<'_>, known: &CameraFacts) -> PyResult<Option<hzn_files::Sensor>> {
    if said.pictures.is_empty() {
        return Ok(None);
    }
    let request = said.request();
    let found = errors::detached(py, || read_calibration(&request, known))?;
    match found.map_err(|e| errors::config(in_python(&e.to_string())))? {
        None => Ok(None),
        Some(Calibration::Unusable(why)) => errors::warn(py, in_python(&why)).map(|()| None),
        Some(Calibration::Known { text, from, .. }) => parse(&text, &from).map(Some),
    }
}

impl Said<'_> {
    fn request(&self) -> Request {
        Request { inputs: self.pictures.clone(), topic: self.topic.map(str::to_owned), ..Request::default() }
    }
}

/// Returns what is known about the camera, and notes about the pictures.
fn read(said: &Said<'_>) -> PyResult<(CameraFacts, Vec<String>)> {
    let lens = said.lens.map(lens).transpose()?;
    let body = Body::from_name(said.body).ok_or_else(|| {
        let names: Vec<&str> = Body::all().map(Body::name).collect();
        errors::config(format!("body: {:?} is refused: must be one of {}", said.body, names.join(", ")))
    })?;
    if let Some(km) = said.altitude_km.filter(|km| !(*km > 0.0 && km.is_finite())) {
        return Err(errors::config(format!("altitude_km: {km} is refused: must be above 0")));
    }
    if body == Body::Sun && said.altitude_km.is_some() {
        return Err(errors::config("altitude_km: the Sun has one size from everywhere near the Earth; leave it out"));
    }
    if let Some(size) = said.size.filter(|(width, height)| ![width, height].iter().all(|n| (1..=65_535).contains(*n))) {
        return Err(errors::config(format!("size: {size:?} is refused: width and height must be 1 to 65535 pixels")));
    }
    let (read, notes) = match (said.pictures.as_slice(), said.size) {
        ([], Some(_)) if said.topic.is_some() => {
            return Err(errors::config("topic: there are no pictures; give the recording with them"));
        }
        ([], Some((width, height))) => (CameraFacts::of_size([width, height]), Vec::new()),
        (paths @ [_, ..], None) => {
            let mut source = source::open(paths, None, said.topic).map_err(errors::image)?;
            (read_camera_facts(source.as_mut()).map_err(errors::image)?, source.notes())
        }
        _ => return Err(errors::config("give either pictures or size=(width, height)")),
    };
    Ok((CameraFacts { fov_deg: said.fov_deg, lens, altitude_km: said.altitude_km, body, ..read }, notes))
}

/// Adds the field of view that the limb says.
fn add_field_of_view(said: &Said<'_>, known: &mut CameraFacts) -> PyResult<()> {
    match measure_field_of_view(&said.request(), known).map_err(errors::image)? {
        LimbSays::FieldOfView(found) => (known.lens, known.measured) = (Some(found.lens), Some(found.measured)),
        // `write_sensor_toml` says what is missing.
        LimbSays::NoAltitude => {}
        LimbSays::LensDecides(found) => {
            return Err(errors::config(format!(
                "fov_deg: is not given, the pictures have no usable EXIF, and the limb says {}; add lens=\"fisheye\" \
                 or lens=\"pinhole\", more pictures, or the field of view over the whole width, for example fov_deg=60",
                found.iter().map(|one| one.describe(known.size_px[0])).collect::<Vec<_>>().join(", but ")
            )));
        }
        LimbSays::Uncertain(found) => {
            return Err(errors::config(format!(
                "fov_deg: is not given, the pictures have no usable EXIF, and what the limb says is too uncertain to \
                 start from: {}; add more pictures, or the field of view over the whole width, for example \
                 fov_deg=60",
                found.describe(known.size_px[0])
            )));
        }
        LimbSays::Nothing(pictures) => {
            return Err(errors::config(format!(
                "fov_deg: is not given, the pictures have no usable EXIF, and the limb in {pictures} of them does not \
                 say it; add the field of view over the whole width, for example fov_deg=60, and lens=\"fisheye\" or \
                 lens=\"pinhole\""
            )));
        }
    }
    Ok(())
}

fn lens(name: &str) -> PyResult<Model> {
    match name {
        "pinhole" => Ok(Model::Pinhole),
        "fisheye" => Ok(Model::Equidistant),
        other => Err(errors::config(format!("lens: {other:?} is refused: must be pinhole or fisheye"))),
    }
}

/// Returns a message of `hzn init` with the names of Python's arguments instead of options.
pub(crate) fn in_python(message: &str) -> String {
    let message = message.replace("--fov or --lens,", "fov_deg or lens,").replace("--topic chooses", "topic= chooses");
    let named = message.replace("without --fov,", "without fov_deg,").replace("--fov ", "fov_deg=");
    let named = named.replace("--altitude ", "altitude_km=");
    named.replace("--lens fisheye", "lens=\"fisheye\"").replace("--lens pinhole", "lens=\"pinhole\"")
}
