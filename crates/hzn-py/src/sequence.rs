//! Pictures from files, in the same way as for `hzn run`.

use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use hzn_files::FrameData;
use hzn_run::engine::{self, Finished, Plan, Turns};
use hzn_run::open::{Opened, Request, SensorChoice, open};
use hzn_run::source::{self, Payload, Source};
use pyo3::prelude::*;

use crate::errors;
use crate::mask::Seen;
use crate::prior::Prior;
use crate::report::Report;
use crate::sensor::Sensor;
use crate::start::in_python;
use crate::state::State;

/// Pictures of a folder, a pattern, a video, a recording, or picture files, in order and not yet decoded.
#[pyclass(frozen, name = "_Sequence", module = "hzn._hzn")]
pub(crate) struct Sequence {
    state: Arc<State>,
    plan: Plan,
    source: Mutex<Box<dyn Source>>,
    next: AtomicU64,
}

/// One picture of the sequence.
#[pyclass(frozen, name = "_Item", module = "hzn._hzn")]
pub(crate) struct Item {
    index: u64,
    item: Mutex<Option<source::Item>>,
}

#[pymethods]
impl Sequence {
    #[new]
    #[pyo3(signature = (sensor, inputs, topic = None))]
    fn new(py: Python<'_>, sensor: &Sensor, inputs: Vec<PathBuf>, topic: Option<String>) -> PyResult<Self> {
        let state = sensor.state();
        let opened = errors::detached(py, || {
            let own = hzn_files::Sensor { config: state.config.clone(), text: String::new(), warnings: Vec::new() };
            let sensor = SensorChoice::Ready(Box::new(own));
            open(&Request { inputs, sensor, topic, flight: state.flight, ..Request::default() }).map_err(errors::run)
        })??;
        // `hzn run` refuses such a sequence. Here every picture gets its report, which says the same.
        let doubts = [opened.check_size(), opened.check_altitude()];
        let doubts = doubts.into_iter().filter_map(Result::err).map(|e| e.to_string());
        let Opened { source, sensor, frames, warnings, notes } = opened;
        for warning in doubts.chain(warnings).chain(notes) {
            errors::warn(py, in_python(&warning))?;
        }
        // The bits and the tone of the pictures.
        let state = if sensor.config == state.config { state } else { state.with_config(sensor.config)? };
        let plan = default_plan(&state, frames);
        Ok(Self { state, plan, source: Mutex::new(source), next: AtomicU64::new(0) })
    }

    /// Returns the number of pictures, if it is known in advance.
    fn total(&self) -> Option<u64> {
        self.source.lock().unwrap_or_else(PoisonError::into_inner).total()
    }

    fn __iter__(slf: PyRef<'_, Self>) -> PyRef<'_, Self> {
        slf
    }
    fn __next__(&self, py: Python<'_>) -> PyResult<Option<Item>> {
        let next = || {
            let mut source = self.source.lock().unwrap_or_else(PoisonError::into_inner);
            source.next().ok_or_else(|| source.describe_loss())
        };
        let item = match errors::detached(py, next)? {
            Ok(item) => item,
            Err(lost) => {
                // A recording or video that was cut off ends too early.
                lost.map_or(Ok(()), |lost| errors::warn(py, lost))?;
                return Ok(None);
            }
        };
        let item = item.map_err(|e| errors::other(format!("{e:#}")))?;
        Ok(Some(Item { index: self.next.fetch_add(1, Ordering::Relaxed), item: Mutex::new(Some(item)) }))
    }

    /// Decodes and processes a picture. Each picture can be processed only once.
    fn process(&self, py: Python<'_>, item: &Item) -> PyResult<Report> {
        let contents = item.item.lock().unwrap_or_else(PoisonError::into_inner).take();
        let contents = contents.ok_or_else(|| errors::other("this picture is already processed"))?;
        process_item(py, &self.state, &self.plan, item.index, contents)
    }
}

/// Raises a `ConfigError` if the sensor refuses these data, as `hzn run` refuses a frames.csv before it begins, and
/// warns of values that look wrong.
#[pyfunction]
#[pyo3(name = "_check_prior")]
pub(crate) fn check_prior(py: Python<'_>, sensor: &Sensor, known: &Prior) -> PyResult<()> {
    let state = sensor.state();
    known.tell_doubts(py, &state.config)?;
    match state.lend(|sensor| engine::find_refused(&state.config, sensor, &known.data))? {
        Some(why) => Err(errors::config(why)),
        None => Ok(()),
    }
}

/// Decodes and processes the contents of a picture file. `data` is `None` if the file could not be read, for the reason
/// `why`.
#[pyfunction]
#[pyo3(name = "_process_encoded")]
pub(crate) fn process_encoded(
    py: Python<'_>,
    sensor: &Sensor,
    index: u64,
    name: String,
    data: Option<Vec<u8>>,
    why: String,
    known: &Prior,
) -> PyResult<Report> {
    let state = sensor.state();
    let time_s = known.data.time_s.or(Some(index as f64));
    let row = FrameData { file: name.clone(), time_s, ..known.data.clone() };
    let payload = data.map_or(Payload::Broken(why), Payload::Encoded);
    let mut config = state.config.clone();
    if let Some(found) = payload.tone().filter(|_| config.input.tone.is_none()) {
        config.set_tone(found.tone);
    }
    let state = state.completed(config)?;
    let plan = default_plan(&state, None);
    process_item(
        py,
        &state,
        &plan,
        index,
        source::Item { name, time: source::TimeSource::Table, stamp: None, data: Some(row), payload },
    )
}

fn default_plan(state: &State, frames: Option<hzn_files::Frames>) -> Plan {
    Plan {
        config: state.config.clone(),
        flight: state.flight,
        threads: 1,
        frames,
        fps: 1.0,
        trace: false,
        keep_traces: false,
        keep_picture: false,
        overlay: None,
        masks: None,
        last: Vec::new(),
        turns: Turns::default(),
    }
}

fn process_item(py: Python<'_>, state: &Arc<State>, plan: &Plan, index: u64, item: source::Item) -> PyResult<Report> {
    let finished = errors::detached(py, || state.lend(|sensor| engine::process_one(plan, sensor, index, item)))??;
    let finished: Finished = finished.map_err(|e| errors::other(format!("{e:#}")))?;
    let rows = hzn_run::sink::rows(&finished, &plan.config);
    let report = |(row, found): (hzn_mcap::Row, &engine::BodyOutcome)| match &found.report {
        Ok(found) => Report::new(row, found, None, &state.camera).with_nadir(finished.data.as_ref()),
        Err(_) => Report::from_row(row),
    };
    let all = Report::from_bodies(py, rows.into_iter().zip(&finished.outcomes).map(report))?;
    Ok(all.with_seen(Seen::new(state, finished.answers().into_iter(), finished.data.as_ref())))
}
