//! The order of the stages: from a picture to its report.

use super::look::Look;
use super::search::Search;
use super::sensor::Sensor;
use super::workspace::{Lists, Workspace};
use crate::base::real::Real;
use crate::image::Pixels;
use crate::model::body::Expected;
use crate::model::found_limb::FoundLimb;
use crate::model::observer::Observer;
use crate::model::report::{MAX_BODIES, Report, Reports};
use crate::model::status::{Stage, Status};
use crate::model::work::WorkBudget;
use crate::stages::contour;
use crate::stages::contour::BinaryPicture;
use crate::stages::threshold;

impl<T: Real> Sensor<T> {
    /// Finds the limb, with an observer. Returns a report for every input; a picture whose size is not that of the
    /// camera is `rejected` at the first stage.
    // Inlined: the report is then made where the caller has it, and not a second time on the stack.
    #[inline(always)]
    pub fn process<P: Pixels, O: Observer<T>, const POINTS: usize, const BLOCKS: usize, const WORDS: usize>(
        &self,
        workspace: &mut Workspace<T, POINTS, BLOCKS, WORDS>,
        picture: &P,
        expected: &Expected<T>,
        observer: &O,
    ) -> Report<T> {
        let mut report = Report::empty();
        self.process_excluding(workspace.lists(), picture, expected, &[], observer, &mut report);
        report
    }

    /// Finds several bodies in one picture, at most [`MAX_BODIES`], one after the other in the order of `expected`, but
    /// Sun and Moon after all others. An edge on the limb of a body that was found is not used for another body, and
    /// Sun and Moon are never in front of a body. The reports have the order of `expected`.
    pub fn process_each<P: Pixels, O: Observer<T>, const POINTS: usize, const BLOCKS: usize, const WORDS: usize>(
        &self,
        workspace: &mut Workspace<T, POINTS, BLOCKS, WORDS>,
        picture: &P,
        expected: &[Expected<T>],
        observer: &O,
    ) -> Reports<T> {
        let mut reports: Reports<T> = expected.iter().take(MAX_BODIES).map(|_| Report::empty()).collect();
        let mut taken = heapless::Vec::<FoundLimb<T>, MAX_BODIES>::new();
        // Sun and Moon come last, so that the other bodies hide them: clouds and pieces of the limb have their size.
        // Before this rule and `gates.dark_sky`, 59 of 100 answers for the Sun on a tumbling satellite were false.
        for is_free in [false, true] {
            for (one, report) in expected.iter().zip(&mut reports).filter(|(one, _)| one.free == is_free) {
                observer.body(one.which);
                self.process_excluding(workspace.lists(), picture, one, &taken, observer, report);
                let found = report.solution.as_ref();
                let found = found.map(FoundLimb::new);
                // The list has room for the largest number of bodies.
                found.and_then(|f| taken.push(f).ok());
            }
        }
        reports
    }

    /// Fills an empty report.
    fn process_excluding<P: Pixels, O: Observer<T>>(
        &self,
        lists: Lists<'_, T>,
        picture: &P,
        expected: &Expected<T>,
        taken: &[FoundLimb<T>],
        observer: &O,
        report: &mut Report<T>,
    ) {
        if self.has_size_of(picture) {
            self.look_at_all(Look { lists, picture, expected, taken, observer, report });
        }
        observer.leave();
    }

    /// Returns whether a picture has the size of the camera. A picture of another size has another calibration, so its
    /// rays would be wrong.
    #[inline(always)]
    pub(super) fn has_size_of(&self, picture: &impl Pixels) -> bool {
        picture.width() == self.camera.width() && picture.height() == self.camera.height()
    }

    #[inline(always)]
    pub(super) fn look_at_all<P: Pixels, O: Observer<T>>(&self, look: Look<'_, T, P, O>) {
        // Without the feature there is no division, and the code for rectangles is left out of the image.
        if cfg!(feature = "horace") {
            self.look_at_parts(look);
        } else {
            self.look(look);
        }
    }

    pub(super) fn look<P: Pixels, O: Observer<T>>(&self, look: Look<'_, T, P, O>) {
        look.observer.enter(Stage::Threshold);
        let config = &self.config;
        let levels = config.threshold_of(look.expected.which);
        let (last, seed) = (look.expected.level, config.consensus.seed);
        match threshold::split(look.picture, &self.region, &config.brightness, levels, last, seed, look.observer) {
            Ok(level) => self.look_at_levels(look, &level),
            Err(Status::NoLimb) => self.look_for_small_body(look),
            Err(status) => look.report.status = status,
        }
    }

    /// Looks at a picture in whose sample nothing is bright: the body may be smaller than the cells of the sample.
    #[cold]
    fn look_for_small_body<P: Pixels, O: Observer<T>>(&self, look: Look<'_, T, P, O>) {
        let (fx, fy) = self.camera.focal_px();
        let radius_px = look.expected.half_angle_rad() * (fx + fy) * T::from_f64(0.5);
        let levels = self.config.threshold_of(look.expected.which);
        let (drawn, level) = threshold::split_small_body(look.picture, &self.region, levels, radius_px, look.observer);
        look.report.counters.sampled = threshold::SAMPLED + drawn;
        match level {
            Some(level) => self.look_at_levels(look, &level),
            None => look.report.status = Status::NoLimb,
        }
    }

    /// Runs one look: everything after the threshold. Returns the rest of the work budget.
    #[inline(always)]
    pub(super) fn search<P: Pixels, O: Observer<T>>(
        &self,
        look: Look<'_, T, P, O>,
        binary: &BinaryPicture<'_, T, P, O>,
        work: WorkBudget,
    ) -> WorkBudget {
        let config = &self.config;
        // The furthest stage is kept, because a further look begins again at an earlier one.
        look.report.stage = look.report.stage.max(Stage::Contour);
        look.observer.enter(Stage::Contour);
        let own = self.camera_for(look.expected);
        let camera = own.as_ref().unwrap_or(&self.camera);
        let mut search = Search::new(self, camera, look, work);
        let (border, marks) = search.take_lists();
        match config.contour.method {
            contour::Method::Raster if cfg!(feature = "horace") => search.raster(binary, border, marks),
            contour::Method::Erode if cfg!(feature = "horace") => {
                search.judge_all_as_one(binary, |work| contour::erode::edges(binary, &config.contour, border, work));
            }
            contour::Method::Sobel if cfg!(feature = "zju") => {
                search.judge_all_as_one(binary, |work| contour::sobel::edges(binary, border, work))
            }
            // `Config::check` refuses a method that is not built in.
            _ => search.border_following(binary, border, marks),
        }
        search.conclude()
    }
}
