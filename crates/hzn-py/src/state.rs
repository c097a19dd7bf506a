//! The state of a sensor: a configuration that was accepted, and the objects made from it.

use std::sync::{Arc, Mutex, PoisonError};

use hzn_core::region::Region;
use hzn_core::{Config, Expected, Sensor as CoreSensor};
use hzn_files::FrameData;
use hzn_run::engine::AnySensor;
use pyo3::prelude::*;

use crate::camera::Camera;
use crate::errors;
use crate::image::Array;

/// A configuration that was accepted, and the objects made from it.
pub(crate) struct State {
    pub(crate) config: Config,
    pub(crate) flight: bool,
    pub(crate) camera: Arc<Camera>,
    /// Sensor in double precision, for the single stages.
    core: CoreSensor<f64>,
    /// Idle sensors. Each call takes one or makes one, so threads never wait for each other.
    idle: Mutex<Vec<AnySensor>>,
    /// Whether the pictures are those of one sequence, in order and on one thread.
    in_sequence: bool,
    /// The same with the bits and the tones of the picture files so far.
    completed: Mutex<Vec<Arc<Self>>>,
}

impl State {
    pub(crate) fn new(config: Config, flight: bool) -> PyResult<Arc<Self>> {
        Self::make(config, flight, None)
    }

    /// Makes the state for one sequence, whose limb is tracked. It must be used on one thread at a time.
    pub(crate) fn for_sequence(config: Config, flight: bool) -> PyResult<Arc<Self>> {
        let mut sensor = AnySensor::new(&config, flight).map_err(errors::config)?;
        sensor.begin_sequence();
        Self::make(config, flight, Some(sensor))
    }

    /// Returns the same with another configuration.
    pub(crate) fn with_config(&self, config: Config) -> PyResult<Arc<Self>> {
        if self.in_sequence { Self::for_sequence(config, self.flight) } else { Self::new(config, self.flight) }
    }

    /// Returns the state with the bits and the tone of a picture file, which a sensor without these keys takes from it.
    pub(crate) fn completed(self: &Arc<Self>, config: Config) -> PyResult<Arc<Self>> {
        if config == self.config {
            return Ok(Arc::clone(self));
        }
        let mut completed = self.completed.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(state) = completed.iter().find(|state| state.config == config) {
            return Ok(Arc::clone(state));
        }
        let state = self.with_config(config)?;
        completed.push(Arc::clone(&state));
        Ok(state)
    }

    fn make(config: Config, flight: bool, sequence: Option<AnySensor>) -> PyResult<Arc<Self>> {
        let core = CoreSensor::new(&config).map_err(errors::config)?;
        let camera = Arc::new(Camera::from_config(config.camera.clone())?);
        let in_sequence = sequence.is_some();
        let idle = Mutex::new(sequence.into_iter().collect());
        let completed = Mutex::default();
        Ok(Arc::new(Self { config, flight, camera, core, idle, in_sequence, completed }))
    }

    /// Lends a sensor to `work`. A sensor in which `work` panicked is dropped.
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

    /// Returns what is known of the limb of a body before a picture with these data.
    pub(crate) fn expect_body(&self, body: usize, data: &FrameData) -> PyResult<Expected<f64>> {
        self.core.expect_body(body, &data.to_prior(None)).map_err(errors::config)
    }

    /// Returns the sensor in double precision. Single stages do not exist in the precision of the flight computer.
    pub(crate) fn core(&self) -> PyResult<&CoreSensor<f64>> {
        if self.flight {
            return Err(errors::config(
                "flight: the single stages exist only in double precision; use a sensor without flight=True",
            ));
        }
        Ok(&self.core)
    }

    /// Returns the region of the pictures that is used.
    pub(crate) fn region(&self) -> &Region<f64> {
        self.core.region()
    }

    /// Returns an error if the array does not have the size of the camera's picture.
    pub(crate) fn check_size(&self, array: &Array<'_>) -> PyResult<()> {
        let camera = &self.config.camera;
        let (width, height) = array.size();
        if (width, height) == (usize::from(camera.width), usize::from(camera.height)) {
            return Ok(());
        }
        Err(errors::image(format!(
            "the picture is {width} x {height} px (shape ({height}, {width})), but the camera is {} x {}",
            camera.width, camera.height
        )))
    }
}
