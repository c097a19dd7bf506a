//! The sensor of the workstation or of the flight computer, behind one interface in f64.

use std::time::Duration;

use hzn_core::body::{self, PriorError};
use hzn_core::camera::Camera;
use hzn_core::error::ConfigError;
use hzn_core::frames::{Fixed, UnitVec3};
use hzn_core::image::{ImageView, Indirect, Pixels};
use hzn_core::real::Real;
use hzn_core::rig::Glimpse;
use hzn_core::{Config, FlightHorizon, Horizon, HostHorizon, Observer, Prior, Report, Step, Tracker};
use hzn_files::{FrameData, Frames, Problem};
use hzn_host::{Clock, Compiled, Task};
use hzn_nav::ephemeris;

use super::expected_limb::ExpectedLimb;
use super::prior::prior;
use super::trace::{Traces, Watch};
use super::widen::widen_report;

enum Kind {
    Host(Box<HostHorizon>, Tracker<f64>),
    Flight(Box<FlightHorizon>, Tracker<f32>),
}

/// What is known about the pictures before, when a picture is processed.
#[derive(Clone, Copy)]
struct Before<'a> {
    /// The last answer of each body.
    last: &'a [Option<LastAnswer>],
    /// The time of this picture, seconds.
    now_s: Option<f64>,
    /// With tracking: the time since the picture before, if it is known, seconds.
    after_s: Option<Option<f64>>,
}

/// A sensor in single or double precision.
pub struct AnySensor {
    kind: Kind,
    /// The lens in f64, for drawing.
    camera: Camera<f64>,
    bodies: Vec<body::Kind>,
    /// The last answer of each body, for `gates.max_rate_deg_s`.
    last: Vec<Option<LastAnswer>>,
    /// The time of the next picture in seconds, for `gates.max_rate_deg_s`.
    time_s: Option<f64>,
    /// With pictures of one sequence in order: what is known of it.
    sequence: Option<Sequence>,
    /// [`hzn_core::track::Config::full_every`].
    full_every: u64,
}

/// The pictures of a sequence so far.
#[derive(Debug, Clone, Copy, Default)]
struct Sequence {
    pictures: u64,
    /// The time of the last one, seconds.
    last_s: Option<f64>,
}

/// The answer to an earlier picture, for `gates.max_rate_deg_s`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LastAnswer {
    /// The limb axis, camera frame.
    pub axis: [f64; 3],
    /// Its larger standard deviation (1 sigma), in radians.
    pub sigma_rad: f64,
    /// The time of its picture in seconds, on the sequence's clock.
    pub time_s: f64,
}

impl LastAnswer {
    /// Returns the answer of a row of results, if the row has an answer and a time.
    pub fn from_row(row: &hzn_mcap::Row) -> Option<Self> {
        Some(Self {
            axis: [row.axis_x?, row.axis_y?, row.axis_z?],
            sigma_rad: row.sigma_max_deg?.to_radians(),
            time_s: row.time_s?,
        })
    }
    fn to_last<T: Real>(self, now_s: f64) -> Option<body::Last<T>> {
        let axis = UnitVec3::try_new(self.axis.map(T::from_f64))?;
        Some(body::Last { axis, sigma_rad: T::from_f64(self.sigma_rad), age_s: T::from_f64(now_s - self.time_s) })
    }
}

impl AnySensor {
    /// Makes the sensor; `flight` selects single precision and 2048 points.
    ///
    /// # Errors
    /// The first field outside its limits.
    pub fn new(config: &Config, flight: bool) -> Result<Self, ConfigError> {
        let camera = Camera::try_new(&config.camera)?;
        let kind = match flight {
            true => Kind::Flight(FlightHorizon::boxed(config)?, Tracker::default()),
            false => Kind::Host(HostHorizon::boxed(config)?, Tracker::default()),
        };
        let bodies: Vec<_> = config.each_body().iter().map(|b| b.kind).collect();
        Ok(Self {
            kind,
            camera,
            last: vec![None; bodies.len()],
            time_s: None,
            sequence: None,
            full_every: config.track.full_every.into(),
            bodies,
        })
    }

    /// Begins a sequence: the next picture is searched fully, and so is every `track.full_every`-th after it; the limb
    /// of those in between is tracked. The pictures must come in order, until [`Self::end_sequence`].
    pub fn begin_sequence(&mut self) {
        self.sequence = Some(Sequence::default());
        self.forget_limb();
    }

    /// Returns whether a sequence was begun.
    pub(super) fn is_in_sequence(&self) -> bool {
        self.sequence.is_some()
    }

