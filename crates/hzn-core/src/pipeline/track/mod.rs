//! The limb of a sequence, looked for where the last answer puts it.
//!
//! The axis of the last answer, turned by what is known of the vehicle's turn, and the expected half-angle predict the
//! limb. Across it, a short search finds the border pixels of its edge at about `track.normals` places. They go through
//! every stage and every gate, as the border pixels of a followed edge do. Only a certain answer counts. Otherwise the
//! whole picture is searched, as it is without tracking.

mod arc;
mod normals;

use super::budget;
use super::look::Look;
use super::reference::{Reference, Step};
use super::search::Search;
use super::sensor::Sensor;
use super::workspace::Workspace;
use crate::base::real::Real;
use crate::geometry::camera::Camera;
use crate::geometry::frames::{Cam, UnitVec3};
use crate::geometry::pixel::Pixel;
use crate::image::Pixels;
use crate::model::body::Expected;
use crate::model::observer::{Observer, Unobserved};
use crate::model::report::Report;
use crate::model::status::Stage;
use crate::model::threshold::Brightness;
use crate::stages::contour::{BinaryPicture, Thinned};
use crate::stages::gates::Choice;
use crate::stages::{contour, threshold};
use arc::Limb;

/// The threshold of the last full search holds as long as it lies at the same place between the dark and the lit side
/// of the limb, within this part of the way: a threshold halfway then stays in the middle half.
const HELD: f64 = 0.25;

/// What a sequence of pictures of one body keeps from one picture to the next, for [`Sensor::track`].
#[derive(Debug, Clone, PartialEq)]
pub struct Tracker<T> {
    last: Option<Last<T>>,
    /// The rate in the picture before.
    rate_rad_s: Option<[T; 3]>,
    /// Number of pictures since the last full search.
    age: u16,
}

/// The last answer.
#[derive(Debug, Clone, PartialEq)]
struct Last<T> {
    reference: Reference<T>,
    threshold: Held<T>,
}

/// The threshold of the last full search.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Held<T> {
    level: u16,
    /// Contrast of the whole picture, counts.
    contrast: T,
    /// Where the level lies between the dark and the lit side of the limb.
    part: T,
}

impl<T> Default for Tracker<T> {
    fn default() -> Self {
        Self { last: None, rate_rad_s: None, age: 0 }
    }
}

impl<T: Real> Tracker<T> {
    /// Forgets the last answer, so that the next picture is searched fully: after a gap in the sequence.
    pub fn forget(&mut self) {
        *self = Self::default();
    }

    /// Goes on to the next picture. Returns the predicted axis and the threshold; `None` if the picture is to be
    /// searched fully. `reach_rad` is the angle within which the limb is found.
    fn predict(&mut self, step: &Step<T>, full_every: u16, reach_rad: T) -> Option<(UnitVec3<Cam, T>, Held<T>)> {
        let before = core::mem::replace(&mut self.rate_rad_s, step.rate_rad_s);
        self.age = self.age.saturating_add(1);
        let mut last = self.last.take().filter(|_| self.age < full_every)?;
        if let Some(after_s) = step.after_s {
            last.reference.advance(after_s, before, step.rate_rad_s);
        }
        let turned = last.reference.expected(step).filter(|(_, sigma_rad)| *sigma_rad < reach_rad);
        let axis = turned.map_or(last.reference.axis, |(axis, _)| axis);
        Some((axis, last.threshold))
    }

    /// Keeps the answer of a picture.
    fn keep(&mut self, report: &Report<T>, step: &Step<T>, threshold: Held<T>) {
        self.last = report.solution.as_ref().map(|solution| {
            let reference = Reference::new(solution.axis, solution.noise_rad(), step);
            Last { reference, threshold }
        });
    }
}

