//! The sensor together with its lists: the type that most programs use.

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

/// The sensor of a workstation: f64, at most 16384 border pixels of an edge.
// The workstation computes in f64, because elliptic cones on short arcs need it.
pub type HostHorizon = Horizon<f64, HOST_POINTS, 2048, HOST_WORDS>;
/// The sensor of a flight computer: f32, at most 2048 border pixels of an edge.
// f32 is enough here, because Gauss-Newton on the sphere loses at most 4e-6 degrees by it.
pub type FlightHorizon = Horizon<f32, 2048, 256, 512>;

/// A horizon sensor: a [`Sensor`] with its [`Workspace`].
///
/// It is large: keep it in a `Box`. A flight computer keeps the two parts apart, the workspace in a `static`, as the
/// example of the crate does.
///
/// # Example
///
/// A program makes one for each camera and gives it one picture after another:
///
/// ```
/// use hzn_core::camera::{self, Model};
/// use hzn_core::image::{Grey, Layout};
/// use hzn_core::{Config, FlightHorizon, Prior};
///
/// let mut config = Config::new(camera::Config::ideal(Model::Pinhole, 64, 48, 60.0));
/// config.body.altitude_km = Some(230.0);
/// let mut horizon = FlightHorizon::new(&config)?;
///
/// // The altitude of this picture, in metres, replaces that of the configuration.
/// let expected = horizon.expect(&Prior { altitude_m: Some(231.5e3), ..Prior::default() })?;
/// let data = [0u8; 64 * 48];
/// let picture = Grey::try_new(&data, Layout::packed(64, 48, 1, 8))?;
/// let report = horizon.process(&picture, &expected);
/// // A black picture has no limb, and the report says so.
/// assert!(report.solution.is_none());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Horizon<T, const POINTS: usize, const BLOCKS: usize, const WORDS: usize> {
    sensor: Sensor<T>,
    workspace: Workspace<T, POINTS, BLOCKS, WORDS>,
    /// Thresholds for the next picture in counts, one for each body.
    levels: [Option<u16>; MAX_BODIES],
}

impl<T: Real, const POINTS: usize, const BLOCKS: usize, const WORDS: usize> Horizon<T, POINTS, BLOCKS, WORDS> {
    /// Makes a sensor. Checks the whole configuration first.
    ///
    /// The sensor passes over the caller's stack, also on its way into a `static`: a [`FlightHorizon`] needs more than
    /// 92 KB there.
    ///
    /// # Errors
    /// Returns the first field that is out of its limits.
    pub fn new(config: &Config) -> Result<Self, ConfigError> {
        Ok(Self { sensor: Sensor::new(config)?, workspace: Workspace::new(), levels: [None; MAX_BODIES] })
    }
    /// Does the same as [`Self::new`], in a box. Another thread builds the sensor, so that the sensor does not pass
    /// over the caller's stack: the sensor of a workstation can be larger than the free part of a thread's stack.
    ///
    /// # Errors
    /// Returns the same errors as [`Self::new`].
    #[cfg(feature = "std")]
    pub fn boxed(config: &Config) -> Result<std::boxed::Box<Self>, ConfigError> {
        const STACK_BYTES: usize = 16 << 20;
        // The call goes through a pointer that the compiler cannot see through, so that the stack frame of `new` does
        // not become a part of this one.
        let build: fn(&Config) -> Result<std::boxed::Box<Self>, ConfigError> =
            core::hint::black_box(|config: &Config| Self::new(config).map(std::boxed::Box::new));
        std::thread::scope(|scope| {
            let builder = std::thread::Builder::new().stack_size(STACK_BYTES);
            // If no thread can be started, the sensor is built on this one.
            builder.spawn_scoped(scope, move || build(config)).ok().and_then(|thread| thread.join().ok())
        })
        .unwrap_or_else(|| build(config))
    }
    /// Replaces the configuration, from the next picture on. If it is refused, nothing changes.
    ///
    /// # Errors
    /// Returns the first field that is out of its limits.
    ///
    /// ```
    /// # use hzn_core::camera::{self, Model};
    /// # use hzn_core::{Config, FlightHorizon};
    /// let mut config = Config::new(camera::Config::ideal(Model::Pinhole, 64, 48, 60.0));
    /// let mut horizon = FlightHorizon::new(&config)?;
    /// config.consensus.threshold_px = -1.0;
    /// let error = horizon.reconfigure(&config).unwrap_err();
    /// assert_eq!(error.field, "consensus.threshold_px");
    /// assert_eq!(horizon.config().consensus.threshold_px, 3.0);
    /// # Ok::<(), hzn_core::error::ConfigError>(())
    /// ```
    pub fn reconfigure(&mut self, config: &Config) -> Result<(), ConfigError> {
        self.sensor = Sensor::new(config)?;
        // A threshold of the old configuration may belong to another body or another scale of counts.
        self.levels = [None; MAX_BODIES];
        Ok(())
    }
    /// Returns the configuration.
    pub fn config(&self) -> &Config {
        self.sensor.config()
    }
    /// Returns the camera with its lens.
    pub fn camera(&self) -> &Camera<T> {
        self.sensor.camera()
    }
    /// Returns the part of the picture that counts.
    pub fn region(&self) -> &Region<T> {
        self.sensor.region()
    }
    /// Does the same as [`Sensor::expect`].
    ///
    /// # Errors
    /// The altitude or the position is impossible.
    pub fn expect(&self, frame: &Prior<T>) -> Result<Expected<T>, PriorError> {
        self.sensor.expect(frame)
    }
    /// Does the same as [`Sensor::expect_body`].
    ///
    /// # Errors
    /// The altitude or the position is impossible, or there is no body of this number.
    pub fn expect_body(&self, which: usize, frame: &Prior<T>) -> Result<Expected<T>, PriorError> {
        self.sensor.expect_body(which, frame)
    }
    /// Finds the limb. Returns a report for every input; a picture whose size is not that of the camera is `rejected`
    /// at the first stage.
    pub fn process<P: Pixels>(&mut self, picture: &P, expected: &Expected<T>) -> Report<T> {
        self.process_observed(picture, expected, &Unobserved)
    }
    /// Does the same as [`Self::process`], with an observer.
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
    /// Does the same as [`Sensor::process_each`].
    pub fn process_each<P: Pixels>(&mut self, picture: &P, expected: &[Expected<T>]) -> Reports<T> {
        self.process_each_observed(picture, expected, &Unobserved)
    }
    /// Does the same as [`Self::process_each`], with an observer.
    pub fn process_each_observed<P: Pixels, O: Observer<T>>(
        &mut self,
        picture: &P,
        expected: &[Expected<T>],
        observer: &O,
    ) -> Reports<T> {
        // The list is cut at its capacity before it is collected, because `collect` would panic beyond it.
        let known: heapless::Vec<Expected<T>, MAX_BODIES> =
            expected.iter().take(MAX_BODIES).map(|e| self.remembered(e)).collect();
        let reports = self.sensor.process_each(&mut self.workspace, picture, &known, observer);
        for (expected, report) in known.iter().zip(&reports) {
            self.remember(expected, report);
        }
        reports
    }
    /// Adds the threshold that the last picture gave for this body, if `expected` has none.
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
