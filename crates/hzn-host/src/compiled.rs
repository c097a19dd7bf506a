//! The sensors whose pipelines are compiled in this crate.

use hzn_core::image::{ImageView, Indirect, Pixels};
use hzn_core::real::Real;
use hzn_core::report::Reports;
use hzn_core::{Expected, FlightHorizon, Horizon, HostHorizon, Observer, Report, Step, Tracker};

use crate::clock::Clock;

/// What a sensor does with one picture.
#[derive(Debug)]
pub enum Task<'a, T> {
    /// Finds one limb, as [`Horizon::process`] does. The result has one report.
    One(&'a Expected<T>),
    /// Finds several bodies, as [`Horizon::process_each`] does. The result has one report for each.
    Each(&'a [Expected<T>]),
    /// Finds the limb of the picture before again, as [`Horizon::track`] does, and tells the observer that the body
    /// begins. The result has one report.
    Track(&'a mut Tracker<T>, &'a Expected<T>, &'a Step<T>),
}

/// A sensor whose pipelines are compiled in this crate: [`HostHorizon`] and [`FlightHorizon`].
///
/// The methods of [`Horizon`] are generic, so every crate that calls them compiles the whole pipeline again, for each
/// kind of picture and of observer. These methods give the same reports, to the last bit, and are compiled once.
///
/// ```
/// use hzn_core::camera::{self, Model};
/// use hzn_core::image::{Grey, Layout};
/// use hzn_core::{Config, HostHorizon, Prior};
/// use hzn_host::Compiled;
///
/// let mut config = Config::new(camera::Config::ideal(Model::Pinhole, 64, 48, 60.0));
/// config.body.altitude_km = Some(230.0);
/// let mut horizon = HostHorizon::boxed(&config)?;
/// let expected = horizon.expect(&Prior::default())?;
/// let data = [0u8; 64 * 48];
/// let report = horizon.find(&Grey::try_new(&data[..], Layout::packed(64, 48, 1, 8))?, &expected);
/// // A black picture has no limb.
/// assert!(report.solution.is_none());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
// The usual kinds of pictures have their own compiled pipelines: with the enum, every pixel costs a branch, and a
// picture takes 1.42 times as long.
pub trait Compiled {
    /// The precision: f64 or f32.
    type Scalar: Real;

    /// Processes one picture, and measures the time of each body.
    fn perform(&mut self, picture: ImageView<'_>, task: Task<'_, Self::Scalar>, clock: &Clock)
    -> Reports<Self::Scalar>;

    /// Processes one picture with an observer. Every kind of picture and of observer uses the same pipeline, so this is
    /// slower than [`Self::perform`].
    fn perform_observed(
        &mut self,
        picture: Indirect<'_>,
        task: Task<'_, Self::Scalar>,
        observer: &dyn Observer<Self::Scalar>,
    ) -> Reports<Self::Scalar>;

    /// Finds the limb, as [`Horizon::process`] does.
    fn find<'a>(
        &mut self,
        picture: impl Into<ImageView<'a>>,
        expected: &Expected<Self::Scalar>,
    ) -> Report<Self::Scalar> {
        first(self.perform(picture.into(), Task::One(expected), &Clock::default()))
    }

    /// Finds several bodies, as [`Horizon::process_each`] does.
    fn find_each<'a>(
        &mut self,
        picture: impl Into<ImageView<'a>>,
        expected: &[Expected<Self::Scalar>],
    ) -> Reports<Self::Scalar> {
        self.perform(picture.into(), Task::Each(expected), &Clock::default())
    }

    /// Finds the limb with an observer, as [`Horizon::process_observed`] does.
    fn find_observed<P: Pixels>(
        &mut self,
        picture: &P,
        expected: &Expected<Self::Scalar>,
        observer: &dyn Observer<Self::Scalar>,
    ) -> Report<Self::Scalar> {
        let read = |index| picture.read(index);
        first(self.perform_observed(Indirect::new(picture, &read), Task::One(expected), observer))
    }
}

impl Compiled for HostHorizon {
    type Scalar = f64;

    fn perform(&mut self, picture: ImageView<'_>, task: Task<'_, f64>, clock: &Clock) -> Reports<f64> {
        match &picture {
            ImageView::Grey8(picture) => perform(self, picture, task, clock),
            ImageView::Grey16(picture) => perform(self, picture, task, clock),
            ImageView::Colour8(picture) => perform(self, picture, task, clock),
            ImageView::Colour16(picture) => perform(self, picture, task, clock),
        }
    }

    fn perform_observed(
        &mut self,
        picture: Indirect<'_>,
        task: Task<'_, f64>,
        observer: &dyn Observer<f64>,
    ) -> Reports<f64> {
        perform(self, &picture, task, &observer)
    }
}

impl Compiled for FlightHorizon {
    type Scalar = f32;

    fn perform(&mut self, picture: ImageView<'_>, task: Task<'_, f32>, clock: &Clock) -> Reports<f32> {
        match &picture {
            ImageView::Grey8(picture) => perform(self, picture, task, clock),
            // Few cameras of a flight computer have the other kinds, so these share the pipeline of the observed
            // pictures.
            picture => {
                let read = |index| picture.read(index);
                self.perform_observed(Indirect::new(picture, &read), task, clock)
            }
        }
    }

    fn perform_observed(
        &mut self,
        picture: Indirect<'_>,
        task: Task<'_, f32>,
        observer: &dyn Observer<f32>,
    ) -> Reports<f32> {
        perform(self, &picture, task, &observer)
    }
}

/// Compiles one pipeline: each combination of types that this function gets is a copy.
fn perform<T: Real, P: Pixels, O: Observer<T>, const POINTS: usize, const BLOCKS: usize, const WORDS: usize>(
    horizon: &mut Horizon<T, POINTS, BLOCKS, WORDS>,
    picture: &P,
    task: Task<'_, T>,
    observer: &O,
) -> Reports<T> {
    let one = |report| [report].into_iter().collect();
    match task {
        Task::One(expected) => one(horizon.process_observed(picture, expected, observer)),
        Task::Each(expected) => horizon.process_each_observed(picture, expected, observer),
        Task::Track(tracker, expected, step) => {
            // The clock of the body begins here, as `process_each_observed` begins the clocks of several.
            observer.body(0);
            one(horizon.track_observed(tracker, picture, (expected, step), observer))
        }
    }
}

/// Returns the report of [`Task::One`].
fn first<T: Real>(reports: Reports<T>) -> Report<T> {
    reports.into_iter().next().expect("one body has one report")
}
