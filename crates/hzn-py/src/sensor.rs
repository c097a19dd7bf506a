//! `hzn.Sensor`.

use std::path::PathBuf;
use std::sync::{Arc, PoisonError, RwLock};

use hzn_core::Config;
use hzn_core::body::PriorError;
use hzn_core::rig::Glimpse;
use hzn_files::{FrameData, plausible, sensor};
use hzn_mcap::{Row, RowMeta};
use hzn_run::diagnosis::{self, AnyCone};
use hzn_run::engine::{Processed, Traces, Unprocessed};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::camera::Camera;
use crate::expected::Expected;
use crate::image::{Array, View};
use crate::mask::Seen;
use crate::numbers::{Numbers, Seconds, Size};
use crate::prior::{Prior, utc};
use crate::read::{Read, Shown};
use crate::report::Report;
use crate::state::State;
use crate::{errors, parameters, start};

/// Return type of `__reduce__` for pickle: a function and its arguments.
type Pickled = (Py<PyAny>, (Py<PyAny>, bool));

#[doc = doc!("Sensor")]
#[pyclass(frozen, module = "hzn")]
pub(crate) struct Sensor {
    state: RwLock<Arc<State>>,
}

impl Sensor {
    pub(crate) fn from_config(config: Config, flight: bool) -> PyResult<Self> {
        Ok(Self { state: RwLock::new(State::new(config, flight)?) })
    }

    /// Returns a sensor for one sequence, see [`State::for_sequence`].
    pub(crate) fn for_sequence(&self) -> PyResult<Self> {
        let state = self.state();
        Ok(Self { state: RwLock::new(State::for_sequence(state.config.clone(), state.flight)?) })
    }

    /// Returns the current state. A later change of the parameters does not affect calls in progress.
    pub(crate) fn state(&self) -> Arc<State> {
        Arc::clone(&self.state.read().unwrap_or_else(PoisonError::into_inner))
    }
}

