//! `hzn.Rig`.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use hzn_core::status::Status;
use hzn_files::FrameData;
use hzn_files::rig::{self, Common, Head, HeadMount, JOINT};
use hzn_mcap::{Row, RowMeta};
use hzn_run::engine::{BodyOutcome, Finished, Unprocessed};
use hzn_run::rig::{Joiner, Memory, Seen};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors;
use crate::numbered::number;
use crate::numbers::{Numbers, Seconds, class_of};
use crate::prior::{Prior, utc};
use crate::read::Read;
use crate::report::Report;
use crate::sensor::{Sensor, row_meta};
use crate::state::State;

/// A list with one item for each head. Heads have names in other places, so a dictionary is a likely mistake.
struct InOrder<T>(Vec<T>);

impl<'py, T: for<'a> FromPyObject<'a, 'py>> FromPyObject<'_, 'py> for InOrder<T> {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if object.is_instance_of::<PyDict>() {
            let what = "a list is expected, not dict: give one item for each head, in one order, and names=[...]";
            return Err(PyTypeError::new_err(what));
        }
        object.extract().map(Self)
    }
}

/// The pictures of an epoch by the names of their heads.
struct ByHead<'py>(Bound<'py, PyDict>);

impl<'py> FromPyObject<'_, 'py> for ByHead<'py> {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let wrong = || {
            let what = "a dict with the picture of each head is expected, for example {\"head0\": image}, not";
            PyTypeError::new_err(format!("{what} {}", class_of(&object)))
        };
        object.cast::<PyDict>().map(|dict| Self(dict.to_owned())).map_err(|_| wrong())
    }
}

#[doc = doc!("Rig")]
#[pyclass(frozen, module = "hzn")]
pub(crate) struct Rig {
    sensors: Vec<Py<Sensor>>,
    names: Vec<String>,
    file: rig::Rig,
    joiner: Arc<Joiner>,
    /// The joiners for the sensors of picture files that have bits or a tone of their own.
    completed: Mutex<Vec<(Completed, Arc<Joiner>)>>,
}

