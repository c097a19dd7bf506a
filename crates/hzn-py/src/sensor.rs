//! `hzn.Sensor`.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError, RwLock};

use hzn_calib::{FrameData, plausible, sensor};
use hzn_core::body::PriorError;
use hzn_core::status::Status;
use hzn_core::{Config, Sensor as CoreSensor};
use hzn_mcap::{Row, RowMeta};
use hzn_run::engine::{AnySensor, Traces};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::camera::Camera;
use crate::image::{Array, View};
use crate::report::Report;
use crate::stages::Expected;
use crate::{errors, parameters};

/// What pickle calls, and with what.
type Pickled = (Py<PyAny>, (Py<PyAny>, bool));

#[doc = doc!("Sensor")]
#[pyclass(frozen, module = "hzn")]
pub(crate) struct Sensor {
    state: RwLock<Arc<State>>,
}

/// A configuration that was accepted, and what was made of it.
pub(crate) struct State {
    pub(crate) config: Config,
    pub(crate) flight: bool,
    pub(crate) camera: Arc<Camera>,
    /// The same in double precision, for the single stages.
    pub(crate) core: CoreSensor<f64>,
    /// Sensors at rest: each call takes one or makes one, so that threads never wait for each other.
    idle: Mutex<Vec<AnySensor>>,
}

impl State {
    fn new(config: Config, flight: bool) -> PyResult<Arc<Self>> {
        let core = CoreSensor::new(&config).map_err(errors::config)?;
        let camera = Arc::new(Camera::from_config(config.camera.clone())?);
        Ok(Arc::new(Self { config, flight, camera, core, idle: Mutex::default() }))
    }

    /// Lends a sensor to `work`. One in which something panicked does not come back.
    pub(crate) fn lend<T>(&self, work: impl FnOnce(&mut AnySensor) -> T) -> PyResult<T> {
        let idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut sensor = match idle {
            Some(sensor) => sensor,
            None => AnySensor::new(&self.config, self.flight).map_err(errors::config)?,
        };
        let done = work(&mut sensor);
        self.idle.lock().unwrap_or_else(PoisonError::into_inner).push(sensor);
        Ok(done)
    }
}

impl Sensor {
    pub(crate) fn from_config(config: Config, flight: bool) -> PyResult<Self> {
        Ok(Self { state: RwLock::new(State::new(config, flight)?) })
    }

    /// As it is now: a change of the parameters leaves calls under way alone.
    pub(crate) fn state(&self) -> Arc<State> {
        Arc::clone(&self.state.read().unwrap_or_else(PoisonError::into_inner))
    }
}

#[pymethods]
impl Sensor {
    #[new]
    #[pyo3(signature = (*, flight = false, **sections))]
    fn new(py: Python<'_>, flight: bool, sections: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let none = PyDict::new(py);
        let config = parameters::config(sections.unwrap_or(&none))?;
        let doubts = plausible::find_implausible(&config);
        doubts.iter().try_for_each(|doubt| errors::warn(py, format_args!("{}: {}", doubt.key, doubt.what)))?;
        Self::from_config(config, flight)
    }

    #[doc = doc!("Sensor.from_toml")]
    #[staticmethod]
    #[pyo3(signature = (path, *, flight = false))]
    fn from_toml(py: Python<'_>, path: PathBuf, flight: bool) -> PyResult<Self> {
        let loaded = sensor::load(&path).map_err(errors::config)?;
        loaded.warnings.iter().try_for_each(|warning| errors::warn(py, warning))?;
        Self::from_config(loaded.config, flight)
    }