impl<T: Real> Sensor<T> {
    /// Finds the limb as [`Self::process`] does, but first where the last answer puts it, as `[track]` says. The
    /// caller keeps `tracker` for each sequence and body, and calls this for each of its pictures in order; `step` says
    /// what is known of the turn since the picture before. [`Report::is_tracked`] tells which way the answer came. A
    /// picture whose limb is not found at once has the report of [`Self::process`].
    ///
    /// ```
    /// # use hzn_core::camera::{self, Model};
    /// # use hzn_core::image::{Grey, Layout};
    /// # use hzn_core::observer::Unobserved;
    /// # use hzn_core::{Config, FlightWorkspace, Prior, Sensor, Step, Tracker};
    /// let mut config = Config::new(camera::Config::ideal(Model::Pinhole, 320, 240, 300.0));
    /// config.body.altitude_km = Some(500.0);
    /// config.track.full_every = 25;
    /// let sensor = Sensor::<f32>::new(&config)?;
    /// let mut workspace = Box::new(FlightWorkspace::new());
    /// let mut tracker = Tracker::default();
    /// # let pictures = [vec![0u8; 320 * 240], vec![0u8; 320 * 240]];
    /// for picture in &pictures {
    ///     let prior = Prior { rate_rad_s: Some([0.01, 0.0, 0.0]), ..Prior::default() };
    ///     let (expected, step) = (sensor.expect(&prior)?, Step::from_prior(&prior, Some(0.1)));
    ///     let picture = Grey::try_new(picture, Layout::packed(320, 240, 1, 8))?;
    ///     let report = sensor.track(&mut workspace, &mut tracker, &picture, (&expected, &step), &Unobserved);
    ///     assert!(report.solution.is_none() && !report.is_tracked());
    /// }
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn track<P: Pixels, O: Observer<T>, const POINTS: usize, const BLOCKS: usize, const WORDS: usize>(
        &self,
        workspace: &mut Workspace<T, POINTS, BLOCKS, WORDS>,
        tracker: &mut Tracker<T>,
        picture: &P,
        (expected, step): (&Expected<T>, &Step<T>),
        observer: &O,
    ) -> Report<T> {
        let mut report = Report::empty();
        let has_size = self.has_size_of(picture);
        let is_on = has_size && self.config.track.is_on() && self.can_track(expected);
        if !is_on {
            tracker.forget();
        }
        let mut look = Look { lists: workspace.lists(), picture, expected, taken: &[], observer, report: &mut report };
        if has_size && !(is_on && self.find_again(look.reborrow(), tracker, step)) {
            // The only call, so that an image that tracks has the code of the full search once.
            self.look_at_all(look.reborrow());
            if is_on {
                self.begin_tracking(look, tracker, step);
            }
        }
        observer.leave();
        report
    }

    /// Finds the limb where the last answer puts it. Otherwise returns false, with the report as it was.
    #[inline(never)]
    fn find_again<P: Pixels, O: Observer<T>>(
        &self,
        mut look: Look<'_, T, P, O>,
        tracker: &mut Tracker<T>,
        step: &Step<T>,
    ) -> bool {
        let (fx, fy) = self.camera.focal_px();
        let reach_rad = T::from_i32(normals::REACH_PX.into()) * T::from_f64(2.0) / (fx + fy);
        let predicted = tracker.predict(step, self.config.track.full_every, reach_rad);
        let Some((axis, threshold)) = predicted else { return false };
        let is_found = self.look_along(look.reborrow(), &axis, threshold);
        if is_found {
            // The picture itself was not looked at.
            look.report.counters.looks = 0;
            tracker.keep(look.report, step, threshold);
        } else {
            look.observer.begin_again();
            *look.report = Report::empty();
        }
        is_found
    }

    /// Keeps the answer of a full search for the pictures after it.
    #[inline(never)]
    fn begin_tracking<P: Pixels, O: Observer<T>>(
        &self,
        mut look: Look<'_, T, P, O>,
        tracker: &mut Tracker<T>,
        step: &Step<T>,
    ) {
        if let Some(threshold) = self.hold_threshold(look.reborrow()) {
            tracker.keep(look.report, step, threshold);
            tracker.age = 0;
        }
    }

    /// Returns whether the limb can be predicted, and whether an edge alone can be the answer.
    fn can_track(&self, expected: &Expected<T>) -> bool {
        let config = &self.config;
        !expected.free
            && expected.target().is_none()
            && config.contour.method == contour::Method::BorderFollowing
            && config.gates.choice == Choice::Score
            && config.input.scale_to_height.is_none()
            // The mean of the whole picture is not known without its sample.
            && config.brightness == Brightness::default()
    }

