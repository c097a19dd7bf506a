//! Scenes with truth, the evaluation of answers against the truth, and the attainable accuracy of a camera.

use std::path::{Path, PathBuf};

use hzn_core::camera::Camera as Lens;
use hzn_evaluate::{Answer, Evaluation, describe_conventions, heads, pair};
use hzn_files::truth::Truth;
use hzn_run::results::Results;
use hzn_sim::scenario::{FIT_PICTURES, Fit};
use hzn_sim::sensitivity::Design;
use hzn_sim::{Flight, FlightFrame, Scenario};
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use serde_json::{Value, json};

use crate::camera::Camera;
use crate::report::Report;
use crate::sensor::Sensor;
use crate::{errors, parameters, view};

#[doc = doc!("Simulation")]
#[pyclass(frozen, module = "hzn")]
pub(crate) struct Simulation {
    scenario: Scenario,
    flight: Flight,
    sensor: PyOnceLock<Py<Sensor>>,
}

#[pymethods]
impl Simulation {
    #[new]
    #[pyo3(signature = (scene, *, frames = None, seed = None, camera = None))]
    fn new(
        py: Python<'_>,
        scene: &Bound<'_, PyAny>,
        frames: Option<u32>,
        seed: Option<u64>,
        camera: Option<&str>,
    ) -> PyResult<Self> {
        let mut scenario = view::load(scene, frames, seed)?;
        if let Some(name) = camera {
            scenario = scenario.with_camera(name).map_err(errors::config)?;
        }
        let flight = errors::detached(py, || scenario.flight())?.map_err(errors::config)?;
        Ok(Self { scenario, flight, sensor: PyOnceLock::new() })
    }

    #[doc = doc!("Simulation.parameters")]
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let mut value = serde_json::to_value(&self.scenario).map_err(errors::other)?;
        value["utc"] = Value::String(self.scenario.utc.to_string());
        parameters::to_python(py, &value)
    }
    #[doc = doc!("Simulation.sensor")]
    #[getter]
    fn sensor(&self, py: Python<'_>) -> PyResult<Py<Sensor>> {
        let sensor = self.sensor.get_or_try_init(py, || {
            let fit = errors::detached(py, || Fit::measure(&self.scenario, FIT_PICTURES, &|_, _| ()))?;
            let mut config = self.flight.sensor.clone();
            fit.map_err(errors::config)?.iter().for_each(|fit| fit.apply(&mut config));
            Py::new(py, Sensor::from_config(config, false)?)
        });
        sensor.map(|sensor| sensor.clone_ref(py))
    }

    fn __len__(&self) -> usize {
        self.flight.frames.len()
    }
    fn __getitem__(&self, index: isize) -> PyResult<SimulatedFrame> {
        let at = if index < 0 { index + self.flight.frames.len() as isize } else { index };
        let frame = usize::try_from(at).ok().and_then(|i| self.flight.frames.get(i));
        let frame = frame.ok_or_else(|| PyIndexError::new_err(format!("frame {index} of {}", self.__len__())))?;
        let truths = self.scenario.bodies.iter().map(|&body| frame.scene.body_truth(body, &frame.file, frame.time_s));
        Ok(SimulatedFrame {
            known: known_arguments(&self.scenario, frame),
            truths: truths.collect::<Result<_, _>>().map_err(errors::config)?,
            frame: frame.clone(),
            image: PyOnceLock::new(),
        })
    }
    fn __iter__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let builtins = slf.py().import("builtins")?;
        let all = builtins.call_method1("range", (slf.get().__len__(),))?;
        builtins.call_method1("map", (slf.getattr("__getitem__")?, all))?.try_iter().map(Bound::into_any)
    }
    fn __repr__(&self) -> String {
        format!("Simulation({}, {} frames)", self.scenario.name, self.flight.frames.len())
    }
}

