//! All facts about one picture that the window draws and prints.

use std::cell::RefCell;
use std::collections::HashSet;
use std::sync::{Arc, OnceLock};
use std::time::Duration;

use egui::{Color32, ColorImage};
use hzn_core::camera::Camera;
use hzn_core::covariance::ErrorBudget;
use hzn_core::image::{ImageView, Pixels};
use hzn_core::observer::Border;
use hzn_core::pixel::ImagePoint;
use hzn_core::real::Real;
use hzn_core::report::Candidate;
use hzn_core::status::{Stage, Status};
use hzn_core::{Config, Expected, Observer, Report, Solution, body};
use hzn_files::FrameData;
use hzn_mcap::{Row, RowMeta};
use hzn_run::engine::trace::Edge;
use hzn_run::engine::{AnySensor, BodyOutcome, Finished, Trace, Traces, Watch};
use hzn_run::source::Picture;
use hzn_run::{overlay, sink, unread};

use super::paint::Recipe;
use super::residuals::{Residual, ellipse, residuals};
use super::trials::{OtsuTrial, Trials};
use super::{coast, ground};
use crate::model::cause::Cause;
use crate::model::diagnosis::FitFacts;
use crate::model::view::Point;
use crate::model::{Entry, Histogram, Processed};

/// One picture, processed with the current parameters.
#[derive(Debug, Clone)]
pub struct FrameView {
    /// Index of the picture in the sequence.
    pub index: usize,
    /// Name of the picture.
    pub name: String,
    /// Time in seconds, if it is known.
    pub time_s: Option<f64>,
    /// Data of the picture that were known before it was processed.
    pub data: Option<FrameData>,
    /// The picture, or the reason why there is none.
    pub picture: Result<Arc<Picture>, String>,
    /// The picture as it is shown. It is the same `Arc` as before if it has not changed.
    pub image: Option<Arc<Shown>>,
    /// The camera, if there is a sensor.
    pub camera: Option<Arc<Camera<f64>>>,
    /// Results: of the session, then of the configuration that it is compared with.
    pub answers: Vec<Arc<Outcome>>,
    /// Version number of the session's configuration.
    pub version: u64,
    /// Brightness of the picture, if it could be read.
    pub histogram: Option<Arc<Histogram>>,
    /// Time to read and decode the picture; `None` if it was already decoded.
    pub decoding: Option<Duration>,
    /// Latitudes and longitudes of the body, computed when they are drawn first; see [`FrameView::grid`].
    pub(super) grid: Arc<OnceLock<Option<ground::Grid>>>,
    /// Time from the request to the answer.
    pub latency: Duration,
}

impl FrameView {
    /// Returns width and height of the picture in pixels, if it could be read.
    pub fn size(&self) -> Option<Point> {
        let layout = self.picture.as_ref().ok()?.layout;
        Some([layout.width.into(), layout.height.into()])
    }
    /// Returns latitudes and longitudes of the first body, if the position and the attitude of the picture are given.
    pub fn grid(&self) -> Option<&ground::Grid> {
        let compute = || {
            let body = &self.answers.first()?.config.body;
            coast::grid(self.data.as_ref()?, body, self.camera.as_deref()?)
        };
        self.grid.get_or_init(compute).as_ref()
    }
}

/// A picture for the screen.
#[derive(Debug)]
pub struct Shown {
    /// Index and recipe of the picture that the pixels were painted for.
    pub key: (usize, Recipe),
    /// The pixels.
    pub image: Arc<ColorImage>,
}

/// Result of one configuration for a picture.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The configuration.
    pub config: Arc<Config>,
    /// Results of the bodies, in order. They are shared, because they hold thousands of points.
    pub bodies: Vec<Arc<BodyResult>>,
    /// Reason why the picture was not processed, for example because it has another size.
    pub refused: Option<String>,
    /// Pixels that were read, white in a transparent picture; only on request.
    pub touched: Option<Arc<ColorImage>>,
    /// Number of different pixels that were read.
    pub touched_pixels: Option<usize>,
}

impl Outcome {
    /// Returns the outcome of a picture that is not processed yet.
    pub(super) fn new(config: &Arc<Config>) -> Self {
        Self { config: Arc::clone(config), bodies: Vec::new(), refused: None, touched: None, touched_pixels: None }
    }
}

