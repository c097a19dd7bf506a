//! The sensor together with its lists: the type that most programs use.

use super::place::SensorPlace;
use super::prepared::PreparedError;
use super::reference::Step;
use super::sensor::Sensor;
use super::track::Tracker;
use super::workspace::{HOST_POINTS, HOST_WORDS, Workspace};
use crate::base::error::ConfigError;
use crate::base::real::Real;
use crate::config::Config;
use crate::image::Pixels;
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
/// It is large, so it is made in place: [`Self::empty`] in a `static` is all zeros, takes no flash and never passes
/// over the stack, and [`Self::configure`] makes it a sensor there. Until then every picture is refused. On a
/// workstation, [`Self::boxed`] does both on the heap.
///
/// # Example
///
/// A program has one for each camera and gives it one picture after another:
///
/// ```
/// use hzn_core::camera::{self, Model};
/// use hzn_core::image::{Grey, Layout};
/// use hzn_core::{Config, FlightHorizon, Prior};
/// use static_cell::ConstStaticCell;
///
/// static HORIZON: ConstStaticCell<FlightHorizon> = ConstStaticCell::new(FlightHorizon::empty());
///
/// let mut config = Config::new(camera::Config::ideal(Model::Pinhole, 64, 48, 60.0));
/// config.body.altitude_km = Some(230.0);
/// let horizon = HORIZON.try_take().ok_or("the sensor is in use")?;
/// horizon.configure(&config)?;
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
    place: SensorPlace<T>,
    workspace: Workspace<T, POINTS, BLOCKS, WORDS>,
    /// Thresholds for the next picture in counts, one for each body.
    levels: [Option<u16>; MAX_BODIES],
}

