//! `hzn.render`.

use std::path::{Path, PathBuf};

use hzn_core::image::Layout;
use hzn_run::source::picture::{Picture, Samples};
use hzn_sim::{Pose, Scenario, scenario};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::numbers::{Numbers, Seconds, class_of};
use crate::prior::check_attitude;
use crate::sensor::Sensor;
use crate::{errors, image, parameters};

#[doc = doc!("render")]
#[pyfunction]
#[pyo3(signature = (sensor, position_km, attitude, time_s, *, world = None, seed = None))]
pub(crate) fn render<'py>(
    py: Python<'py>,
    sensor: &Sensor,
    position_km: Numbers<3>,
    attitude: Numbers<4>,
    time_s: Seconds,
    world: Option<&Bound<'py, PyAny>>,
    seed: Option<u64>,
) -> PyResult<Bound<'py, PyAny>> {
    let (Numbers(position_km), Numbers(attitude)) = (position_km, attitude);
    let Seconds(time_s) = time_s;
    if !(position_km.iter().all(|x| x.is_finite()) && time_s.is_finite()) {
        return Err(errors::config("position_km and time_s: finite numbers are expected"));
    }
    let scenario = match world {
        None => scenario::load("rocket-clean", None, None).map_err(errors::config)?,
        Some(world) => load(world, None, None)?,
    };
    let pose = Pose { position_m: position_km.map(|km| km * 1e3), q_fixed_from_camera_wxyz: check_attitude(attitude)? };
    let camera = sensor.state().config.camera.clone();
    // Without a seed, pictures at different times have different noise, and the same call gives the same picture.
    let noise_seed = seed.unwrap_or(time_s.to_bits());
    let picture = errors::detached(py, || {
        let scene = scenario.view(&camera, pose, time_s, noise_seed).map_err(errors::config)?;
        scene.render().map_err(errors::config)
    })??;
    to_numpy(py, &picture)
}

/// Returns a rendered picture as an array.
pub(crate) fn to_numpy<'py>(py: Python<'py>, picture: &hzn_sim::Picture) -> PyResult<Bound<'py, PyAny>> {
    let (width, height) = (picture.width().into(), picture.height().into());
    let samples = match picture.samples() {
        hzn_sim::Samples::Bytes(d) => Samples::Bytes(d.clone()),
        hzn_sim::Samples::Words(d) => Samples::Words(d.clone()),
    };
    let layout = Layout::packed(width, height, picture.channels(), picture.bits());
    image::to_array(py, Picture::new(samples, layout))
}

/// Reads a scene by its name, from a file, or from a dictionary. A number of pictures and a seed replace its own.
pub(crate) fn load(scene: &Bound<'_, PyAny>, frames: Option<u32>, seed: Option<u64>) -> PyResult<Scenario> {
    if let Ok(name) = scene.extract::<PathBuf>() {
        return scenario::load(&name.to_string_lossy(), frames, seed).map_err(errors::config);
    }
    if !scene.is_instance_of::<PyDict>() {
        let kind = class_of(scene);
        return Err(errors::config(format!("scene: a name, a path or a dict is expected, not {kind}")));
    }
    let text = toml::to_string(&parameters::from_python(scene)?).map_err(errors::config)?;
    // JSON has no dates, but the start time in a scene.toml is a date and not text.
    scenario::parse(&unquoted_date(&text), Path::new("scene"), frames, seed).map_err(errors::unseen)
}

/// Removes the quotes of a line like `utc = "2026-06-21T12:00:00Z"`.
fn unquoted_date(text: &str) -> String {
    let line = |l: &str| if l.starts_with("utc = ") { l.replace('"', "") } else { l.to_owned() };
    text.lines().map(line).collect::<Vec<_>>().join("\n")
}