/// Result for one body.
#[derive(Debug, Clone)]
pub struct BodyResult {
    /// Kind of the body.
    pub kind: body::Kind,
    /// The result as it is written to files.
    pub row: Row,
    /// The report, or the reason why there is none.
    pub report: Result<Report<f64>, String>,
    /// Candidate edges, in the order in which they were followed.
    pub edges: Vec<Edge>,
    /// Mean and number of the sampled pixels that the threshold was computed from.
    pub sample: Option<(f64, u32)>,
    /// Time of each stage while an observer watches.
    pub times: Vec<(Stage, Duration)>,
    /// Total time, without an observer unless the sensor tracks the threshold.
    pub elapsed: Duration,
    /// Expected half-angle in radians; `None` if none can be computed.
    pub expected_rad: Option<f64>,
    /// The fitted limb, as lines that end at the border of the picture.
    pub limb: Vec<Vec<Point>>,
    /// Picture point of the limb axis.
    pub axis: Option<Point>,
    /// Outline of the 3-sigma ellipse of the axis, in the picture.
    pub ellipse: Vec<Point>,
    /// Residuals of the chosen edge's points.
    pub residuals: Vec<Residual>,
    /// Why the picture has no answer.
    pub cause: Option<Cause>,
    /// Result with Otsu's threshold, if the sensor uses another threshold.
    pub otsu: Option<OtsuTrial>,
    /// Fit of the longest edge.
    pub fit: Option<FitFacts>,
    /// Limbs of candidates that are not the answer: the number of the candidate, and lines in pixels.
    pub candidate_limbs: Vec<(u32, Vec<Vec<Point>>)>,
    /// Limb of a trial with a cone of any half-angle, in an edge in which the sensor found no cone.
    pub trial_limb: Vec<Vec<Point>>,
    /// The limb of the expected half-angle about the axis of the longest fit, where the fitted half-angle is another.
    pub expected_limb: Vec<Vec<Point>>,
}

/// Steps around the cone for the limbs of candidates. They are drawn with every change of a parameter, so they are
/// coarser than the limb of the answer.
const CANDIDATE_STEPS: usize = 720;

/// Number of candidates whose limbs are drawn.
const DRAWN_CANDIDATES: usize = 3;

impl BodyResult {
    /// Returns the numbers of the candidates whose limbs are drawn: those of the longest edges, the longest first.
    pub fn longest_candidates(&self) -> Vec<u32> {
        let length = |c: u32| {
            let edge = self.edges.iter().find(|e| e.candidate == c);
            edge.and_then(|e| e.outcome).map_or(0, |o| o.length_px)
        };
        let mut all: Vec<u32> = self.candidate_limbs.iter().map(|(c, _)| *c).collect();
        all.sort_by_key(|c| std::cmp::Reverse(length(*c)));
        all.truncate(DRAWN_CANDIDATES);
        all
    }

    /// Collects the result for a body. `camera` is the camera that the limb is drawn with.
    fn new(
        kind: body::Kind,
        outcome: BodyOutcome,
        row: Row,
        expected_rad: Option<f64>,
        trace: &Trace,
        camera: &Camera<f64>,
    ) -> Self {
        let solution = outcome.report.as_ref().ok().and_then(|r| r.solution.as_ref()).copied();
        let edges = trace.edges().clone();
        let chosen = solution.and_then(|s| edges.iter().find(|e| e.candidate == s.candidate));
        let fits = edges.iter().filter_map(|e| Some((e, e.fitted?)));
        let others = fits.filter(|(e, _)| solution.is_none_or(|s| s.candidate != e.candidate));
        let candidate_limbs = others.map(|(e, f)| (e.candidate, free_limb(&f.solution, camera))).collect();
        Self {
            kind,
            row,
            cause: None,
            otsu: None,
            fit: None,
            candidate_limbs,
            trial_limb: Vec::new(),
            expected_limb: Vec::new(),
            sample: trace.level().map(|(_, mean, n)| (mean, n)),
            times: trace.times().to_vec(),
            elapsed: outcome.elapsed,
            expected_rad,
            limb: solution.map(|s| overlay::draw_limb(&s, camera).limb).unwrap_or_default(),
            axis: solution.and_then(|s| camera.project(&s.axis)).map(|p| [p.u, p.v]),
            ellipse: solution.map(|s| ellipse(&s, camera)).unwrap_or_default(),
            residuals: solution.zip(chosen).map(|(s, edge)| residuals(&s, edge, camera)).unwrap_or_default(),
            report: outcome.report.map_err(|e| e.why),
            edges,
        }
    }
    /// Returns the solution, if there is one.
    pub fn solution(&self) -> Option<&Solution<f64>> {
        self.report.as_ref().ok()?.solution.as_ref()
    }
    /// Returns the edge that the answer was computed from.
    pub fn chosen(&self) -> Option<&Edge> {
        let candidate = self.solution()?.candidate;
        self.edges.iter().find(|e| e.candidate == candidate)
    }
}