#[pymethods]
impl Sensor {
    #[new]
    #[pyo3(signature = (*wrong, flight = false, **sections), text_signature = "(*, flight=False, **sections)")]
    fn new(
        py: Python<'_>,
        wrong: &Bound<'_, PyTuple>,
        flight: bool,
        sections: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        if !wrong.is_empty() {
            let what =
                "Sensor takes sections by name: Sensor(camera=..., body=...); Sensor.from_toml(path) reads a file";
            return Err(PyTypeError::new_err(what));
        }
        let none = PyDict::new(py);
        let config = read_sections(sections.unwrap_or(&none))?;
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

    #[doc = doc!("Sensor.start")]
    #[staticmethod]
    #[pyo3(signature = (pictures = None, *, size = None, fov_deg = None, lens = None, altitude_km = None,
                        body = "earth", topic = None, flight = false))]
    fn start(
        py: Python<'_>,
        pictures: Option<start::Pictures>,
        size: Option<Size>,
        fov_deg: Option<f64>,
        lens: Option<&str>,
        altitude_km: Option<f64>,
        body: &str,
        topic: Option<&str>,
        flight: bool,
    ) -> PyResult<Self> {
        let pictures = pictures.map(|start::Pictures(paths)| paths).unwrap_or_default();
        let size = size.map(|Size(width, height)| (width, height));
        let config = start::make(py, &start::Said { pictures, size, fov_deg, lens, altitude_km, body, topic })?;
        Self::from_config(config, flight)
    }

    #[doc = doc!("Sensor.parameters")]
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        parameters::to_python(py, &self.state().config)
    }
    #[setter]
    fn set_parameters(&self, sections: &Bound<'_, PyDict>) -> PyResult<()> {
        let state = State::new(read_sections(sections)?, self.flight())?;
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
                        rate_rad_s = None, time_s = None, camera_temperature_c = None))]
    fn expect(
        &self,
        body: usize,
        altitude_km: Option<f64>,
        position_km: Option<Numbers<3>>,
        attitude: Option<Numbers<4>>,
        attitude_sigma_deg: Option<f64>,
        rate_rad_s: Option<Numbers<3>>,
        time_s: Option<Seconds>,
        camera_temperature_c: Option<f64>,
    ) -> PyResult<Expected> {
        let known = Prior::new(
            altitude_km,
            position_km,
            attitude,
            attitude_sigma_deg,
            rate_rad_s,
            None,
            None,
            None,
            None,
            time_s,
            camera_temperature_c,
        )?;
        Expected::new(&self.state(), &known.data, body)
    }

    #[doc = doc!("Sensor.process")]
    #[pyo3(signature = (image, *, altitude_km = None, position_km = None, attitude = None, attitude_sigma_deg = None,
                        rate_rad_s = None, range_km = None, range_sigma_km = None, pole = None, sun = None,
                        time_s = None, camera_temperature_c = None, bits = None, detail = false))]
    fn process(
        &self,
        py: Python<'_>,
        image: &Bound<'_, PyAny>,
        altitude_km: Option<f64>,
        position_km: Option<Numbers<3>>,
        attitude: Option<Numbers<4>>,
        attitude_sigma_deg: Option<f64>,
        rate_rad_s: Option<Numbers<3>>,
        range_km: Option<f64>,
        range_sigma_km: Option<f64>,
        pole: Option<Numbers<3>>,
        sun: Option<Numbers<3>>,
        time_s: Option<Seconds>,
        camera_temperature_c: Option<f64>,
        bits: Option<u8>,
        detail: bool,
    ) -> PyResult<Report> {
        let known = Prior::new(
            altitude_km,
            position_km,
            attitude,
            attitude_sigma_deg,
            rate_rad_s,
            range_km,
            range_sigma_km,
            pole,
            sun,
            time_s,
            camera_temperature_c,
        )?;
        let state = self.state();
        known.tell_doubts(py, &state.config)?;
        let Prior { data } = known;
        let read = Read::from_object(py, &state, image)?;
        let time_s = data.time_s.or(read.time_s);
        let data = FrameData { time_s, utc_s: utc(time_s), ..data };
        Ok(read.process(py, &data, bits, detail)?.0)
    }

    #[doc = doc!("Sensor.what_fits")]
    #[pyo3(signature = (image, *, altitude_km = None, position_km = None, bits = None))]
    fn what_fits(
        &self,
        py: Python<'_>,
        image: &Bound<'_, PyAny>,
        altitude_km: Option<f64>,
        position_km: Option<Numbers<3>>,
        bits: Option<u8>,
    ) -> PyResult<Option<String>> {
        let Prior { data } =
            Prior::new(altitude_km, position_km, None, None, None, None, None, None, None, None, None)?;
        let read = Read::from_object(py, &self.state(), image)?;
        let state = &read.state;
        let array = Array::from_object(&read.image)?;
        state.check_size(&array)?;
        let view = array.view(array.bits(bits.or(read.bits), &state.config.input), state.config.input.channel)?;
        let (config, lens) = (&state.config, &state.camera.lens);
        let mut trial = AnyCone::new(config, state.flight).map_err(errors::config)?;
        let fit = errors::detached(py, || match &view {
            View::Packed(view) => diagnosis::find_misfit(&mut trial, config, view, Some(&data)),
            View::Strided(view) => diagnosis::find_misfit(&mut trial, config, view, Some(&data)),
        })?;
        Ok(fit.map(|fit| diagnosis::what_fits(&fit, lens, config.camera.width)))
    }

    #[doc = doc!("Sensor.process_many")]
    #[pyo3(signature = (images, *, topic = None, jobs = None, progress = false))]
    fn process_many<'py>(
        slf: &Bound<'py, Self>,
        images: &Bound<'py, PyAny>,
        topic: Option<&str>,
        jobs: Option<usize>,
        progress: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let state = slf.get().state();
        let many = slf.py().import("hzn._many")?.getattr("process_many")?;
        // If a picture depends on the previous one, the pictures are processed one after another.
        if !state.config.track.is_on() {
            return many.call1((slf, images, topic, if state.config.tracks() { Some(1) } else { jobs }, progress));
        }
        // A sensor of its own, because single pictures that are processed meanwhile are not of the sequence.
        many.call1((slf.get().for_sequence()?, images, topic, Some(1), progress))
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
        Self::from_config(read_sections(sections)?, flight)
    }
}

/// Reads sections and checks them like a sensor.toml. A `hzn.Camera` may replace its section.
fn read_sections(sections: &Bound<'_, PyDict>) -> PyResult<Config> {
    let sections = sections.copy()?;
    if let Some(camera) = sections.get_item("camera")?.as_ref().and_then(|c| c.cast::<Camera>().ok()) {
        sections.set_item("camera", parameters::to_python(sections.py(), &camera.get().config)?)?;
    }
    parameters::config(&sections)
}