    #[doc = doc!("Sensor.parameters")]
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        parameters::to_python(py, &self.state().config)
    }
    #[setter]
    fn set_parameters(&self, sections: &Bound<'_, PyDict>) -> PyResult<()> {
        let state = State::new(parameters::config(sections)?, self.flight())?;
        *self.state.write().unwrap_or_else(PoisonError::into_inner) = state;
        Ok(())
    }
    #[doc = doc!("Sensor.camera")]
    #[getter]
    fn camera(&self) -> PyResult<Camera> {
        Ok(Camera::clone(&self.state().camera))
    }
    #[doc = doc!("Sensor.flight")]
    #[getter]
    fn flight(&self) -> bool {
        self.state().flight
    }

    #[doc = doc!("Sensor.expect")]
    #[pyo3(signature = (*, body = 0, altitude_km = None, position_km = None, attitude = None, attitude_sigma_deg = None,
                        rate_rad_s = None, time_s = None))]
    fn expect(
        &self,
        body: usize,
        altitude_km: Option<f64>,
        position_km: Option<[f64; 3]>,
        attitude: Option<[f64; 4]>,
        attitude_sigma_deg: Option<f64>,
        rate_rad_s: Option<[f64; 3]>,
        time_s: Option<f64>,
    ) -> PyResult<Expected> {
        let data = known(altitude_km, position_km, attitude, attitude_sigma_deg, rate_rad_s, time_s)?;
        Expected::new(&self.state(), data, body)
    }

    #[doc = doc!("Sensor.process")]
    #[pyo3(signature = (image, *, altitude_km = None, position_km = None, attitude = None, attitude_sigma_deg = None,
                        rate_rad_s = None, time_s = None, bits = None, detail = false))]
    fn process(
        &self,
        py: Python<'_>,
        image: &Bound<'_, PyAny>,
        altitude_km: Option<f64>,
        position_km: Option<[f64; 3]>,
        attitude: Option<[f64; 4]>,
        attitude_sigma_deg: Option<f64>,
        rate_rad_s: Option<[f64; 3]>,
        time_s: Option<f64>,
        bits: Option<u8>,
        detail: bool,
    ) -> PyResult<Report> {
        let data = known(altitude_km, position_km, attitude, attitude_sigma_deg, rate_rad_s, time_s)?;
        let state = self.state();
        let array = Array::from_object(image)?;
        state.check_size(&array)?;
        let bits = array.bits(bits, &state.config.input);
        let view = array.view(bits, state.config.input.channel)?;
        let bodies = state.config.each_body();
        let (processed, traces) = errors::detached(py, || {
            let traces = detail.then(|| Traces::new(bodies.len()));
            let processed = state.lend(|sensor| match &view {
                View::Packed(view) => sensor.process(view, Some(&data), traces.as_ref()),
                View::Strided(view) => sensor.process_pixels(view, Some(&data), traces.as_ref()),
            });
            processed.map(|p| (p, traces))
        })??;
        let traces = traces.map(|t| t.each).unwrap_or_default();
        let report = |(which, (processed, body)): (usize, (hzn_run::engine::Processed, &hzn_core::body::Config))| {
            let meta = RowMeta {
                time_s: Some(data.time_s.unwrap_or(0.0)),
                body: body.kind.name().to_owned(),
                altitude_km: hzn_run::sink::altitude_km(Some(&data), body),
                ..RowMeta::default()
            };
            let found = match processed.report {
                Ok(found) => found,
                // Every rocket begins there: a flight goes on after it.
                Err(why @ PriorError::BelowLimb { .. }) => {
                    return Ok(Report::of_row(Row::unprocessed(&meta, Status::NoAltitude, why.to_string())));
                }
                Err(why) => return Err(errors::config(why)),
            };
            let elapsed_us = processed.elapsed.as_nanos() as f64 / 1e3;
            let row = Row::from_report(&meta, &found, Some(elapsed_us));
            Ok(Report::new(row, &found, traces.get(which), &state.camera))
        };
        let reports: Vec<Report> =
            processed.into_iter().zip(bodies).enumerate().map(report).collect::<PyResult<_>>()?;
        if reports.iter().all(|report| !report.is_answer())
            && let Some(tip) = array.unused_bits(bits)
        {
            errors::warn(py, format_args!("nothing found: {tip}"))?;
        }
        Ok(Report::of_bodies(py, reports)?.with_image(image, bits))
    }

    #[doc = doc!("Sensor.process_many")]
    #[pyo3(signature = (images, *, jobs = None, progress = false))]
    fn process_many<'py>(
        slf: &Bound<'py, Self>,
        images: &Bound<'py, PyAny>,
        jobs: Option<usize>,
        progress: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let tracks = slf.get().state().config.tracks();
        let many = slf.py().import("hzn._many")?.getattr("process_many")?;
        // One after another, where a picture's level comes from the one before.
        many.call1((slf, images, if tracks { Some(1) } else { jobs }, progress))
    }

    fn __repr__(&self) -> String {
        let state = self.state();
        let c = &state.config.camera;
        let bodies: Vec<&str> = state.config.each_body().iter().map(|b| b.kind.name()).collect();
        format!("Sensor({} x {} px, {}, {})", c.width, c.height, c.model.name(), bodies.join(", "))
    }
    fn __eq__(&self, other: &Self) -> bool {
        let (a, b) = (self.state(), other.state());
        a.config == b.config && a.flight == b.flight
    }
    fn __reduce__(slf: &Bound<'_, Self>) -> PyResult<Pickled> {
        let this = slf.get();
        let make = slf.get_type().getattr("_of")?.unbind();
        Ok((make, (this.parameters(slf.py())?.unbind(), this.flight())))
    }
    #[staticmethod]
    fn _of(sections: &Bound<'_, PyDict>, flight: bool) -> PyResult<Self> {
        Self::from_config(parameters::config(sections)?, flight)
    }
}

/// What is known about a picture, checked as far as the core cannot.
fn known(
    altitude_km: Option<f64>,
    position_km: Option<[f64; 3]>,
    attitude: Option<[f64; 4]>,
    attitude_sigma_deg: Option<f64>,
    rate_rad_s: Option<[f64; 3]>,
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
        rate_rad_s,
        ..FrameData::default()
    })
}