/// Observer that records the pixels that were read, in addition to the traces.
struct PixelTraces {
    traces: Traces,
    pixels: Option<RefCell<HashSet<(u16, u16)>>>,
}

impl Watch for PixelTraces {
    fn times(&self) -> Vec<Duration> {
        self.traces.times()
    }
}

impl<T: Real + Into<f64>> Observer<T> for PixelTraces {
    fn body(&self, index: u8) {
        Observer::<T>::body(&self.traces, index);
    }
    fn enter(&self, stage: Stage) {
        Observer::<T>::enter(&self.traces, stage);
    }
    fn leave(&self) {
        Observer::<T>::leave(&self.traces);
    }
    fn pixel(&self, x: u16, y: u16) {
        if let Some(pixels) = &self.pixels {
            pixels.borrow_mut().insert((x, y));
        }
    }
    fn level(&self, level: u16, mean: T, samples: u32) {
        Observer::<T>::level(&self.traces, level, mean, samples);
    }
    fn edge(&self, candidate: u32, border: Border<'_>) {
        Observer::<T>::edge(&self.traces, candidate, border);
    }
    fn point(&self, candidate: u32, point: ImagePoint<T>) {
        self.traces.point(candidate, point);
    }
    fn weight(&self, candidate: u32, point: u32, weight: T) {
        self.traces.weight(candidate, point, weight);
    }
    fn dark_frame(&self, px: u16) {
        Observer::<T>::dark_frame(&self.traces, px);
    }
    fn begin_again(&self) {
        Observer::<T>::begin_again(&self.traces);
    }
    fn look(&self, number: u32, level: u16) {
        Observer::<T>::look(&self.traces, number, level);
    }
    fn wants_budget(&self) -> bool {
        true
    }
    fn budget(&self, candidate: u32, budget: &ErrorBudget<T>) {
        self.traces.budget(candidate, budget);
    }
    fn wants_fit(&self) -> bool {
        true
    }
    fn fit(&self, candidate: u32, fit: &Solution<T>, expected: &Expected<T>) {
        self.traces.fit(candidate, fit, expected);
    }
    fn verdict(&self, candidate: u32, outcome: &Candidate<T>, solution: Option<&Solution<T>>) {
        self.traces.verdict(candidate, outcome, solution);
    }
}

/// A picture before a sensor processes it.
#[derive(Debug, Clone, Copy)]
pub struct FrameInput<'a> {
    /// Index of the picture in the sequence.
    pub index: usize,
    /// Name of the picture.
    pub name: &'a str,
    /// Time in seconds, if it is known.
    pub time_s: Option<f64>,
    /// Data of the picture that are known.
    pub data: Option<&'a FrameData>,
    /// The picture.
    pub picture: &'a Picture,
}

impl<'a> FrameInput<'a> {
    /// Returns a picture of the sequence.
    pub fn of_entry(index: usize, entry: &'a Entry, picture: &'a Picture) -> Self {
        Self { index, name: &entry.name, time_s: entry.time_s, data: entry.data.as_ref(), picture }
    }
    /// Returns the processed picture, from the outcomes of its bodies.
    pub(super) fn finish(&self, outcomes: Vec<BodyOutcome>) -> Finished {
        Finished {
            index: self.index as u64,
            name: self.name.to_owned(),
            time_s: self.time_s,
            stamp: None,
            data: self.data.cloned(),
            outcomes,
            is_flight: false,
            drawing: hzn_mcap::Annotations::default(),
            picture: None,
            glimpse: None,
            traces: None,
            tip: None,
            pages: 1,
            mask: None,
            identity: None,
            bytes: None,
            brightness_by_sun: None,
        }
    }
}