#[pymethods]
impl Rig {
    #[new]
    #[pyo3(signature = (sensors, *, mounts, names = None, limb_groups = None, mount_sigma_deg = 0.0,
                        rig_sigma_deg = 0.0, limb_tilt_sigma_km = None, limb_own_sigma_km = None, false_alarm = None,
                        misleading = None))]
    fn new(
        sensors: InOrder<Py<Sensor>>,
        mounts: InOrder<Numbers<4>>,
        names: Option<Vec<String>>,
        limb_groups: Option<Vec<Option<String>>>,
        mount_sigma_deg: f64,
        rig_sigma_deg: f64,
        limb_tilt_sigma_km: Option<f64>,
        limb_own_sigma_km: Option<f64>,
        false_alarm: Option<f64>,
        misleading: Option<f64>,
    ) -> PyResult<Self> {
        let (InOrder(sensors), InOrder(mounts)) = (sensors, mounts);
        let names = names.unwrap_or_else(|| (0..sensors.len()).map(|k| format!("head{k}")).collect());
        let limb_groups = limb_groups.unwrap_or_else(|| vec![None; sensors.len()]);
        for (what, count) in [("mounts", mounts.len()), ("names", names.len()), ("limb_groups", limb_groups.len())] {
            if count != sensors.len() {
                return Err(errors::config(format!(
                    "{what}: {count} for {} sensors; give one for each",
                    sensors.len()
                )));
            }
        }
        let default = Common::default();
        let mut common = Common {
            limb_tilt_sigma_km,
            limb_own_sigma_km: limb_own_sigma_km.unwrap_or(default.limb_own_sigma_km),
            false_alarm: false_alarm.unwrap_or(default.false_alarm),
            misleading: misleading.unwrap_or(default.misleading),
            ..default
        };
        common.mount.sigma_deg = rig_sigma_deg;
        let head =
            |((name, Numbers(q_rig_from_camera_wxyz)), limb_group): ((&String, Numbers<4>), Option<String>)| Head {
                name: name.clone(),
                sensor: None,
                pictures: name.into(),
                mount: Some(HeadMount { q_rig_from_camera_wxyz, sigma_deg: mount_sigma_deg, covariance_deg2: None }),
                limb_group,
            };
        let file = rig::Rig { rig: common, heads: names.iter().zip(mounts).zip(limb_groups).map(head).collect() };
        let states: Vec<_> = sensors.iter().map(|sensor| sensor.get().state()).collect();
        let configs = states.iter().map(|state| &state.config);
        let joiner = Joiner::new(&file, configs).map_err(errors::config)?;
        Ok(Self { sensors, names, file, joiner: Arc::new(joiner), completed: Mutex::default() })
    }

    #[doc = doc!("Rig.names")]
    #[getter]
    fn names(&self) -> Vec<String> {
        self.names.clone()
    }

    #[doc = doc!("Rig.process")]
    #[pyo3(signature = (images, *, altitude_km = None, position_km = None, attitude = None, attitude_sigma_deg = None,
                        rate_rad_s = None, sun = None, time_s = None, camera_temperature_c = None, bits = None))]
    fn process<'py>(
        &self,
        py: Python<'py>,
        images: ByHead<'py>,
        altitude_km: Option<f64>,
        position_km: Option<Numbers<3>>,
        attitude: Option<Numbers<4>>,
        attitude_sigma_deg: Option<f64>,
        rate_rad_s: Option<Numbers<3>>,
        sun: Option<Numbers<3>>,
        time_s: Option<Seconds>,
        camera_temperature_c: Option<f64>,
        bits: Option<u8>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let known = Prior::new(
            altitude_km,
            position_km,
            attitude,
            attitude_sigma_deg,
            rate_rad_s,
            None,
            None,
            None,
            sun,
            time_s,
            camera_temperature_c,
        )?;
        let epoch = self.see(py, &images.0, &known, bits, false)?;
        let seen: Vec<Seen<'_>> = epoch.frames.iter().map(|frame| Seen::new(frame.as_ref(), None)).collect();
        Self::answers(py, 0, &epoch, &seen)
    }

    #[doc = doc!("Rig.process_many")]
    #[pyo3(signature = (epochs, *, jobs = None, progress = false))]
    fn process_many<'py>(
        slf: &Bound<'py, Self>,
        epochs: &Bound<'py, PyAny>,
        jobs: Option<usize>,
        progress: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (py, rig) = (slf.py(), slf.get());
        let many = py.import("hzn._many")?.getattr("process_epochs")?;
        let states: Vec<_> = rig.sensors.iter().map(|sensor| sensor.get().state()).collect();
        if !states.iter().any(|state| state.config.track.is_on()) {
            // If a picture depends on the previous one, the epochs are processed one after another.
            let is_serial = states.iter().any(|state| state.config.tracks());
            return many.call1((slf, epochs, if is_serial { Some(1) } else { jobs }, progress));
        }
        // Sensors of its own, because single pictures that are processed meanwhile are not of the sequence.
        let own = |sensor: &Py<Sensor>| Py::new(py, sensor.get().for_sequence()?);
        let sensors = rig.sensors.iter().map(own).collect::<PyResult<_>>()?;
        let own = Self {
            sensors,
            names: rig.names.clone(),
            file: rig.file.clone(),
            joiner: Arc::clone(&rig.joiner),
            completed: Mutex::default(),
        };
        many.call1((own, epochs, Some(1), progress))
    }

    /// Processes the pictures of one epoch of a sequence, in any order and on any thread.
    #[pyo3(name = "_see")]
    fn see_epoch(&self, py: Python<'_>, images: ByHead<'_>, known: &Prior, bits: Option<u8>) -> PyResult<RigEpoch> {
        Ok(RigEpoch(Mutex::new(Some(self.see(py, &images.0, known, bits, true)?))))
    }

    /// Joins the answers of the next epoch of a sequence.
    #[pyo3(name = "_join")]
    fn join_next<'py>(
        &self,
        py: Python<'py>,
        memory: &RigMemory,
        epoch: &RigEpoch,
        index: u64,
    ) -> PyResult<Bound<'py, PyDict>> {
        let epoch = epoch.0.lock().unwrap_or_else(PoisonError::into_inner).take();
        let epoch = epoch.ok_or_else(|| errors::other("this epoch is already joined"))?;
        let mut memory = memory.0.lock().unwrap_or_else(PoisonError::into_inner);
        let repeats = memory.find_repeats(&epoch.frames, &epoch.digests);
        let seen = memory.see(&epoch.joiner, &epoch.frames, &repeats);
        Self::answers(py, index, &epoch, &seen)
    }

    fn __repr__(&self) -> String {
        format!("Rig({})", self.names.join(", "))
    }
}

