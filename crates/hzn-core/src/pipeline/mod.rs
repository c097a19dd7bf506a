//! The whole: stages in order, nothing runs back.
//!
//! One candidate after another goes from its border to a verdict. Edges are looked at in the order in which they are
//! likely to be the limb: those beside the longest dark stretches of the border first, then every other edge that
//! begins at the border, then the closed ones. The picture is done as soon as an edge passes every gate and is beyond
//! doubt; otherwise the best of all that begin at the border is taken, and closed ones are looked at when none is.

mod config;
#[cfg(any(test, feature = "_edges"))]
pub mod edges;
mod observer;
mod optional;
#[cfg(feature = "horace")]
mod parts;
mod preset;
mod report;

#[cfg(test)]
mod golden;

pub use config::{Config, Input, MAX_BODIES, Mount};
pub use observer::{Observer, Unobserved};
pub use optional::{OPTIONAL, Optional, lacking};
pub use preset::Preset;
pub use report::{Candidate, Counters, MAX_LISTED, Report, Solution, Verdict};

use crate::block::{Block, LANES};
use crate::body::{Expected, Frame, FrameError};
use crate::camera::Camera;
use crate::contour::{End, Marks, Scene, Thinned};
use crate::error::ConfigError;
use crate::frames::{Body, Cam, Cov3, Rotation, UnitVec3};
use crate::image::Pixels;
use crate::linalg::{V3, basis};
use crate::pixel::Pixel;
use crate::real::Real;
use crate::region::Region;
use crate::status::{Stage, Status};
use crate::{binarize, candidates, contour, covariance, estimate, reject, select, undistort};

/// The lists of a workstation.
pub type HostWorkspace = Workspace<f64, 16384, 2048, 65536>;
/// The lists of a flight computer.
pub type FlightWorkspace = Workspace<f32, 2048, 256, 512>;
/// The sensor of a workstation: f64, 16384 points.
pub type HostHorizon = Horizon<f64, 16384, 2048, 65536>;
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
    /// As [`Self::new`], in a box, without the sensor ever standing on the caller's stack: the host's is larger than what
    /// a thread has left at times.
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
    pub fn expect(&self, frame: &Frame<T>) -> Result<Expected<T>, FrameError> {
        self.sensor.expect(frame)
    }
    /// As [`Sensor::expect_body`].
    ///
    /// # Errors
    /// An altitude or a position that cannot be; a number beyond the last.
    pub fn expect_body(&self, which: usize, frame: &Frame<T>) -> Result<Expected<T>, FrameError> {
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

/// Every list that a picture needs; nothing of it outlives the picture. There is no heap.
///
/// `POINTS` border pixels of an edge are stored (beyond, the stride doubles), `BLOCKS` blocks of eight edge points are
/// fitted, and search lines are marked in `WORDS` words of 32 bits, in which the contour method `raster` marks every
/// pixel. See [`HostWorkspace`] and [`FlightWorkspace`].
///
/// It is large. A new one is all zeros: in a `static` it takes no room in flash, and is made without passing over the
/// stack.
#[derive(Debug, Clone)]
pub struct Workspace<T, const POINTS: usize, const BLOCKS: usize, const WORDS: usize> {
    border: [Pixel; POINTS],
    blocks: [Block<T>; BLOCKS],
    marks: [u32; WORDS],
}

/// The lists of a workspace without their lengths, so that stages are compiled once.
struct Lists<'a, T> {
    border: &'a mut [Pixel],
    blocks: &'a mut [Block<T>],
    marks: &'a mut [u32],
}

impl<T: Real, const POINTS: usize, const BLOCKS: usize, const WORDS: usize> Workspace<T, POINTS, BLOCKS, WORDS> {
    /// Empty lists.
    pub const fn new() -> Self {
        Self { border: [Pixel { x: 0, y: 0 }; POINTS], blocks: [Block::EMPTY; BLOCKS], marks: [0; WORDS] }
    }
    fn lists(&mut self) -> Lists<'_, T> {
        Lists { border: &mut self.border, blocks: &mut self.blocks, marks: &mut self.marks }
    }
}

