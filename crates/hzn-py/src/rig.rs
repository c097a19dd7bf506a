//! `hzn.Rig`.

use std::sync::Arc;

use hzn_files::FrameData;
use hzn_files::rig::{self, Common, Head, HeadMount, JOINT};
use hzn_run::engine::{BodyOutcome, Finished};
use hzn_run::rig::{Joiner, Seen};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors;
use crate::prior::{Prior, utc};
use crate::read::Read;
use crate::report::Report;
use crate::sensor::Sensor;

#[doc = doc!("Rig")]
#[pyclass(frozen, module = "hzn")]
pub(crate) struct Rig {
    sensors: Vec<Py<Sensor>>,
    names: Vec<String>,
    joiner: Joiner,
}

#[pymethods]
impl Rig {
    #[new]
    #[pyo3(signature = (sensors, *, mounts, names = None, mount_sigma_deg = 0.0, rig_sigma_deg = 0.0,
                        limb_tilt_sigma_km = None, limb_own_sigma_km = None, false_alarm = None, misleading = None))]
    fn new(
        sensors: Vec<Py<Sensor>>,
        mounts: Vec<[f64; 4]>,
        names: Option<Vec<String>>,
        mount_sigma_deg: f64,
        rig_sigma_deg: f64,
        limb_tilt_sigma_km: Option<f64>,
        limb_own_sigma_km: Option<f64>,
        false_alarm: Option<f64>,
        misleading: Option<f64>,
    ) -> PyResult<Self> {
        let names = names.unwrap_or_else(|| (0..sensors.len()).map(|k| format!("head{k}")).collect());
        for (what, count) in [("mounts", mounts.len()), ("names", names.len())] {
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
        let head = |(name, q_rig_from_camera_wxyz): (&String, [f64; 4])| Head {
            name: name.clone(),
            sensor: None,
            pictures: name.into(),
            mount: Some(HeadMount { q_rig_from_camera_wxyz, sigma_deg: mount_sigma_deg, covariance_deg2: None }),
        };
        let file = rig::Rig { rig: common, heads: names.iter().zip(mounts).map(head).collect() };
        let states: Vec<_> = sensors.iter().map(|sensor| sensor.get().state()).collect();
        let configs = states.iter().map(|state| &state.config);
        let joiner = Joiner::new(&file, configs).map_err(errors::config)?;
        Ok(Self { sensors, names, joiner })
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
        images: &Bound<'py, PyDict>,
        altitude_km: Option<f64>,
        position_km: Option<[f64; 3]>,
        attitude: Option<[f64; 4]>,
        attitude_sigma_deg: Option<f64>,
        rate_rad_s: Option<[f64; 3]>,
        sun: Option<[f64; 3]>,
        time_s: Option<f64>,
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
        self.check_names(images)?;
        let mut frames = Vec::with_capacity(self.names.len());
        let reports = PyDict::new(py);
        let heads = self.names.iter().zip(&self.sensors).zip(self.joiner.q_vehicle_from_camera_wxyz());
        for ((name, sensor), q_vehicle_from_camera_wxyz) in heads {
            let Some(image) = images.get_item(name)?.filter(|image| !image.is_none()) else {
                frames.push(None);
                continue;
            };
            let state: Arc<_> = sensor.get().state();
            known.tell_doubts(py, &state.config)?;
            let read = Read::from_object(py, &state, &image)?;
            let data = FrameData { time_s: known.data.time_s.or(read.time_s), ..known.data.clone() };
            let data = FrameData { utc_s: utc(data.time_s), ..data }.seen_by_camera(q_vehicle_from_camera_wxyz);
            let (report, processed) = read.process(py, &state, &data, bits, false)?;
            let outcomes = processed.into_iter().map(Into::into).collect();
            let glimpse = Some(read.glimpse(&state, bits)?);
            frames.push(Some(Finished { glimpse, ..finished(read.file, data, outcomes) }));
            reports.set_item(name, Bound::new(py, report)?)?;
        }
        let seen: Vec<Seen<'_>> = frames.iter().map(|frame| Seen::new(frame.as_ref(), None)).collect();
        self.joiner.check_times(&seen).map_err(errors::config)?;
        let all = PyDict::new(py);
        all.set_item(JOINT, Bound::new(py, Report::from_row(self.joiner.join(0, &seen)))?)?;
        all.update(reports.as_mapping())?;
        Ok(all)
    }

    fn __repr__(&self) -> String {
        format!("Rig({})", self.names.join(", "))
    }
}

impl Rig {
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

/// Returns the picture of a head as the joint answer takes it.
fn finished(name: String, data: FrameData, outcomes: Vec<BodyOutcome>) -> Finished {
    Finished {
        index: 0,
        name,
        time_s: data.time_s,
        stamp: None,
        data: Some(data),
        outcomes,
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