/// Processes a picture and returns all facts to show. With `touched`, the result includes the pixels that were read.
/// `trials` finds the causes of refusals.
pub fn process_frame(
    input: FrameInput<'_>,
    config: &Arc<Config>,
    sensor: &mut AnySensor,
    touched: bool,
    trials: Option<&mut Trials>,
) -> Outcome {
    let mut outcome = Outcome::new(config);
    let view = match checked_view(input.picture, config) {
        Ok(view) => view,
        Err(why) => {
            outcome.refused = Some(why);
            return outcome;
        }
    };
    let bodies = config.each_body();
    let watch = PixelTraces { traces: Traces::new(bodies.len()), pixels: touched.then(RefCell::default) };
    let watched = sensor.process_watched(&view, input.data, &watch);
    // A second run measures the time without the observer. It is left out if the sensor tracks the threshold, because
    // the threshold would then come from the first run.
    let plain = if config.tracks() { watched } else { sensor.process(&view, input.data, None) };
    let finished = input.finish(plain.into_iter().map(BodyOutcome::from).collect());
    let rows = sink::rows(&finished, config);
    let half_angles = sensor.expected_half_angles_rad(input.data);
    // The drawing takes the rotation rate into account, so every row is drawn where the sensor saw it.
    let camera = &sensor.camera_of(input.data);
    let each = bodies.iter().zip(finished.outcomes).zip(rows).zip(half_angles).zip(&watch.traces.each);
    let mut results: Vec<BodyResult> = each
        .map(|((((body, found), row), expected), trace)| {
            BodyResult::new(body.kind, found, row, expected.ok(), trace, camera)
        })
        .collect();
    if let Some(trials) = trials {
        add_causes(&mut results, input, &view, camera, trials);
    }
    outcome.bodies = results.into_iter().map(Arc::new).collect();
    if let Some(pixels) = watch.pixels {
        let pixels = pixels.into_inner();
        outcome.touched_pixels = Some(pixels.len());
        outcome.touched = Some(Arc::new(touched_image(&view, &pixels)));
    }
    outcome
}

/// Adds the causes of refusals and what the fits say.
fn add_causes(
    bodies: &mut [BodyResult],
    input: FrameInput<'_>,
    view: &ImageView<'_>,
    camera: &Camera<f64>,
    trials: &mut Trials,
) {
    let refused = bodies.iter().any(|b| b.row.status != Status::Ok);
    let otsu = trials.try_otsu(view, input.data, refused).unwrap_or_default();
    for (index, body) in bodies.iter_mut().enumerate() {
        let Ok(report) = &body.report else { continue };
        body.otsu = otsu.get(index).copied();
        let wrong_level = body.otsu.is_some_and(|o| o.answered);
        body.cause = Some(Cause::from_report(report, wrong_level));
        // The edge of a wrong threshold is not the limb.
        if wrong_level {
            continue;
        }
        let found = trials.find_fit(&body.edges, report, body.row.altitude_km, camera, (view, input.data));
        let Some((fit, solution, needs_otsu)) = found else { continue };
        body.fit = Some(fit);
        if let Some(otsu) = body.otsu.as_mut().filter(|_| needs_otsu) {
            otsu.finds_limb = true;
            body.cause = Some(Cause::from_report(report, true));
        }
        if fit.is_trial {
            body.trial_limb = free_limb(&solution, camera);
        }
        if report.solution.is_none() {
            let axis = solution.axis.xyz();
            let half_angle_rad = fit.expected_deg.to_radians();
            body.expected_limb = overlay::limb::lines_with_steps(axis, half_angle_rad, camera, CANDIDATE_STEPS);
        }
    }
}

/// Returns the limb of a fit with its own half-angle, in coarse steps.
fn free_limb(solution: &Solution<f64>, camera: &Camera<f64>) -> Vec<Vec<Point>> {
    overlay::limb::lines_with_steps(solution.axis.xyz(), solution.half_angle_rad, camera, CANDIDATE_STEPS)
}

/// Returns the results of a picture that cannot be processed: one row for each body.
pub(super) fn refused_rows(index: usize, entry: &Entry, config: &Config, why: &str) -> Processed {
    let row = |body: &body::Config| {
        let altitude_km = entry.data.as_ref().and_then(|d| d.altitude_km);
        let (file, body) = (entry.name.clone(), body.kind.name().to_owned());
        let meta = RowMeta { index: index as u64, file, time_s: entry.time_s, body, altitude_km };
        Row::unprocessed(&meta, Status::Unreadable, why)
    };
    Processed { rows: config.each_body().iter().map(row).collect(), ..Processed::default() }
}

/// Returns the picture for the sensor, or the reason why the sensor cannot process it.
pub(super) fn checked_view<'a>(picture: &'a Picture, config: &Config) -> Result<ImageView<'a>, String> {
    let (w, h) = (picture.layout.width, picture.layout.height);
    let own = [config.camera.width, config.camera.height].map(u32::from);
    if [w, h] != own {
        return Err(unread::other_size([w, h], own));
    }
    picture.view(config.input.channel).map_err(unread::other_channel)
}

fn touched_image(view: &ImageView<'_>, pixels: &HashSet<(u16, u16)>) -> ColorImage {
    let (w, h) = (view.width(), view.height());
    let mut image = ColorImage::filled([usize::from(w), usize::from(h)], Color32::TRANSPARENT);
    for &(x, y) in pixels {
        if let Some(pixel) = image.pixels.get_mut(usize::from(y) * usize::from(w) + usize::from(x)) {
            *pixel = Color32::WHITE;
        }
    }
    image
}