/// Returns the keyword arguments of `Sensor.process` for a picture.
fn known_arguments(scenario: &Scenario, frame: &FlightFrame) -> Value {
    let time_s = scenario.start_unix_s() + frame.time_s;
    // The position of a camera at a planet or moon is what the sensor measures.
    if let Some(row) = scenario.body_frame_row(frame) {
        let mut known = json!({ "time_s": time_s });
        if let (Some(w), Some(x), Some(y), Some(z)) = (row.qw, row.qx, row.qy, row.qz) {
            known["attitude"] = json!([w, x, y, z]);
            known["attitude_sigma_deg"] = json!(row.attitude_sigma_deg);
        }
        if let (Some(range_km), Some(sigma_km)) = (row.range_km, row.range_sigma_km) {
            known["range_km"] = json!(range_km);
            known["range_sigma_km"] = json!(sigma_km);
        }
        known["sun"] = json!([row.sun_x, row.sun_y, row.sun_z]);
        return known;
    }
    let row = scenario.frame_row(frame);
    let mut known = json!({
        "altitude_km": row.altitude_km,
        "position_km": [row.x_km, row.y_km, row.z_km],
        "time_s": time_s,
    });
    if let (Some(w), Some(x), Some(y), Some(z)) = (row.qw, row.qx, row.qy, row.qz) {
        known["attitude"] = json!([w, x, y, z]);
        known["attitude_sigma_deg"] = json!(row.attitude_sigma_deg);
    }
    if let (Some(x), Some(y), Some(z)) = (row.rate_x, row.rate_y, row.rate_z) {
        known["rate_rad_s"] = json!([x, y, z]);
    }
    known
}

#[doc = doc!("SimulatedFrame")]
#[pyclass(frozen, module = "hzn")]
pub(crate) struct SimulatedFrame {
    frame: FlightFrame,
    known: Value,
    truths: Vec<Truth>,
    image: PyOnceLock<Py<PyAny>>,
}

#[pymethods]
impl SimulatedFrame {
    #[doc = doc!("SimulatedFrame.file")]
    #[getter]
    fn file(&self) -> &str {
        &self.frame.file
    }
    #[doc = doc!("SimulatedFrame.image")]
    #[getter]
    fn image(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let image = self.image.get_or_try_init(py, || {
            let p = errors::detached(py, || self.frame.render())?.map_err(errors::config)?;
            Ok::<_, PyErr>(view::to_numpy(py, &p)?.unbind())
        });
        image.map(|i| i.clone_ref(py))
    }
    #[doc = doc!("SimulatedFrame.known")]
    #[getter]
    fn known<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let mut known = self.known.clone();
        let bits = self.frame.scene.detector.bits;
        if bits > 8 {
            known["bits"] = json!(bits);
        }
        parameters::to_python(py, &known)
    }
    #[doc = doc!("SimulatedFrame.truth")]
    #[getter]
    fn truth<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyAny>>> {
        self.truths.iter().map(|t| parameters::to_python(py, t)).collect()
    }
    fn __repr__(&self) -> String {
        format!("SimulatedFrame({}, {:.2} s)", self.frame.file, self.frame.time_s)
    }
}

/// Reads the truth from a file, from the truth.csv of a folder, or from rows.
fn read_truth(truth: &Bound<'_, PyAny>) -> PyResult<Vec<Truth>> {
    match truth.extract::<PathBuf>() {
        Ok(path) => {
            let path = if path.is_dir() { path.join("truth.csv") } else { path };
            hzn_files::truth::load_directions(&path).map_err(errors::config)
        }
        Err(_) => serde_json::from_value::<Vec<Truth>>(parameters::from_python(truth)?)
            .map_err(|e| errors::config(format!("truth: {e}"))),
    }
}

