//! `hzn.Sensor`.

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use hzn_calib::{FrameData, sensor};
use hzn_cli::engine::{AnySensor, Processed, Traces};
use hzn_core::{Config, body};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::camera::Camera;
use crate::errors;
use crate::image::Array;
use crate::report::Report;

/// What pickle calls, and with what.
type Pickled = (Py<PyAny>, (Py<PyAny>, bool));

/// A horizon sensor.
#[pyclass(frozen, module = "hzn")]
pub(crate) struct Sensor {
    config: Config,
    flight: bool,
    /// Sensors at rest: each call takes one or makes one, so that threads never wait for each other.
    idle: Mutex<Vec<AnySensor>>,
}

impl Sensor {
    fn of(sensor: Result<hzn_calib::Sensor, hzn_calib::Problem>, flight: bool) -> PyResult<Self> {
        Ok(Self { config: sensor.map_err(errors::config)?.config, flight, idle: Mutex::new(Vec::new()) })
    }

    fn take(&self) -> PyResult<AnySensor> {
        let idle = self.idle.lock().ok().and_then(|mut idle| idle.pop());
        match idle {
            Some(sensor) => Ok(sensor),
            None => AnySensor::new(&self.config, self.flight).map_err(errors::config),
        }
    }

    /// A report of each body, in order.
    fn look(
        &self,
        py: Python<'_>,
        image: &Bound<'_, PyAny>,
        data: &FrameData,
        bits: Option<u8>,
        detail: bool,
    ) -> PyResult<Vec<Report>> {
        let array = Array::of(image)?;
        let layout = array.layout(bits)?;
        let camera = &self.config.camera;
        let (width, height) = array.size();
        if (width, height) != (usize::from(camera.width), usize::from(camera.height)) {
            return Err(errors::image(format!(
                "the picture is {width} x {height} px (shape ({height}, {width})), but the camera is {} x {}",
                camera.width, camera.height
            )));
        }
        let samples = array.samples();
        let view = samples.view(layout, self.config.input.channel)?;
        let bodies = self.config.each_body();
        let mut sensor = self.take()?;
        let (processed, traces, sensor) = py.detach(move || {
            let traces = detail.then(|| Traces::new(bodies.len()));
            (sensor.process(&view, Some(data), traces.as_ref()), traces, sensor)
        });
        let lens = sensor.camera().clone();
        self.give_back(sensor);
        let mut traces = traces.map(|t| t.each).unwrap_or_default().into_iter();
        let report = |(processed, body): (Processed, &body::Config)| {
            let trace = traces.next();
            let report = processed.report.map_err(errors::config)?;
            Ok(Report::new(&report, trace, &lens, body, data, processed.elapsed))
        };
        processed.into_iter().zip(bodies).map(report).collect()
    }

    fn give_back(&self, sensor: AnySensor) {
        if let Ok(mut idle) = self.idle.lock() {
            idle.push(sensor);
        }
    }
}

#[pymethods]
impl Sensor {
    #[new]
    #[pyo3(signature = (parameters, *, flight = false))]
    fn new(parameters: &Bound<'_, PyDict>, flight: bool) -> PyResult<Self> {
        let json = parameters.py().import("json")?.call_method1("dumps", (parameters,));
        let json: String = json.map_err(|e| errors::config(format!("parameters: {e}")))?.extract()?;
        let value: serde_json::Value = serde_json::from_str(&json)
            .map_err(|_| errors::config("parameters: hold a number that is not finite; leave it out"))?;
        let text = toml::to_string(&without_null(value)).map_err(errors::config)?;
        Self::of(sensor::parse(&text, Path::new("parameters")), flight)
    }