    /// Ends the sequence: pictures do not depend on each other from now on.
    pub fn end_sequence(&mut self) {
        self.sequence = None;
    }

    /// Tells that a picture of the sequence is missing: the next one is searched fully.
    pub fn forget_limb(&mut self) {
        match &mut self.kind {
            Kind::Host(_, tracker) => tracker.forget(),
            Kind::Flight(_, tracker) => tracker.forget(),
        }
    }

    /// Sets the last answer of each body, from another run. Answers beyond the number of bodies are ignored.
    pub fn remember(&mut self, answers: &[Option<LastAnswer>]) {
        for (last, answer) in self.last.iter_mut().zip(answers) {
            *last = *answer;
        }
    }

    /// Sets the time of the next picture, in seconds. Without it, the time of the picture's row counts.
    pub fn set_time(&mut self, time_s: Option<f64>) {
        self.time_s = time_s;
    }

    /// Uses another configuration from the next picture on. If it is refused, nothing changes.
    ///
    /// # Errors
    /// The first field outside its limits.
    pub fn reconfigure(&mut self, config: &Config) -> Result<(), ConfigError> {
        let camera = Camera::try_new(&config.camera)?;
        match &mut self.kind {
            Kind::Host(h, _) => h.configure(config)?,
            Kind::Flight(h, _) => h.configure(config)?,
        }
        self.forget_limb();
        self.full_every = config.track.full_every.into();
        self.camera = camera;
        self.bodies = config.each_body().iter().map(|b| b.kind).collect();
        self.last = vec![None; self.bodies.len()];
        Ok(())
    }

    /// Returns the number of bodies that the sensor searches for.
    pub(super) fn bodies(&self) -> usize {
        self.bodies.len()
    }

    /// Returns the lens.
    pub fn camera(&self) -> &Camera<f64> {
        &self.camera
    }

    /// Returns the lens of one picture: with its temperature, and with the rate of rotation, so that a drawing fits
    /// each row of a rolling shutter.
    pub fn camera_of(&self, data: Option<&FrameData>) -> Camera<f64> {
        let camera = self.camera.with_rate(data.and_then(|d| d.rate_rad_s));
        camera.with_temperature(data.and_then(|d| d.camera_temperature_c))
    }

    /// Returns the expected half-angle of each body in a picture, in radians. The entry is an error if no half-angle
    /// can be expected, for example for an impossible altitude or position.
    pub fn expected_half_angles_rad(&self, data: Option<&FrameData>) -> Vec<Result<f64, PriorError>> {
        self.expected_limbs(data).into_iter().map(|limb| limb.map(|limb| limb.half_angle_rad)).collect()
    }

    /// Returns the expected limb of each body in a picture, as [`Self::expected_half_angles_rad`] does.
    pub fn expected_limbs(&self, data: Option<&FrameData>) -> Vec<Result<ExpectedLimb, PriorError>> {
        match &self.kind {
            Kind::Host(h, _) => expected_limbs(h, data),
            Kind::Flight(h, _) => expected_limbs(h, data),
        }
    }

    /// Reads the brightness at places all over a picture. `None` if it has not the size of the camera.
    pub fn glimpse(&self, view: &ImageView<'_>) -> Option<Glimpse> {
        match &self.kind {
            Kind::Host(h, _) => glimpse(h, view),
            Kind::Flight(h, _) => glimpse(h, view),
        }
    }

    /// Processes one picture and returns one result for each body, in order. For Sun and Moon the result also has the
    /// direction in ECEF, from the time and the position.
    pub fn process(
        &mut self,
        view: &ImageView<'_>,
        data: Option<&FrameData>,
        traces: Option<&Traces>,
    ) -> Vec<Processed> {
        match traces {
            Some(traces) => self.process_watched(view, data, traces),
            // A browser downloads every compiled pipeline, so all pictures share one there. The answers are equal.
            None if cfg!(target_family = "wasm") => self.process_watched(view, data, &Clock::default()),
            None => self.process_unwatched(view, data),
        }
    }

    /// Processes a picture of the caller's own type, as [`Self::process`] does.
    pub fn process_pixels<P: Pixels>(
        &mut self,
        picture: &P,
        data: Option<&FrameData>,
        traces: Option<&Traces>,
    ) -> Vec<Processed> {
        let clock = Clock::default();
        self.watch(picture, data, traces.map_or(&clock, |traces| traces))
    }

    /// Processes a picture as [`Self::process`] does, with the caller's own observer.
    pub fn process_watched(
        &mut self,
        view: &ImageView<'_>,
        data: Option<&FrameData>,
        watch: &dyn Watch,
    ) -> Vec<Processed> {
        self.watch(view, data, watch)
    }