#[cfg(feature = "horace")]
impl<T> Lists<'_, T> {
    /// The same, for one look of several.
    fn again(&mut self) -> Lists<'_, T> {
        Lists { border: self.border, blocks: self.blocks, marks: self.marks }
    }
}

impl<T: Real, const POINTS: usize, const BLOCKS: usize, const WORDS: usize> Default
    for Workspace<T, POINTS, BLOCKS, WORDS>
{
    fn default() -> Self {
        Self::new()
    }
}

/// A configuration that was accepted, with all that follows from it: lens, region, mounting. Some kilobytes; the lists
/// that a picture needs are in a [`Workspace`]. [`Horizon`] is both together.
#[derive(Debug, Clone)]
pub struct Sensor<T> {
    config: Config,
    camera: Camera<T>,
    region: Region<T>,
    cam_to_body: Option<Rotation<Cam, Body, T>>,
}

impl<T: Real> Sensor<T> {
    /// Checks everything that can be refused.
    ///
    /// # Errors
    /// The first field out of its limits.
    // Its workings, some kilobytes, are not to lie on the caller's stack.
    #[inline(never)]
    pub fn new(config: &Config) -> Result<Self, ConfigError> {
        config.check()?;
        let camera = Camera::try_new(&config.camera)?;
        let turn = |m: Mount| Rotation::assume_from_quaternion(m.q_body_from_camera_wxyz.map(T::of));
        Ok(Self {
            region: Region::new(&config.mask, &camera),
            cam_to_body: config.mount.and_then(turn),
            camera,
            config: config.clone(),
        })
    }
    /// The configuration.
    pub fn config(&self) -> &Config {
        &self.config
    }
    /// The lens.
    pub fn camera(&self) -> &Camera<T> {
        &self.camera
    }
    /// The part of the picture that counts.
    pub fn region(&self) -> &Region<T> {
        &self.region
    }
    /// Checks what is known about a picture and works out the cone to expect: of the body, or of the first of several.
    ///
    /// # Errors
    /// An altitude or a position that cannot be.
    pub fn expect(&self, frame: &Frame<T>) -> Result<Expected<T>, FrameError> {
        self.expect_body(0, frame)
    }
    /// As [`Self::expect`], of the body number `which` of [`Config::each_body`], from 0.
    ///
    /// # Errors
    /// An altitude or a position that cannot be; a number beyond the last.
    pub fn expect_body(&self, which: usize, frame: &Frame<T>) -> Result<Expected<T>, FrameError> {
        let body = self.config.each_body().get(which).ok_or(FrameError::NoBody)?;
        Ok(Expected { which: which as u8, ..Expected::new(body, frame)? })
    }
    /// Finds the limb, watched. Total: any picture gives a report. One of another size than the camera's is `rejected`
    /// at the first stage.
    pub fn process<P: Pixels, O: Observer<T>, const POINTS: usize, const BLOCKS: usize, const WORDS: usize>(
        &self,
        workspace: &mut Workspace<T, POINTS, BLOCKS, WORDS>,
        picture: &P,
        expected: &Expected<T>,
        observer: &O,
    ) -> Report<T> {
        self.process_beside(workspace.lists(), picture, expected, &[], observer)
    }
    /// Finds several bodies in one picture, one after the other in the order of `expected`; at most [`MAX_BODIES`].
    /// An edge on the limb of one that was found is not taken for another's.
    pub fn process_each<P: Pixels, O: Observer<T>, const POINTS: usize, const BLOCKS: usize, const WORDS: usize>(
        &self,
        workspace: &mut Workspace<T, POINTS, BLOCKS, WORDS>,
        picture: &P,
        expected: &[Expected<T>],
        observer: &O,
    ) -> Reports<T> {
        let mut reports = Reports::new();
        let mut taken = heapless::Vec::<Taken<T>, MAX_BODIES>::new();
        for one in expected {
            observer.body(one.which);
            let report = self.process_beside(workspace.lists(), picture, one, &taken, observer);
            let found = report.solution.as_ref();
            let found = found.map(|s| Taken { e: *s.axis.v(), c: s.fused_half_angle_rad.sin_cos().1 });
            // There is room for as many as there can be bodies.
            if reports.push(report).is_err() || found.is_some_and(|f| taken.push(f).is_err()) {
                break;
            }
        }
        reports
    }