/// Compares results with the truth. Both may be files. Reports without a name are in the order of the truth.
#[pyfunction]
#[pyo3(name = "_evaluate")]
pub(crate) fn evaluate<'py>(
    py: Python<'py>,
    results: &Bound<'py, PyAny>,
    truth: &Bound<'py, PyAny>,
    camera: Option<&Camera>,
) -> PyResult<Bound<'py, PyAny>> {
    let truth = read_truth(truth)?;
    let mut camera = camera.map(|c| c.config.clone());
    let mut rows = match results.extract::<PathBuf>() {
        Ok(path) => {
            let read = hzn_run::results::read(&path).and_then(Results::checked).map_err(errors::run)?;
            let Results { rows, sensor_toml, lost, .. } = read;
            lost.map_or(Ok(()), |lost| errors::warn(py, lost))?;
            let recorded = sensor_toml.and_then(|t| hzn_files::sensor::parse(&t, Path::new("sensor.toml")).ok());
            camera = camera.or(recorded.map(|s| s.config.camera));
            let mut rows = heads::select(rows, None).map_err(errors::config)?;
            if heads::are_joint(&rows) {
                let removed = heads::name_by_time(&mut rows, &truth);
                let removed = removed.map_err(|why| errors::config(format!("truth: {why}")))?;
                let removed = heads::describe_removed(removed);
                removed.map_or(Ok(()), |what| errors::warn(py, what))?;
            }
            rows
        }
        Err(_) => {
            let mut files: Vec<&str> = truth.iter().map(|t| t.file.as_str()).collect();
            files.dedup();
            let mut rows = Vec::new();
            for (i, report) in results.try_iter()?.enumerate() {
                let report = report?;
                let name = report.get_type().name()?;
                let report: Py<Report> = report.extract().map_err(|_| {
                    errors::config(format!(
                        "results: item {i} is a {name}, not a Report; give the reports, or the file that hzn run wrote"
                    ))
                })?;
                let file_of_truth = files.get(i).copied().unwrap_or_default();
                rows.extend(report.get().each().map(|r| {
                    let mut row = r.row.clone();
                    if row.file.is_empty() {
                        file_of_truth.clone_into(&mut row.file);
                    }
                    row
                }));
            }
            rows
        }
    };
    let (value, conventions) = errors::detached(py, move || -> PyResult<(Value, Vec<String>)> {
        let lens = camera.and_then(|c| Lens::<f64>::try_new(&c).ok());
        let answers: Vec<_> = rows.drain(..).map(|r| Answer::from(&r)).collect();
        let cases = pair(&answers, &truth, lens.as_ref()).map_err(errors::other)?;
        let conventions = describe_conventions(&cases);
        Ok((json!({ "evaluations": Evaluation::by_body(&cases), "frames": cases }), conventions))
    })??;
    conventions.iter().try_for_each(|what| errors::warn(py, what))?;
    parameters::to_python(py, &value)
}

/// Returns the sigmas of one design, or None if too little of the limb is in view.
#[pyfunction]
#[pyo3(name = "_design")]
#[pyo3(signature = (camera, *, radius_km, altitude_km, altitude_sigma_km, limb_height_km, limb_height_sigma_km,
                    depression_deg, roll_deg, sigma_px, correlation_px))]
pub(crate) fn design<'py>(
    py: Python<'py>,
    camera: &Camera,
    radius_km: f64,
    altitude_km: f64,
    altitude_sigma_km: f64,
    limb_height_km: f64,
    limb_height_sigma_km: f64,
    depression_deg: f64,
    roll_deg: f64,
    sigma_px: f64,
    correlation_px: f64,
) -> PyResult<Option<Bound<'py, PyAny>>> {
    for (name, value) in [
        ("altitude_sigma_km", altitude_sigma_km),
        ("limb_height_sigma_km", limb_height_sigma_km),
        ("correlation_px", correlation_px),
    ] {
        if !(value >= 0.0 && value.is_finite()) {
            return Err(errors::config(format!("{name}: {value} is refused: must be 0 or more")));
        }
    }
    if !(sigma_px > 0.0 && sigma_px.is_finite()) {
        return Err(errors::config(format!("sigma_px: {sigma_px} is refused: must be above 0")));
    }
    let design = Design {
        camera: camera.config.clone(),
        radius_km,
        altitude_km,
        altitude_sigma_km,
        limb_height_km,
        limb_height_sigma_km,
        depression_deg,
        roll_deg,
        sigma_px,
        correlation_px,
    };
    let sigmas = errors::detached(py, || design.sigmas())?.map_err(errors::config)?;
    sigmas.map(|s| parameters::to_python(py, &s)).transpose()
}