    /// Processes a picture without a record, by the compiled pipeline of its kind.
    fn process_unwatched(&mut self, view: &ImageView<'_>, data: Option<&FrameData>) -> Vec<Processed> {
        let (now_s, after_s) = self.take_time(data);
        let before = Before { last: &self.last, now_s, after_s };
        let clock = Clock::default();
        let processed = match &mut self.kind {
            Kind::Host(h, t) => run(h, t, Shown::Plain(*view, &clock), data, before, &clock),
            Kind::Flight(h, t) => run(h, t, Shown::Plain(*view, &clock), data, before, &clock),
        };
        self.conclude(processed, data, now_s)
    }

    /// Processes a picture with picture and observer behind pointers, so that every kind of both uses the same compiled
    /// pipeline.
    fn watch<P: Pixels>(&mut self, picture: &P, data: Option<&FrameData>, watch: &dyn Watch) -> Vec<Processed> {
        let read = |index| picture.read(index);
        self.watch_indirect(Indirect::new(picture, &read), data, watch)
    }

    fn watch_indirect(&mut self, picture: Indirect<'_>, data: Option<&FrameData>, watch: &dyn Watch) -> Vec<Processed> {
        let (now_s, after_s) = self.take_time(data);
        let before = Before { last: &self.last, now_s, after_s };
        let processed = match &mut self.kind {
            Kind::Host(h, t) => run(h, t, Shown::Observed(picture, watch), data, before, watch),
            Kind::Flight(h, t) => run(h, t, Shown::Observed(picture, watch), data, before, watch),
        };
        self.conclude(processed, data, now_s)
    }

    /// Returns the time of the picture, and the one since the picture before in a sequence, see [`Before`].
    fn take_time(&mut self, data: Option<&FrameData>) -> (Option<f64>, Option<Option<f64>>) {
        let now_s = self.time_s.take().or(data.and_then(|d| d.time_s));
        let Some(sequence) = &mut self.sequence else { return (now_s, None) };
        let (pictures, last_s) = (sequence.pictures, core::mem::replace(&mut sequence.last_s, now_s));
        sequence.pictures += 1;
        // Counted here and not from the last full search, so that blocks can be processed apart from each other.
        if self.full_every > 0 && pictures.is_multiple_of(self.full_every) {
            self.forget_limb();
        }
        (now_s, Some(now_s.zip(last_s).map(|(now, last)| now - last)))
    }

    /// Remembers the answers and adds the directions in ECEF.
    fn conclude(
        &mut self,
        mut processed: Vec<Processed>,
        data: Option<&FrameData>,
        now_s: Option<f64>,
    ) -> Vec<Processed> {
        for (last, processed) in self.last.iter_mut().zip(&processed) {
            if let (Ok(Report { solution: Some(s), .. }), Some(time_s)) = (&processed.report, now_s) {
                *last = Some(LastAnswer { axis: s.axis.xyz(), sigma_rad: s.covariance.sigma_max_rad(), time_s });
            }
        }
        for (&body, processed) in self.bodies.iter().zip(&mut processed) {
            if let (Ok(Report { solution: Some(solution), .. }), Some(direction)) =
                (&mut processed.report, data.and_then(|d| direction_fixed(body, d)))
            {
                solution.axis_fixed = Some(direction);
            }
        }
        processed
    }
}

/// Returns the direction of Sun or Moon in ECEF, seen from the position at the time of the picture.
fn direction_fixed(body: body::Kind, data: &FrameData) -> Option<UnitVec3<Fixed, f64>> {
    let place = match body {
        body::Kind::Sun => ephemeris::sun(data.utc_s?),
        body::Kind::Moon => ephemeris::moon(data.utc_s?),
        _ => return None,
    };
    place.seen_from(data.position_km?.map(|km| km * 1e3).into()).direction.to_unit()
}

/// The result of one body in one picture.
#[derive(Debug)]
pub struct Processed {
    /// The report, or the reason why nothing could be expected of this body.
    pub report: Result<Report<f64>, PriorError>,
    /// Time of processing.
    pub elapsed: Duration,
}

fn expected_limbs<T: Real + Into<f64>, const POINTS: usize, const BLOCKS: usize, const WORDS: usize>(
    horizon: &Horizon<T, POINTS, BLOCKS, WORDS>,
    data: Option<&FrameData>,
) -> Vec<Result<ExpectedLimb, PriorError>> {
    let expect = |(which, body)| {
        let prior = prior(data, which, body)?;
        Ok(ExpectedLimb::from_expected(&horizon.expect_body(which, &prior)?))
    };
    bodies(horizon).iter().enumerate().map(expect).collect()
}