    fn process_beside<P: Pixels, O: Observer<T>>(
        &self,
        lists: Lists<'_, T>,
        picture: &P,
        expected: &Expected<T>,
        taken: &[Taken<T>],
        observer: &O,
    ) -> Report<T> {
        let mut report = Report {
            status: Status::Rejected,
            stage: Stage::Binarize,
            level: 0,
            next_level: None,
            counters: Counters::default(),
            candidates: heapless::Vec::new(),
            solution: None,
        };
        if picture.width() == self.camera.width() && picture.height() == self.camera.height() {
            #[cfg(feature = "horace")]
            self.look_at_parts(lists, picture, expected, taken, observer, &mut report);
            #[cfg(not(feature = "horace"))]
            self.look(lists, picture, expected, taken, observer, &mut report);
        }
        observer.leave();
        report
    }

    fn look<P: Pixels, O: Observer<T>>(
        &self,
        lists: Lists<'_, T>,
        picture: &P,
        expected: &Expected<T>,
        taken: &[Taken<T>],
        observer: &O,
        report: &mut Report<T>,
    ) {
        observer.enter(Stage::Binarize);
        let config = &self.config;
        let body = config.each_body().get(usize::from(expected.which));
        let levels = body.and_then(|b| b.binarize.as_ref()).unwrap_or(&config.binarize);
        let noise = body.and_then(|b| b.covariance.as_ref()).unwrap_or(&config.covariance);
        let level = match binarize::split(
            picture,
            &self.region,
            &config.gate,
            levels,
            expected.level,
            config.reject.seed,
            observer,
        ) {
            Ok(level) => level.level,
            Err(status) => {
                report.status = status;
                return;
            }
        };
        report.level = level;
        report.stage = Stage::Contour;
        observer.enter(Stage::Contour);
        let scene = Scene::new(picture, &self.region, level, observer);
        let mut judge = Judge {
            config,
            camera: &self.camera,
            cam_to_body: self.cam_to_body.as_ref(),
            expected,
            taken,
            noise,
            tracks: levels.method == binarize::Method::Track,
            min_points: config.candidates.min_points.min(select::small(expected.sin, &self.camera, 2)),
            observer,
            blocks: lists.blocks,
            steps: config.contour.max_steps,
            best: None,
            rival: None,
            short: 0,
            report,
        };
        match config.contour.method {
            contour::Method::BorderFollowing => judge.border_following(&scene, lists.border, lists.marks),
            #[cfg(feature = "horace")]
            contour::Method::Raster => judge.raster(&scene, lists.border, lists.marks),
            #[cfg(feature = "horace")]
            contour::Method::Erode => {
                let edge = contour::erode::edges(&scene, &config.contour, lists.border);
                judge.piece(&scene, &edge);
            }
            #[cfg(feature = "zju")]
            contour::Method::Sobel => {
                let edge = contour::sobel::edges(&scene, lists.border);
                judge.piece(&scene, &edge);
            }
        }
        judge.conclude();
    }
}

/// Words that search lines are marked in, at most: more of them find nothing new.
const LINE_WORDS: usize = 16384;

/// The shorter side of the border is looked at in about this many places: a limb's dark and lit stretches are longer
/// than what lies between, and each look at a column is a page of memory.
const BORDER_LOOKS: u16 = 128;

/// Rows between search lines, and the most where memory is short: the least extent of the body's disc; a quarter of it
/// where there are crescents, which are to be crossed too.
///
/// A disc of half-angle α spans at least 2 α f min(r', r/sin θ) rows; the lens's own minimum is taken for half of f,
/// which every lens in use exceeds.
fn line_spacing<T: Real>(expected: &Expected<T>, camera: &Camera<T>) -> (u16, u16) {
    let (_, fy) = camera.focal_px();
    let disc = expected.half_angle_rad() * fy;
    let narrow = if expected.phases { disc * T::of(0.25) } else { disc };
    (narrow.to_i32().clamp(1, 64) as u16, disc.to_i32().clamp(1, 256) as u16)
}

