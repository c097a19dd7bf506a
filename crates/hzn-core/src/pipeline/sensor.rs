//! A checked configuration, and the order of the stages.

use super::found_limb::FoundLimb;
use super::search::Search;
use super::workspace::{Lists, Workspace};
use crate::base::error::ConfigError;
use crate::base::real::Real;
use crate::config::{Config, Mount};
use crate::geometry::camera::Camera;
use crate::geometry::frames::{Body, Cam, Rotation};
use crate::image::Pixels;
use crate::image::region::Region;
use crate::model::body::{Expected, Prior, PriorError};
use crate::model::observer::Observer;
use crate::model::report::MAX_BODIES;
use crate::model::report::{Report, Reports};
use crate::model::status::Stage;
use crate::model::work::WorkBudget;
#[cfg(any(feature = "horace", feature = "zju"))]
use crate::stages::contour;
use crate::stages::contour::BinaryPicture;
use crate::stages::threshold;

/// A checked configuration with everything that follows from it: lens, region, mounting. It takes some kilobytes. The
/// lists that a picture needs are in a [`Workspace`]; [`Horizon`](super::Horizon) holds both.
#[derive(Debug, Clone)]
pub struct Sensor<T> {
    pub(super) config: Config,
    pub(super) camera: Camera<T>,
    pub(super) region: Region<T>,
    pub(super) cam_to_body: Option<Rotation<Cam, Body, T>>,
}

impl<T: Real> Sensor<T> {
    /// Makes a sensor. Checks the whole configuration first.
    ///
    /// # Errors
    /// Returns the first field that is out of its limits.
    // Not inlined: the temporary values, some kilobytes, must not lie on the caller's stack.
    #[inline(never)]
    pub fn new(config: &Config) -> Result<Self, ConfigError> {
        config.check()?;
        let camera = Camera::try_new(&config.camera)?;
        let turn = |m: Mount| Rotation::assume_from_quaternion(m.q_body_from_camera_wxyz.map(T::from_f64));
        Ok(Self {
            region: Region::new(&config.mask, &camera),
            cam_to_body: config.mount.and_then(turn),
            camera,
            config: config.clone(),
        })
    }
    /// Returns the configuration.
    pub fn config(&self) -> &Config {
        &self.config
    }
    /// Returns the camera with its lens.
    pub fn camera(&self) -> &Camera<T> {
        &self.camera
    }
    /// Returns the part of the picture that counts.
    pub fn region(&self) -> &Region<T> {
        &self.region
    }
    /// Checks the prior of a picture and computes the expected cone of the body, or of the first of several bodies.
    ///
    /// # Errors
    /// The altitude or the position is impossible.
    pub fn expect(&self, frame: &Prior<T>) -> Result<Expected<T>, PriorError> {
        self.expect_body(0, frame)
    }
    /// Same as [`Self::expect`], for the body number `which` of [`Config::each_body`], from 0.
    ///
    /// # Errors
    /// The altitude or the position is impossible, or there is no body of this number.
    pub fn expect_body(&self, which: usize, frame: &Prior<T>) -> Result<Expected<T>, PriorError> {
        let body = self.config.each_body().get(which).ok_or(PriorError::NoBody)?;
        Ok(Expected { which: which as u8, ..Expected::new(body, frame)? })
    }
    /// Finds the limb, with an observer. Returns a report for every input; a picture whose size is not that of the
    /// camera is `rejected` at the first stage.
    pub fn process<P: Pixels, O: Observer<T>, const POINTS: usize, const BLOCKS: usize, const WORDS: usize>(
        &self,
        workspace: &mut Workspace<T, POINTS, BLOCKS, WORDS>,
        picture: &P,
        expected: &Expected<T>,
        observer: &O,
    ) -> Report<T> {
        self.process_excluding(workspace.lists(), picture, expected, &[], observer)
    }
    /// Finds several bodies in one picture, at most [`MAX_BODIES`], one after the other in the order of `expected`. An
    /// edge on the limb of a body that was found is not used for another body.
    pub fn process_each<P: Pixels, O: Observer<T>, const POINTS: usize, const BLOCKS: usize, const WORDS: usize>(
        &self,
        workspace: &mut Workspace<T, POINTS, BLOCKS, WORDS>,
        picture: &P,
        expected: &[Expected<T>],
        observer: &O,
    ) -> Reports<T> {
        let mut reports = Reports::new();
        let mut taken = heapless::Vec::<FoundLimb<T>, MAX_BODIES>::new();
        for one in expected {
            observer.body(one.which);
            let report = self.process_excluding(workspace.lists(), picture, one, &taken, observer);
            let found = report.solution.as_ref();
            let found = found.map(|s| FoundLimb { e: *s.axis.v(), c: s.fused_half_angle_rad.sin_cos().1 });
            // Both lists have room for the largest number of bodies.
            if reports.push(report).is_err() || found.is_some_and(|f| taken.push(f).is_err()) {
                break;
            }
        }
        reports
    }