/// Returns the report on a picture of which nothing can be expected, because the altitude is unknown or no limb is
/// visible from there. Every rocket starts below the limb height, and its flight goes on, so this is no error; wrong
/// arguments are.
fn report_without_limb(meta: &RowMeta, why: PriorError) -> PyResult<Report> {
    match why {
        PriorError::NoAltitude
        | PriorError::BelowLimb { .. }
        | PriorError::Inside { .. }
        | PriorError::TooSmall { .. }
        | PriorError::Fills { .. } => {
            let Unprocessed { status, why, .. } = why.into();
            Ok(Report::from_row(Row::unprocessed(meta, status, why)))
        }
        why => Err(errors::config(why)),
    }
}

/// Warns of samples that look wrong in a picture in which nothing was found.
fn warn_of_samples(py: Python<'_>, array: &Array<'_>, bits: Option<u8>) -> PyResult<()> {
    array.doubt_samples(bits).map_or(Ok(()), |tip| errors::warn(py, format_args!("nothing found: {tip}")))
}

impl<'py> Read<'py> {
    /// Returns a checksum of the samples, which tells a picture from another one.
    pub(crate) fn digest(&self) -> PyResult<u32> {
        Ok(hzn_run::rig::digest(&Array::from_object(&self.image)?.to_samples()))
    }

    /// Reads the brightness at places all over the picture, after [`Self::process`] accepted it.
    pub(crate) fn glimpse(&self, bits: Option<u8>) -> PyResult<Glimpse> {
        let state = &self.state;
        let array = Array::from_object(&self.image)?;
        let bits = array.bits(bits.or(self.bits), &state.config.input);
        Ok(match array.view(bits, state.config.input.channel)? {
            View::Packed(view) => Glimpse::take(&view, state.region()),
            View::Strided(view) => Glimpse::take(&view, state.region()),
        })
    }

    /// Finds the limb of each body. Returns the report of the first body, which has those of the others, and what the
    /// sensor found.
    pub(crate) fn process(
        &self,
        py: Python<'py>,
        data: &FrameData,
        bits: Option<u8>,
        detail: bool,
    ) -> PyResult<(Report, Vec<Processed>)> {
        let state = &self.state;
        let bits = bits.or(self.bits);
        let array = Array::from_object(&self.image)?;
        state.check_size(&array)?;
        let bits = array.bits(bits, &state.config.input);
        let view = array.view(bits, state.config.input.channel)?;
        let bodies = state.config.each_body();
        let (processed, traces) = errors::detached(py, || {
            let traces = detail.then(|| Traces::new(bodies.len()));
            let processed = state.lend(|sensor| match &view {
                View::Packed(view) => sensor.process(view, Some(data), traces.as_ref()),
                View::Strided(view) => sensor.process_pixels(view, Some(data), traces.as_ref()),
            });
            processed.map(|p| (p, traces))
        })??;
        let traces = traces.map(|t| t.each).unwrap_or_default();
        let report = |(which, (processed, body)): (usize, (&Processed, &hzn_core::body::Config))| {
            let meta = RowMeta { file: self.file.clone(), ..row_meta(data, body) };
            let found = match &processed.report {
                Ok(found) => found,
                Err(why) => return report_without_limb(&meta, *why),
            };
            let elapsed_us = processed.elapsed.as_nanos() as f64 / 1e3;
            let row = Row::from_report(&meta, found, Some(elapsed_us))
                .with_protection(state.config.protection_factor(which as u8));
            // The same row as `hzn run --flight` writes.
            let row = if state.flight { row.as_sent() } else { row };
            Ok(Report::new(row, found, traces.get(which), &state.camera).with_nadir(Some(data)))
        };
        let reports = processed.iter().zip(bodies).enumerate().map(report).collect::<PyResult<Vec<_>>>()?;
        if reports.iter().all(|report| !report.is_answer()) {
            warn_of_samples(py, &array, bits)?;
        }
        let answers = processed.iter().map(|p| p.report.as_ref().ok()?.solution.as_ref());
        let report = Report::from_bodies(py, reports)?.with_seen(Seen::new(state, answers, Some(data)));
        Ok((report.with_picture(Shown::new(self), bits), processed))
    }
}

/// Returns the data of a picture for its row.
pub(crate) fn row_meta(data: &FrameData, body: &hzn_core::body::Config) -> RowMeta {
    RowMeta {
        time_s: Some(data.time_s.unwrap_or(0.0)),
        body: body.kind.name().to_owned(),
        altitude_km: hzn_run::sink::altitude_km(Some(data), body),
        ..RowMeta::default()
    }
}