/// Reports of several bodies, in the order in which they were looked for.
pub type Reports<T> = heapless::Vec<Report<T>, MAX_BODIES>;

/// The limb of a body that was found in the same picture before.
struct Taken<T> {
    e: V3<T>,
    c: T,
}

/// Points within this many thresholds of another body's limb are on it: a limb's other levels lie beside it.
const TAKEN_THRESHOLDS: f64 = 3.0;

impl<T: Real> Taken<T> {
    /// Takes out the points on this limb, and counts them.
    fn withdraw(&self, blocks: &mut [Block<T>], threshold_px: T) -> u32 {
        let limit = threshold_px * T::of(TAKEN_THRESHOLDS);
        let mut count = 0;
        for block in blocks {
            for lane in 0..LANES {
                let [gu, gv] = block.gradient_at(lane, &self.e);
                let r = self.c - block.ray(lane).dot(&self.e);
                if block.weight[lane] > T::ZERO && r * r <= limit * limit * (gu * gu + gv * gv) {
                    block.clear(lane);
                    count += 1;
                }
            }
        }
        count
    }
}

/// Answers more than five degrees apart contradict each other, and one is not better than the other unless its score
/// is half as large.
const RIVAL_COS: f64 = 0.9962;
const RIVAL_SCORE: f64 = 2.0;

/// The edges of one picture, judged one by one.
struct Judge<'a, T, O> {
    config: &'a Config,
    camera: &'a Camera<T>,
    cam_to_body: Option<&'a Rotation<Cam, Body, T>>,
    expected: &'a Expected<T>,
    taken: &'a [Taken<T>],
    noise: &'a covariance::Config,
    /// The answer's level is asked for.
    tracks: bool,
    /// Shortest edge, border pixels.
    min_points: u16,
    observer: &'a O,
    blocks: &'a mut [Block<T>],
    steps: u32,
    best: Option<Best<T>>,
    /// The best score of an answer that points elsewhere.
    rival: Option<T>,
    /// Edges with too few points.
    short: u32,
    report: &'a mut Report<T>,
}

struct Best<T> {
    solution: Solution<T>,
    /// Level for the next picture.
    level: Option<u16>,
    score: T,
    /// It explains most of the limb in view, and most of its edge or with small residuals: no need to look further.
    certain: bool,
}