impl<T: Real, const POINTS: usize, const BLOCKS: usize, const WORDS: usize> Horizon<T, POINTS, BLOCKS, WORDS> {
    /// Makes a sensor without a configuration: all zeros. It refuses every picture until [`Self::configure`] has
    /// accepted a configuration.
    pub const fn empty() -> Self {
        Self { place: SensorPlace::empty(), workspace: Workspace::new(), levels: [None; MAX_BODIES] }
    }
    /// Makes a configured sensor in a box. Another thread makes it, because without optimisation the sensor passes over
    /// the stack: the sensor of a workstation can be larger than the free part of the caller's stack.
    ///
    /// # Errors
    /// Returns the same errors as [`Self::configure`].
    #[cfg(feature = "std")]
    pub fn boxed(config: &Config) -> Result<std::boxed::Box<Self>, ConfigError> {
        const STACK_BYTES: usize = 16 << 20;
        // The call goes through a pointer that the compiler cannot see through, so that the stack frame of `in_box`
        // does not become a part of this one.
        let make: fn(&Config) -> Result<std::boxed::Box<Self>, ConfigError> = core::hint::black_box(Self::in_box);
        std::thread::scope(|scope| {
            let builder = std::thread::Builder::new().stack_size(STACK_BYTES);
            // If no thread can be started, as in a browser, the sensor is made on this one.
            builder.spawn_scoped(scope, move || make(config)).ok().and_then(|thread| thread.join().ok())
        })
        .unwrap_or_else(|| make(config))
    }
    /// Makes a configured sensor in a box, on this thread. With optimisation it does not pass over the stack.
    #[cfg(feature = "std")]
    fn in_box(config: &Config) -> Result<std::boxed::Box<Self>, ConfigError> {
        // `Box::new` would get the value over the stack.
        let mut horizon = std::boxed::Box::<Self>::default();
        horizon.configure(config)?;
        Ok(horizon)
    }
    /// Makes this a sensor with a configuration, from the next picture on. Checks the whole configuration first: if it
    /// is refused, nothing changes, and an empty sensor stays empty.
    ///
    /// # Errors
    /// Returns the first field that is out of its limits.
    ///
    /// ```
    /// # use hzn_core::camera::{self, Model};
    /// # use hzn_core::{Config, FlightHorizon};
    /// let mut config = Config::new(camera::Config::ideal(Model::Pinhole, 64, 48, 60.0));
    /// let mut horizon = Box::new(FlightHorizon::empty());
    /// horizon.configure(&config)?;
    /// config.consensus.threshold_px = -1.0;
    /// let error = horizon.configure(&config).unwrap_err();
    /// assert_eq!(error.field, "consensus.threshold_px");
    /// let sensor = horizon.sensor().expect("it was configured");
    /// assert_eq!(sensor.config().consensus.threshold_px, 3.0);
    /// # Ok::<(), hzn_core::error::ConfigError>(())
    /// ```
    pub fn configure(&mut self, config: &Config) -> Result<(), ConfigError> {
        self.place.configure(config)?;
        // A threshold of the old configuration may belong to another body or another scale of counts.
        self.levels = [None; MAX_BODIES];
        Ok(())
    }
    /// Makes this the sensor that [`Sensor::prepare`] wrote, from the next picture on. If the bytes are refused,
    /// nothing changes.
    ///
    /// # Errors
    /// The bytes are not those of a sensor for this program, or they were changed.
    pub fn load(&mut self, bytes: &[u8]) -> Result<(), PreparedError> {
        self.place.load(bytes)?;
        self.levels = [None; MAX_BODIES];
        Ok(())
    }
    /// Returns the sensor with its configuration and camera; `None` if the place is empty.
    pub fn sensor(&self) -> Option<&Sensor<T>> {
        self.place.sensor()
    }
    /// Does the same as [`Sensor::expect`].
    ///
    /// # Errors
    /// The altitude or the position is impossible, or no configuration was accepted yet.
    pub fn expect(&self, frame: &Prior<T>) -> Result<Expected<T>, PriorError> {
        self.expect_body(0, frame)
    }
    /// Does the same as [`Sensor::expect_body`].
    ///
    /// # Errors
    /// The altitude or the position is impossible, there is no body of this number, or no configuration was accepted
    /// yet.
    pub fn expect_body(&self, which: usize, frame: &Prior<T>) -> Result<Expected<T>, PriorError> {
        self.sensor().ok_or(PriorError::NotConfigured)?.expect_body(which, frame)
    }
    /// Finds the limb. Returns a report for every input; a picture whose size is not that of the camera is `rejected`
    /// at the first stage, and so is every picture before [`Self::configure`].
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
        let Some(sensor) = self.place.sensor() else { return Report::empty() };
        let expected = remembered(&self.levels, expected);
        let report = sensor.process(&mut self.workspace, picture, &expected, observer);
        self.remember(&expected, &report);
        report
    }
    /// Does the same as [`Sensor::track`]. Before [`Self::configure`] every picture is `rejected`.
    pub fn track<P: Pixels>(
        &mut self,
        tracker: &mut Tracker<T>,
        picture: &P,
        (expected, step): (&Expected<T>, &Step<T>),
    ) -> Report<T> {
        self.track_observed(tracker, picture, (expected, step), &Unobserved)
    }
    /// Does the same as [`Self::track`], with an observer.
    pub fn track_observed<P: Pixels, O: Observer<T>>(
        &mut self,
        tracker: &mut Tracker<T>,
        picture: &P,
        (expected, step): (&Expected<T>, &Step<T>),
        observer: &O,
    ) -> Report<T> {
        let Some(sensor) = self.place.sensor() else { return Report::empty() };
        let expected = remembered(&self.levels, expected);
        let report = sensor.track(&mut self.workspace, tracker, picture, (&expected, step), observer);
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
        // The lists are cut at their capacity before they are collected, because `collect` would panic beyond it.
        let first = expected.iter().take(MAX_BODIES);
        let Some(sensor) = self.place.sensor() else { return first.map(|_| Report::empty()).collect() };
        let known: heapless::Vec<Expected<T>, MAX_BODIES> = first.map(|e| remembered(&self.levels, e)).collect();
        let reports = sensor.process_each(&mut self.workspace, picture, &known, observer);
        for (expected, report) in known.iter().zip(&reports) {
            self.remember(expected, report);
        }
        reports
    }
    fn remember(&mut self, expected: &Expected<T>, report: &Report<T>) {
        if let Some(level) = self.levels.get_mut(usize::from(expected.which)) {
            *level = report.next_level;
        }
    }
}

impl<T: Real, const POINTS: usize, const BLOCKS: usize, const WORDS: usize> Default
    for Horizon<T, POINTS, BLOCKS, WORDS>
{
    #[inline(always)]
    fn default() -> Self {
        const { Self::empty() }
    }
}

/// Adds the threshold that the last picture gave for this body, if `expected` has none.
fn remembered<T: Real>(levels: &[Option<u16>; MAX_BODIES], expected: &Expected<T>) -> Expected<T> {
    let last = levels.get(usize::from(expected.which)).copied().flatten();
    Expected { level: expected.level.or(last), ..*expected }
}

#[cfg(all(test, feature = "std"))]
mod tests {
    use super::*;
    use crate::geometry::camera;

    /// Tests the way without another thread, as in a browser, whose stack has 1 MiB: a sensor of 1.4 MB is made in its
    /// box. An overflow of the stack would end the test program.
    #[test]
    fn a_box_is_filled_in_place() {
        let config = Config::new(camera::Config::ideal(camera::Model::Pinhole, 64, 48, 60.0));
        let make = move || HostHorizon::in_box(&config).is_ok_and(|horizon| horizon.sensor().is_some());
        let made = std::thread::Builder::new().stack_size(256 << 10).spawn(make).unwrap().join();
        assert!(made.unwrap());
        assert!(size_of::<HostHorizon>() > 1 << 20);
    }
}