fn glimpse<T: Real, const POINTS: usize, const BLOCKS: usize, const WORDS: usize>(
    horizon: &Horizon<T, POINTS, BLOCKS, WORDS>,
    view: &ImageView<'_>,
) -> Option<Glimpse> {
    let region = horizon.sensor()?.region();
    let has_size = view.width() == region.width() && view.height() == region.height();
    has_size.then(|| Glimpse::take(view, region))
}

/// Returns the bodies that the sensor searches for.
fn bodies<T: Real, const POINTS: usize, const BLOCKS: usize, const WORDS: usize>(
    horizon: &Horizon<T, POINTS, BLOCKS, WORDS>,
) -> &[body::Config] {
    horizon.sensor().map_or(&[], |sensor| sensor.config().each_body())
}

/// A picture, with the observer that sees it being processed.
enum Shown<'a, T> {
    Plain(ImageView<'a>, &'a Clock),
    Observed(Indirect<'a>, &'a dyn Observer<T>),
}

fn run<T: Real + Into<f64>, const POINTS: usize, const BLOCKS: usize, const WORDS: usize>(
    horizon: &mut Horizon<T, POINTS, BLOCKS, WORDS>,
    tracker: &mut Tracker<T>,
    picture: Shown<'_, T>,
    data: Option<&FrameData>,
    before: Before<'_>,
    watch: &dyn Watch,
) -> Vec<Processed>
where
    Horizon<T, POINTS, BLOCKS, WORDS>: Compiled<Scalar = T>,
{
    let Before { last, now_s, after_s } = before;
    let mut step = None;
    let expect = |(which, last): (usize, &Option<LastAnswer>)| {
        let last = last.zip(now_s).and_then(|(last, now_s)| last.to_last(now_s));
        let body = bodies(horizon).get(which).ok_or(PriorError::NoBody)?;
        let prior = prior(data, which, body)?;
        step = after_s.map(|after_s| Step::from_prior(&prior, after_s.map(T::from_f64)));
        horizon.expect_body(which, &Prior { last, ..prior })
    };
    let expected: Vec<_> = last.iter().enumerate().map(expect).collect();
    let known: Vec<_> = expected.iter().filter_map(|e| e.as_ref().ok().copied()).collect();
    let task = match (&step, last.len(), &known[..]) {
        (Some(step), 1, [known]) => Task::Track(tracker, known, step),
        _ => {
            tracker.forget();
            Task::Each(&known)
        }
    };
    let reports = match picture {
        Shown::Plain(view, clock) => horizon.perform(view, task, clock),
        Shown::Observed(picture, observer) => horizon.perform_observed(picture, task, observer),
    };
    let times = watch.times();
    let mut done = reports.iter().zip(times);
    // There is one report for each body with an expected half-angle.
    let result = |expected: Result<_, PriorError>| match expected {
        Err(why) => Some(Processed { report: Err(why), elapsed: Duration::ZERO }),
        Ok(_) => done.next().map(|(report, elapsed)| Processed { report: Ok(widen_report(report)), elapsed }),
    };
    expected.into_iter().filter_map(result).collect()
}

/// Checks every row of frames.csv against the sensor, before the first picture is processed. A row without an altitude,
/// or with one below the limb height, is not refused: its picture gets
/// [`Status::NoAltitude`](hzn_core::status::Status::NoAltitude); so does every impossible row of a sensor that fits
/// positions. If the sensor itself is refused, nothing is checked.
///
/// # Errors
/// The row, the picture and the column with an impossible value.
pub fn check_frames(config: &Config, flight: bool, frames: Option<&Frames>) -> Result<(), Problem> {
    let Some(frames) = frames else { return Ok(()) };
    let Ok(sensor) = AnySensor::new(config, flight) else { return Ok(()) };
    for row in &frames.rows {
        if let Some(why) = find_refused(config, &sensor, row) {
            return Err(frames.problem_of_prior(row, why));
        }
    }
    Ok(())
}

/// Returns why the data of a picture are refused before anything is processed, as in [`check_frames`].
pub fn find_refused(config: &Config, sensor: &AnySensor, data: &FrameData) -> Option<PriorError> {
    if config.each_body().iter().any(|body| config.fits_position(body)) {
        return None;
    }
    let each = sensor.expected_half_angles_rad(Some(data)).into_iter();
    each.filter_map(Result::err).find(|why| !matches!(why, PriorError::NoAltitude | PriorError::BelowLimb { .. }))
}