impl<T: Real, O: Observer<T>> Judge<'_, T, O> {
    /// Nothing more to look for: the limb is found, or the picture's steps are used up.
    fn done(&self) -> bool {
        self.steps == 0 || self.best.as_ref().is_some_and(|b| b.certain)
    }

    /// Edges from the border of the picture, the likeliest first, then those that search lines meet.
    #[inline(always)]
    fn border_following<P: Pixels>(&mut self, scene: &Scene<'_, T, P, O>, border: &mut [Pixel], bits: &mut [u32]) {
        let (narrow, widest) = line_spacing(self.expected, self.camera);
        let (spacing, widest) = self.config.contour.line_spacing_px.map_or((narrow, widest), |given| (given, given));
        let bits = bits.get_mut(..LINE_WORDS.min(bits.len())).unwrap_or_default();
        let (width, height) = (scene.region.width(), scene.region.height());
        let mut marks = Marks::new(bits, width, height, spacing, widest);
        // What is narrower on the border than a search line is apart from the next is no limb.
        let stride = spacing.min(width.min(height) / BORDER_LOOKS).max(1);
        let ranked = scene.ranked_starts(stride);
        for start in &ranked {
            if self.done() {
                break;
            }
            self.edge(scene, start.pixel, start.dark, border, &mut marks);
        }
        if !self.done() {
            scene.each_start(stride, |start| {
                if !ranked.iter().any(|r| r.pixel == start.pixel && r.dark == start.dark) {
                    self.edge(scene, start.pixel, start.dark, border, &mut marks);
                }
                !self.done()
            });
        }
        if self.best.is_none() {
            scene.each_crossing(&mut marks, |pixel, dark, marks| {
                self.edge(scene, pixel, dark, border, marks);
                !self.done()
            });
        }
    }

    /// Every outer border of the picture.
    #[cfg(feature = "horace")]
    fn raster<P: Pixels>(&mut self, scene: &Scene<'_, T, P, O>, border: &mut [Pixel], bits: &mut [u32]) {
        let mut steps = self.steps;
        let ended = contour::raster::each_border(scene, bits, border, &mut steps, |edge| {
            self.piece(scene, edge);
            true
        });
        self.report.counters.followed += self.steps - steps;
        self.steps = if ended == contour::raster::Scanned::Truncated { 0 } else { steps.max(1) };
    }

    /// Follows one edge and takes it through every stage.
    fn edge<P: Pixels>(
        &mut self,
        scene: &Scene<'_, T, P, O>,
        pixel: Pixel,
        dark: u8,
        border: &mut [Pixel],
        marks: &mut Marks<'_>,
    ) {
        let mut edge = Thinned::new(border);
        let before = self.steps;
        let end = scene.follow(pixel, dark, &mut edge, marks, &mut self.steps);
        let counters = &mut self.report.counters;
        counters.followed += before - self.steps;
        if matches!(end, End::Closed { twice_area } if twice_area > 0) {
            // A hole: sky or ground seen through something.
            return;
        }
        self.piece(scene, &edge);
    }

    /// Takes an edge through every stage.
    fn piece<P: Pixels>(&mut self, scene: &Scene<'_, T, P, O>, edge: &Thinned<'_>) {
        let counters = &mut self.report.counters;
        let length = edge.total();
        if length < u32::from(self.min_points) {
            self.short += 1;
            return;
        }
        let number = counters.candidates;
        counters.candidates += 1;
        counters.dropped += length - length.div_ceil(edge.stride().max(1));
        self.observer.edge(number, edge.pixels().iter().copied(), edge.stride());
        let (outcome, solution) = self.candidate(scene, number, length, edge.pixels());
        self.observer.verdict(number, &outcome, solution.as_ref().map(|b| &b.solution));
        // Full: only counted.
        let _ = self.report.candidates.push(outcome);
        if let Some(new) = solution {
            self.weigh(new);
        }
        self.observer.enter(Stage::Contour);
    }

    fn candidate<P: Pixels>(
        &mut self,
        scene: &Scene<'_, T, P, O>,
        number: u32,
        length: u32,
        border: &[Pixel],
    ) -> (Candidate<T>, Option<Best<T>>) {
        let config = self.config;
        let mut outcome = Candidate {
            length_px: length,
            points: 0,
            inliers: 0,
            rms_px: T::of(f64::NAN),
            verdict: Verdict::NoConsensus,
        };

        self.enter(Stage::Candidates);
        let points = candidates::pick(scene, &config.candidates, border, number, self.blocks);
        outcome.points = points.count;
        self.report.counters.edge_points += points.count;
        self.report.counters.fallback_points += points.fallback;
        let used = (points.count as usize).div_ceil(LANES);
        let Some(blocks) = self.blocks.get_mut(..used) else { return (outcome, None) };

        enter(self.report, self.observer, Stage::Undistort);
        undistort::to_rays(self.camera, blocks);

        enter(self.report, self.observer, Stage::Reject);
        let threshold = T::of(config.reject.threshold_px);
        let on_another: u32 = self.taken.iter().map(|t| t.withdraw(blocks, threshold)).sum();
        if on_another * 2 > points.count {
            outcome.verdict = Verdict::Taken;
            return (outcome, None);
        }
        let (fx, fy) = self.camera.focal_px();
        let focal = (fx + fy) * T::of(0.5);
        let Some(consensus) = reject::keep(blocks, points.count, self.expected, focal, &config.reject) else {
            return (outcome, None);
        };
        self.report.counters.draws += consensus.draws;

        enter(self.report, self.observer, Stage::Estimate);
        outcome.verdict = Verdict::NoFit;
        let fit =
            estimate::fit(blocks, &consensus, self.expected, self.camera, threshold, &config.estimate, self.noise);
        let Some(fit) = fit else { return (outcome, None) };
        outcome.inliers = fit.inliers;
        outcome.rms_px = fit.rms_px;
        for place in 0..points.count {
            if let Some(block) = blocks.get(place as usize / LANES) {
                self.observer.weight(number, place, block.weight[place as usize % LANES]);
            }
        }

        enter(self.report, self.observer, Stage::Covariance);
        let fused = covariance::fuse(blocks, &fit, self.expected, self.noise, &config.estimate);
        let Some(fused) = fused else { return (outcome, None) };

        enter(self.report, self.observer, Stage::Select);
        let (b1, b2) = basis(&fused.e);
        let covariance = Cov3::from_tangent(&b1, &b2, fused.p);
        let sigma = covariance.sigma_max_rad();
        let judged =
            select::judge(&fit, &fused, sigma, self.expected, blocks, points.count, scene, self.camera, &config.select);
        outcome.verdict = judged.verdict;
        if judged.verdict != Verdict::Passed || !sigma.is_finite() {
            return (outcome, None);
        }
        let axis = UnitVec3::assume_unit(fused.e);
        let one = T::one();
        let half_angle = |k: T| (k * (one + one - k)).most(T::ZERO).sqrt().atan2(one - k);
        let solution = Solution {
            axis,
            covariance,
            axis_ecef: self.expected.axis_ecef(),
            axis_body: self.cam_to_body.map(|r| r.apply(&axis)),
            half_angle_rad: half_angle(fit.k),
            fused_half_angle_rad: half_angle(fit.k - (fused.c - fit.c)),
            altitude_m: fused.var_free_cos.and_then(|v| self.expected.altitude(fit.c, v)),
            rms_px: fit.rms_px,
            inliers: fit.inliers,
            arc_px: fit.arc_px,
            candidate: number,
        };
        // The body on the other side of the same edge would have the half-angle π − α: two sigma at least from either.
        let curved = fused.var_free_cos.is_some_and(|v| v * T::of(4.0) < fused.c * fused.c);
        if config.estimate.half_angle == estimate::HalfAngle::Fused && !curved && !self.expected.free {
            outcome.verdict = Verdict::Straight;
            return (outcome, None);
        }
        let certain =
            judged.support > T::of(0.5) && (fit.inliers * 10 > points.count * 6 || fit.rms_px * T::of(4.0) < threshold);
        let tracks = self.tracks.then(|| select::middle_level(&fused.e, blocks, scene, self.camera));
        (outcome, Some(Best { solution, score: judged.score, certain, level: tracks.flatten() }))
    }

    /// Keeps the better of two answers, and remembers how good the other was if it says something else.
    fn weigh(&mut self, new: Best<T>) {
        let Some(old) = self.best.take() else {
            self.best = Some(new);
            return;
        };
        let apart = new.solution.axis.dot(&old.solution.axis) < T::of(RIVAL_COS);
        let (better, other) = if new.score < old.score { (new, old) } else { (old, new) };
        if apart {
            self.rival = Some(self.rival.map_or(other.score, |r| r.least(other.score)));
        }
        self.best = Some(better);
    }

    fn enter(&mut self, stage: Stage) {
        enter(self.report, self.observer, stage);
    }

    /// Writes the answer into the report.
    fn conclude(self) {
        let report = self.report;
        if let Some(best) = self.best {
            if !best.certain && self.rival.is_some_and(|r| r < best.score * T::of(RIVAL_SCORE)) {
                report.status = Status::Ambiguous;
                return;
            }
            let chosen = best.solution.candidate;
            if let Some(candidate) = report.candidates.get_mut(chosen as usize) {
                candidate.verdict = Verdict::Chosen;
                report.counters.edge_points = candidate.points;
            }
            report.status = Status::Ok;
            report.next_level = best.level;
            report.solution = Some(best.solution);
            return;
        }
        let fitted = report.candidates.iter().any(|c| {
            !matches!(c.verdict, Verdict::NoConsensus | Verdict::NoFit | Verdict::FewInliers | Verdict::Taken)
        });
        report.status = if self.steps == 0 {
            Status::Truncated
        } else if fitted {
            Status::Rejected
        } else if report.counters.candidates == 0 && self.short > 0 {
            Status::TooFewPoints
        } else {
            Status::NoLimb
        };
    }
}

fn enter<T, O: Observer<T>>(report: &mut Report<T>, observer: &O, stage: Stage) {
    report.stage = report.stage.max(stage);
    observer.enter(stage);
}