/// For each head, the sensor with the bits and the tone of its picture file, if the file says more than the sensor.
type Completed = Vec<Option<Arc<State>>>;

/// The processed pictures of one epoch.
struct Pictures {
    /// In the order of the heads; `None` for a head without a picture.
    frames: Vec<Option<Finished>>,
    /// Checksums of their samples.
    digests: Vec<Option<u32>>,
    reports: Vec<(String, Report)>,
    /// Joins the answers of pictures of their tones.
    joiner: Arc<Joiner>,
}

/// An epoch of a sequence that is not joined yet.
#[pyclass(frozen, name = "_RigEpoch", module = "hzn._hzn")]
pub(crate) struct RigEpoch(Mutex<Option<Pictures>>);

/// What a sequence of epochs remembers of the epochs before.
#[pyclass(frozen, name = "_RigMemory", module = "hzn._hzn")]
pub(crate) struct RigMemory(Mutex<Memory>);

#[pymethods]
impl RigMemory {
    #[new]
    fn new(rig: &Rig) -> Self {
        Self(Mutex::new(Memory::new(rig.names.len())))
    }
}

impl Rig {
    /// Processes the pictures of an epoch. Of a `sequence`, a file that cannot be read costs only its head, and the
    /// samples get checksums.
    fn see(
        &self,
        py: Python<'_>,
        images: &Bound<'_, PyDict>,
        known: &Prior,
        bits: Option<u8>,
        is_of_sequence: bool,
    ) -> PyResult<Pictures> {
        self.check_names(images)?;
        let (mut frames, mut digests, mut reports) = (Vec::new(), Vec::new(), Vec::new());
        let mut completed = vec![None; self.names.len()];
        let heads = self.names.iter().zip(&self.sensors).zip(self.joiner.q_vehicle_from_camera_wxyz());
        for (((name, sensor), q_vehicle_from_camera_wxyz), completed) in heads.zip(&mut completed) {
            let Some(image) = images.get_item(name)?.filter(|image| !image.is_none()) else {
                frames.push(None);
                digests.push(None);
                continue;
            };
            let state: Arc<_> = sensor.get().state();
            known.tell_doubts(py, &state.config)?;
            let data = FrameData { utc_s: utc(known.data.time_s), ..known.data.clone() };
            let data = data.seen_by_camera(q_vehicle_from_camera_wxyz);
            let file = image.extract::<PathBuf>().ok().filter(|_| is_of_sequence);
            let processed = see_picture(py, &state, &image, &data, bits, is_of_sequence, completed);
            let (frame, digest, report) = match (file, processed) {
                (Some(file), Err(why)) if why.is_instance_of::<errors::ImageError>(py) => {
                    unreadable(py, &state, &file, data, &why)
                }
                (_, processed) => processed?,
            };
            frames.push(Some(frame));
            digests.push(digest);
            reports.push((name.clone(), report));
        }
        Ok(Pictures { frames, digests, reports, joiner: self.joiner_for(completed)? })
    }