    /// Looks for the limb of a predicted axis, and takes it through every stage. Returns whether there is a certain
    /// answer.
    fn look_along<P: Pixels, O: Observer<T>>(
        &self,
        look: Look<'_, T, P, O>,
        axis: &UnitVec3<Cam, T>,
        threshold: Held<T>,
    ) -> bool {
        let Look { expected, observer, .. } = look;
        observer.enter(Stage::Contour);
        (look.report.level, look.report.stage) = (threshold.level, Stage::Contour);
        let own = self.camera_for(expected);
        let camera = own.as_ref().unwrap_or(&self.camera);
        let limb = self.limb(camera, axis, expected);
        let binary = self.binary(&look, threshold.level, threshold.contrast);
        let work = budget::new(&self.config, look.lists.border.len());
        let mut search = Search::new(self, camera, look, work);
        let (border, _) = search.take_lists();
        let mut cost = 0;
        let found = self.find_border(&limb, &binary, border, &mut cost);
        search.charge(cost);
        let Some((edge, part)) = found else { return false };
        let holds = (part - threshold.part).abs() <= T::from_f64(HELD);
        if !(holds && search.judge_tracked(&binary, &edge)) {
            return false;
        }
        search.conclude();
        true
    }

    /// Returns the threshold of a picture that was searched fully, for the pictures after it. `None` if the picture has
    /// no answer, or if its own limb could not have been tracked.
    fn hold_threshold<P: Pixels, O: Observer<T>>(&self, look: Look<'_, T, P, O>) -> Option<Held<T>> {
        let (config, expected) = (&self.config, look.expected);
        let (axis, level) = (look.report.solution.as_ref()?.axis, look.report.level);
        // The sample is read again, because no report has its contrast; its pixels are still in the cache.
        let (levels, last) = (config.threshold_of(expected.which), expected.level);
        let sample = threshold::split(
            look.picture,
            &self.region,
            &config.brightness,
            levels,
            last,
            config.consensus.seed,
            &Unobserved,
        );
        let contrast = sample.ok()?.contrast;
        let own = self.camera_for(expected);
        let limb = self.limb(own.as_ref().unwrap_or(&self.camera), &axis, expected);
        let binary = self.binary(&look, level, contrast);
        let (_, part) = self.find_border(&limb, &binary, look.lists.border, &mut 0)?;
        Some(Held { level, contrast, part })
    }

    fn limb<'a>(&'a self, camera: &'a Camera<T>, axis: &UnitVec3<Cam, T>, expected: &Expected<T>) -> Limb<'a, T> {
        Limb::new(camera, &self.region, self.config.retry.frame_px, axis.v(), [expected.cos, expected.sin])
    }

    fn binary<'a, P: Pixels, O: Observer<T>>(
        &'a self,
        look: &Look<'a, T, P, O>,
        level: u16,
        contrast: T,
    ) -> BinaryPicture<'a, T, P, O> {
        BinaryPicture::new(look.picture, &self.region, level, look.observer)
            .with_contrast(contrast)
            .with_tone(self.config.input.tone)
    }

    /// Finds the border pixels of the edge along a predicted limb, and where the threshold lies between its two sides.
    // One half of the list holds the predicted places and the other one the pixels that are found.
    fn find_border<'a, P: Pixels, O: Observer<T>>(
        &self,
        limb: &Limb<'_, T>,
        binary: &BinaryPicture<'_, T, P, O>,
        border: &'a mut [Pixel],
        cost: &mut u32,
    ) -> Option<(Thinned<'a>, T)> {
        let (places, found) = border.split_at_mut_checked(border.len() / 2)?;
        let count = limb.places(self.config.track.normals, places, cost)?;
        let mut edge = Thinned::new(found);
        let part = normals::search(binary, places.get(..count)?, &mut edge, cost)?;
        *cost += binary.cost();
        Some((edge, part))
    }
}