    fn process_excluding<P: Pixels, O: Observer<T>>(
        &self,
        lists: Lists<'_, T>,
        picture: &P,
        expected: &Expected<T>,
        taken: &[FoundLimb<T>],
        observer: &O,
    ) -> Report<T> {
        let mut report = Report::empty();
        if picture.width() == self.camera.width() && picture.height() == self.camera.height() {
            #[cfg(feature = "horace")]
            self.look_at_parts(lists, picture, expected, taken, observer, &mut report);
            #[cfg(not(feature = "horace"))]
            self.look(lists, picture, expected, taken, observer, &mut report);
        }
        observer.leave();
        report
    }

    /// Returns the camera as it turns while a picture is read out row by row; `None` if the rate is unknown or there is
    /// no rolling shutter.
    pub(super) fn turning(&self, expected: &Expected<T>) -> Option<Camera<T>> {
        let rate = expected.rate_rad_s.filter(|_| self.camera.has_rolling_shutter())?;
        Some(self.camera.turning(Some(rate)))
    }

    pub(super) fn look<P: Pixels, O: Observer<T>>(
        &self,
        lists: Lists<'_, T>,
        picture: &P,
        expected: &Expected<T>,
        taken: &[FoundLimb<T>],
        observer: &O,
        report: &mut Report<T>,
    ) {
        observer.enter(Stage::Binarize);
        let config = &self.config;
        let levels = config.threshold_of(expected.which);
        let level = match threshold::split(
            picture,
            &self.region,
            &config.gate,
            levels,
            expected.level,
            config.reject.seed,
            observer,
        ) {
            Ok(level) => level,
            Err(status) => {
                report.status = status;
                return;
            }
        };
        self.look_at_levels(lists, picture, &level, expected, taken, observer, report);
    }

    /// Runs one look: everything after the threshold. Returns the rest of the work budget.
    #[inline(always)]
    pub(super) fn search<P: Pixels, O: Observer<T>>(
        &self,
        lists: Lists<'_, T>,
        binary: &BinaryPicture<'_, T, P, O>,
        work: WorkBudget,
        expected: &Expected<T>,
        taken: &[FoundLimb<T>],
        report: &mut Report<T>,
    ) -> WorkBudget {
        let config = &self.config;
        report.stage = report.stage.max(Stage::Contour);
        binary.observer.enter(Stage::Contour);
        let turning = self.turning(expected);
        let camera = turning.as_ref().unwrap_or(&self.camera);
        let mut search = Search::new(self, camera, expected, taken, binary.observer, lists.blocks, work, report);
        match config.contour.method {
            #[cfg(feature = "horace")]
            contour::Method::Raster => search.raster(binary, lists.border, lists.marks),
            #[cfg(feature = "horace")]
            contour::Method::Erode => {
                search.judge_all_as_one(binary, |work| {
                    contour::erode::edges(binary, &config.contour, lists.border, work)
                });
            }
            #[cfg(feature = "zju")]
            contour::Method::Sobel => {
                search.judge_all_as_one(binary, |work| contour::sobel::edges(binary, lists.border, work))
            }
            // `Config::check` refuses a method that is not built in.
            _ => search.border_following(binary, lists.border, lists.marks),
        }
        search.conclude()
    }
}
