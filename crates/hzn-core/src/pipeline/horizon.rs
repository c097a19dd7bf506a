//! The sensor with its lists: what most programs hold.

use super::sensor::Sensor;
use super::workspace::{HOST_POINTS, HOST_WORDS, Workspace};
use crate::base::error::ConfigError;
use crate::base::real::Real;
use crate::config::Config;
use crate::geometry::camera::Camera;
use crate::image::Pixels;
use crate::image::region::Region;
use crate::model::body::{Expected, Prior, PriorError};
use crate::model::observer::{Observer, Unobserved};
use crate::model::report::MAX_BODIES;
use crate::model::report::{Report, Reports};

/// The sensor of a workstation: f64, 16384 points.
pub type HostHorizon = Horizon<f64, HOST_POINTS, 2048, HOST_WORDS>;
/// The sensor of a flight computer: f32, 2048 points.
pub type FlightHorizon = Horizon<f32, 2048, 256, 512>;

/// A horizon sensor: a [`Sensor`] with its [`Workspace`].
///
/// It is large: keep it in a `Box`. A flight computer keeps the two parts apart, the workspace in a `static`.
#[derive(Debug, Clone)]
pub struct Horizon<T, const POINTS: usize, const BLOCKS: usize, const WORDS: usize> {
    sensor: Sensor<T>,
    workspace: Workspace<T, POINTS, BLOCKS, WORDS>,
    /// Levels that the last picture asks for, by body.
    levels: [Option<u16>; MAX_BODIES],
}

impl<T: Real, const POINTS: usize, const BLOCKS: usize, const WORDS: usize> Horizon<T, POINTS, BLOCKS, WORDS> {
    /// Checks everything that can be refused.
    ///
    /// # Errors
    /// The first field out of its limits.
    pub fn new(config: &Config) -> Result<Self, ConfigError> {
        Ok(Self { sensor: Sensor::new(config)?, workspace: Workspace::new(), levels: [None; MAX_BODIES] })
    }
    /// As [`Self::new`], in a box, without the sensor ever standing on the caller's stack: the host's is larger than
    /// what a thread has left at times.
    ///
    /// # Errors
    /// As [`Self::new`].
    #[cfg(feature = "std")]
    pub fn boxed(config: &Config) -> Result<std::boxed::Box<Self>, ConfigError> {
        const STACK_BYTES: usize = 16 << 20;
        // Called through a pointer that the compiler cannot see through, so that its frame does not become this one's.
        let build: fn(&Config) -> Result<std::boxed::Box<Self>, ConfigError> =
            core::hint::black_box(|config: &Config| Self::new(config).map(std::boxed::Box::new));
        std::thread::scope(|scope| {
            let builder = std::thread::Builder::new().stack_size(STACK_BYTES);
            // Without another thread, on this one.
            builder.spawn_scoped(scope, move || build(config)).ok().and_then(|thread| thread.join().ok())
        })
        .unwrap_or_else(|| build(config))
    }
    /// Takes another configuration, from the next picture on. Refused, everything stays as it was.
    ///
    /// # Errors
    /// The first field out of its limits.
    pub fn reconfigure(&mut self, config: &Config) -> Result<(), ConfigError> {
        self.sensor = Sensor::new(config)?;
        self.levels = [None; MAX_BODIES];
        Ok(())
    }
    /// The configuration.
    pub fn config(&self) -> &Config {
        self.sensor.config()
    }
    /// The lens.
    pub fn camera(&self) -> &Camera<T> {
        self.sensor.camera()
    }
    /// The part of the picture that counts.
    pub fn region(&self) -> &Region<T> {
        self.sensor.region()
    }
    /// As [`Sensor::expect`].
    ///
    /// # Errors
    /// An altitude or a position that cannot be.
    pub fn expect(&self, frame: &Prior<T>) -> Result<Expected<T>, PriorError> {
        self.sensor.expect(frame)
    }
    /// As [`Sensor::expect_body`].
    ///
    /// # Errors
    /// An altitude or a position that cannot be; a number beyond the last.
    pub fn expect_body(&self, which: usize, frame: &Prior<T>) -> Result<Expected<T>, PriorError> {
        self.sensor.expect_body(which, frame)
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
        let expected = self.remembered(expected);
        let report = self.sensor.process(&mut self.workspace, picture, &expected, observer);
        self.remember(&expected, &report);
        report
    }
    /// As [`Sensor::process_each`].
    pub fn process_each<P: Pixels>(&mut self, picture: &P, expected: &[Expected<T>]) -> Reports<T> {
        self.process_each_observed(picture, expected, &Unobserved)
    }
    /// As [`Self::process_each`], watched.
    pub fn process_each_observed<P: Pixels, O: Observer<T>>(
        &mut self,
        picture: &P,
        expected: &[Expected<T>],
        observer: &O,
    ) -> Reports<T> {
        let known: heapless::Vec<Expected<T>, MAX_BODIES> =
            expected.iter().take(MAX_BODIES).map(|e| self.remembered(e)).collect();
        let reports = self.sensor.process_each(&mut self.workspace, picture, &known, observer);
        for (expected, report) in known.iter().zip(&reports) {
            self.remember(expected, report);
        }
        reports
    }
    /// With the level that the last picture asks for, where none is given.
    fn remembered(&self, expected: &Expected<T>) -> Expected<T> {
        let last = self.levels.get(usize::from(expected.which)).copied().flatten();
        Expected { level: expected.level.or(last), ..*expected }
    }
    fn remember(&mut self, expected: &Expected<T>, report: &Report<T>) {
        if let Some(level) = self.levels.get_mut(usize::from(expected.which)) {
            *level = report.next_level;
        }
    }
}