    /// Returns the joiner for these sensors.
    fn joiner_for(&self, completed: Completed) -> PyResult<Arc<Joiner>> {
        if completed.iter().all(Option::is_none) {
            return Ok(Arc::clone(&self.joiner));
        }
        let mut known = self.completed.lock().unwrap_or_else(PoisonError::into_inner);
        let is_same = |(a, b): (&Option<Arc<State>>, &Option<Arc<State>>)| match (a, b) {
            (Some(a), Some(b)) => Arc::ptr_eq(a, b),
            (a, b) => a.is_none() && b.is_none(),
        };
        if let Some((_, joiner)) = known.iter().find(|(other, _)| other.iter().zip(&completed).all(is_same)) {
            return Ok(Arc::clone(joiner));
        }
        let state = |(sensor, own): (&Py<Sensor>, &Option<Arc<State>>)| own.clone().unwrap_or(sensor.get().state());
        let states: Vec<_> = self.sensors.iter().zip(&completed).map(state).collect();
        let joiner = Joiner::new(&self.file, states.iter().map(|state| &state.config)).map_err(errors::config)?;
        let joiner = Arc::new(joiner);
        known.push((completed, Arc::clone(&joiner)));
        Ok(joiner)
    }

    /// Joins the answers of the heads.
    fn answers<'py>(py: Python<'py>, index: u64, epoch: &Pictures, seen: &[Seen<'_>]) -> PyResult<Bound<'py, PyDict>> {
        epoch.joiner.check_times(seen).map_err(errors::config)?;
        let all = PyDict::new(py);
        all.set_item(JOINT, Bound::new(py, Report::from_row(epoch.joiner.join(index, seen)))?)?;
        for (name, report) in &epoch.reports {
            all.set_item(name, Bound::new(py, number(py, report, index)?)?)?;
        }
        Ok(all)
    }

    /// Refuses a picture of a head that the rig does not have.
    fn check_names(&self, images: &Bound<'_, PyDict>) -> PyResult<()> {
        for name in images.keys() {
            let name: String = name.extract()?;
            if !self.names.contains(&name) {
                let valid: Vec<&str> = self.names.iter().map(String::as_str).collect();
                let hint = hzn_files::suggestion(&name, &valid);
                return Err(errors::config(format!("images: the rig has no head {name:?}{hint}")));
            }
        }
        Ok(())
    }
}

/// A processed picture, the checksum of its samples, and its report.
type Processed = (Finished, Option<u32>, Report);

fn see_picture(
    py: Python<'_>,
    state: &Arc<State>,
    image: &Bound<'_, PyAny>,
    data: &FrameData,
    bits: Option<u8>,
    is_of_sequence: bool,
    completed: &mut Option<Arc<State>>,
) -> PyResult<Processed> {
    let read = Read::from_object(py, state, image)?;
    *completed = Some(Arc::clone(&read.state)).filter(|own| !Arc::ptr_eq(own, state));
    let time_s = data.time_s.or(read.time_s);
    let data = FrameData { time_s, utc_s: utc(time_s), ..data.clone() };
    let (report, processed) = read.process(py, &data, bits, false)?;
    let outcomes = processed.into_iter().map(Into::into).collect();
    let glimpse = Some(read.glimpse(bits)?);
    let digest = is_of_sequence.then(|| read.digest()).transpose()?;
    Ok((Finished { glimpse, ..finished(read.file, data, outcomes) }, digest, report))
}

/// Returns what remains of a picture file that could not be read.
fn unreadable(py: Python<'_>, state: &State, file: &Path, data: FrameData, why: &PyErr) -> Processed {
    let file = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let why = Unprocessed { status: Status::Unreadable, why: why.value(py).to_string(), prior: None };
    let body = state.config.each_body().first().cloned().unwrap_or_default();
    let meta = RowMeta { file: file.clone(), ..row_meta(&data, &body) };
    let report = Report::from_row(Row::unprocessed(&meta, why.status, &why.why));
    let outcomes = vec![BodyOutcome { report: Err(why), elapsed: Duration::ZERO }];
    (finished(file, data, outcomes), None, report)
}

/// Returns the picture of a head as the joint answer takes it.
fn finished(name: String, data: FrameData, outcomes: Vec<BodyOutcome>) -> Finished {
    Finished {
        index: 0,
        name,
        time_s: data.time_s,
        stamp: None,
        data: Some(data),
        outcomes,
        is_flight: false,
        drawing: Default::default(),
        picture: None,
        glimpse: None,
        traces: None,
        tip: None,
        pages: 1,
        mask: None,
        identity: None,
        bytes: None,
        brightness_by_sun: None,
    }
}