    #[staticmethod]
    #[pyo3(signature = (path, *, flight = false))]
    fn from_toml(path: PathBuf, flight: bool) -> PyResult<Self> {
        Self::of(sensor::load(&path), flight)
    }

    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let text = serde_json::to_string(&self.config).map_err(errors::config)?;
        py.import("json")?.call_method1("loads", (text,))
    }
    #[getter]
    fn camera(&self) -> PyResult<Camera> {
        Camera::of(self.config.camera.clone())
    }
    #[getter]
    fn flight(&self) -> bool {
        self.flight
    }

    #[pyo3(signature = (image, *, altitude_km = None, position_km = None, attitude = None, attitude_sigma_deg = None,
                        time_s = None, bits = None, detail = false))]
    fn process(
        &self,
        py: Python<'_>,
        image: &Bound<'_, PyAny>,
        altitude_km: Option<f64>,
        position_km: Option<[f64; 3]>,
        attitude: Option<[f64; 4]>,
        attitude_sigma_deg: Option<f64>,
        time_s: Option<f64>,
        bits: Option<u8>,
        detail: bool,
    ) -> PyResult<Report> {
        if self.config.each_body().len() > 1 {
            return Err(errors::config("bodies: several are looked for; process_each(...) gives a report of each"));
        }
        let data = known(altitude_km, position_km, attitude, attitude_sigma_deg, time_s)?;
        let mut reports = self.look(py, image, &data, bits, detail)?;
        reports.pop().ok_or_else(|| errors::config("bodies: there is none"))
    }

    #[pyo3(signature = (image, *, altitude_km = None, position_km = None, attitude = None, attitude_sigma_deg = None,
                        time_s = None, bits = None, detail = false))]
    fn process_each(
        &self,
        py: Python<'_>,
        image: &Bound<'_, PyAny>,
        altitude_km: Option<f64>,
        position_km: Option<[f64; 3]>,
        attitude: Option<[f64; 4]>,
        attitude_sigma_deg: Option<f64>,
        time_s: Option<f64>,
        bits: Option<u8>,
        detail: bool,
    ) -> PyResult<Vec<Report>> {
        let data = known(altitude_km, position_km, attitude, attitude_sigma_deg, time_s)?;
        self.look(py, image, &data, bits, detail)
    }

    fn __repr__(&self) -> String {
        let c = &self.config.camera;
        let bodies: Vec<&str> = self.config.each_body().iter().map(|b| hzn_mcap::body_name(b.kind)).collect();
        format!("Sensor({} x {} px, {}, {})", c.width, c.height, c.model.name(), bodies.join(", "))
    }
    fn __eq__(&self, other: &Self) -> bool {
        self.config == other.config && self.flight == other.flight
    }
    fn __reduce__(slf: &Bound<'_, Self>) -> PyResult<Pickled> {
        let this = slf.get();
        let make = slf.get_type().getattr("_of")?.unbind();
        Ok((make, (this.parameters(slf.py())?.unbind(), this.flight)))
    }
    #[staticmethod]
    fn _of(parameters: &Bound<'_, PyDict>, flight: bool) -> PyResult<Self> {
        Self::new(parameters, flight)
    }
}

/// What is known about a picture, checked as far as the core cannot.
fn known(
    altitude_km: Option<f64>,
    position_km: Option<[f64; 3]>,
    attitude: Option<[f64; 4]>,
    attitude_sigma_deg: Option<f64>,
    time_s: Option<f64>,
) -> PyResult<FrameData> {
    let unit = |q: &[f64; 4]| (q.iter().map(|x| x * x).sum::<f64>().sqrt() - 1.0).abs() < 0.01;
    if attitude.is_some_and(|q| !unit(&q)) {
        return Err(errors::config("attitude: a quaternion (w, x, y, z) of length 1 is expected"));
    }
    if time_s.is_some_and(|t| !t.is_finite()) {
        return Err(errors::config("time_s: must be a finite number"));
    }
    Ok(FrameData {
        time_s,
        utc_s: time_s,
        altitude_km,
        position_km,
        camera_to_ecef_wxyz: attitude,
        attitude_sigma_deg,
        ..FrameData::default()
    })
}

/// JSON has null where TOML leaves a key out.
fn without_null(value: serde_json::Value) -> serde_json::Value {
    match value {
        serde_json::Value::Object(map) => map
            .into_iter()
            .filter(|(_, v)| !v.is_null())
            .map(|(k, v)| (k, without_null(v)))
            .collect::<serde_json::Map<_, _>>()
            .into(),
        other => other,
    }
}
