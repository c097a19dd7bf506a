//! Takes the edges of one picture from border to verdict, one after the other, and decides which of them is the limb.

use super::budget;
use super::found_limb::FoundLimb;
use super::sensor::Sensor;
use crate::base::linalg::basis;
use crate::base::real::Real;
use crate::geometry::block::{Block, LANES};
use crate::geometry::camera::Camera;
use crate::geometry::frames::{Cam, Cov3, UnitVec3};
use crate::geometry::pixel::Pixel;
use crate::image::Pixels;
use crate::model::body::Expected;
use crate::model::error_budget::ErrorBudget;
use crate::model::observer::Observer;
use crate::model::report::{Candidate, Free, Report, Solution};
use crate::model::status::{Stage, Status};
use crate::model::verdict::Verdict;
use crate::model::work::{self, WorkBudget};
use crate::papers;
use crate::stages::consensus::{self, Threshold};
#[cfg(feature = "horace")]
use crate::stages::contour;
use crate::stages::contour::{BinaryPicture, End, Marks, Thinned};
use crate::stages::covariance::{self, Fused};
use crate::stages::edge_points::{self, Points};
use crate::stages::fit::{self, Fit};
use crate::stages::gates;
use crate::stages::rays;
use crate::stages::threshold;

/// Most words in which search lines are marked. More search lines find nothing new.
const LINE_WORDS: usize = 16384;

/// Approximate number of places at which the shorter side of the border is read. The dark and lit stretches that a limb
/// makes on the border are longer than the distance between two places. Every read of a column touches another page of
/// memory.
const BORDER_LOOKS: u16 = 128;

/// Returns the spacing of search lines in rows: the usual one (1 to 64), and the largest one for when memory is short
/// (1 to 256).
///
/// The largest spacing is the smallest extent of the body's disc. The usual spacing is a quarter of it if crescents
/// occur, because search lines must cross these too; otherwise it is the same.
///
/// A disc of half-angle α spans at least 2 α f min(r', r/sin θ) rows. The code uses f/2 in place of f min(r', r/sin θ);
/// every lens in use exceeds this.
fn line_spacing<T: Real>(expected: &Expected<T>, camera: &Camera<T>) -> (u16, u16) {
    let (_, fy) = camera.focal_px();
    let disc = expected.half_angle_rad() * fy;
    let narrow = if expected.phases { disc * T::from_f64(0.25) } else { disc };
    (narrow.to_i32().clamp(1, 64) as u16, disc.to_i32().clamp(1, 256) as u16)
}

/// The search over the edges of one picture, which are judged one by one.
pub(super) struct Search<'a, T, O> {
    sensor: &'a Sensor<T>,
    /// Camera of the sensor, or [`Sensor::turning`] if the camera turns while the picture is read out.
    camera: &'a Camera<T>,
    expected: &'a Expected<T>,
    taken: &'a [FoundLimb<T>],
    noise: &'a covariance::Config,
    /// Whether the answer needs a threshold for the next picture (method `track`).
    needs_next_threshold: bool,
    /// Length of the shortest candidate, border pixels.
    min_points: u16,
    observer: &'a O,
    blocks: &'a mut [Block<T>],
    /// The rest of the work budget.
    work: WorkBudget,
    best: Option<Best<T>>,
    /// The best score of an answer that points in another direction.
    rival: Option<T>,
    /// Number of edges with too few points.
    short: u32,
    /// Whether any edge was fitted, whatever its verdict.
    fitted: bool,
    report: &'a mut Report<T>,
}

/// Whether an edge begins at the border between two pixels that were read.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Missed {
    /// No edge shows this so far.
    Unknown,
    /// At least one edge does.
    Some,
    /// The border was searched for them pixel by pixel.
    Found,
}

struct Best<T> {
    solution: Solution<T>,
    outcome: Candidate<T>,
    /// Threshold for the next picture.
    level: Option<u16>,
    score: T,
    /// The answer explains most of the limb in view, and either most points of its edge are inliers or the residuals
    /// are small. The search can end.
    certain: bool,
}

impl<'a, T: Real, O: Observer<T>> Search<'a, T, O> {
    /// Begins a search. `camera` is the camera of the sensor or [`Sensor::turning`], `taken` are the limbs found
    /// before, `blocks` has room for the points of one edge, and `work` is the work budget of the look.
    pub(super) fn new(
        sensor: &'a Sensor<T>,
        camera: &'a Camera<T>,
        expected: &'a Expected<T>,
        taken: &'a [FoundLimb<T>],
        observer: &'a O,
        blocks: &'a mut [Block<T>],
        work: WorkBudget,
        report: &'a mut Report<T>,
    ) -> Self {
        let config = &sensor.config;
        Self {
            expected,
            taken,
            noise: config.noise_model_of(expected.which),
            needs_next_threshold: config.threshold_of(expected.which).method == threshold::Method::Track,
            min_points: config
                .candidates
                .min_points
                .min(gates::small_disc_points(expected.sin, &sensor.camera, 2))
                .min(gates::small_picture_points(&sensor.camera, 2)),
            observer,
            work,
            blocks,
            best: None,
            rival: None,
            short: 0,
            fitted: false,
            report,
            camera,
            sensor,
        }
    }

    /// Returns whether the search is over: the limb is found, or the work budget is used up.
    fn is_over(&self) -> bool {
        self.work.is_exhausted() || self.best.as_ref().is_some_and(|b| b.certain)
    }

    /// Examines the edges that begin at the border of the picture, the likeliest first, then those that search lines
    /// meet.
    #[inline(always)]
    pub(super) fn border_following<P: Pixels>(
        &mut self,
        binary: &BinaryPicture<'_, T, P, O>,
        border: &mut [Pixel],
        bits: &mut [u32],
    ) {
        let (narrow, widest) = line_spacing(self.expected, &self.sensor.camera);
        let (spacing, widest) =
            self.sensor.config.contour.line_spacing_px.map_or((narrow, widest), |given| (given, given));
        let bits = bits.get_mut(..LINE_WORDS.min(bits.len())).unwrap_or_default();
        let (width, height) = (binary.region.width(), binary.region.height());
        let mut marks = Marks::new(bits, width, height, spacing, widest);
        // A stretch of the border that is narrower than the distance between two search lines is no limb.
        let stride = spacing.min(width.min(height) / BORDER_LOOKS).max(1);
        let ranked = binary.ranked_starts(stride);
        self.work.charge(binary.cost());
        for start in &ranked {
            if self.is_over() {
                break;
            }
            self.follow_and_judge(binary, start.pixel, start.dark, border, &mut marks);
        }
        if !self.is_over() {
            binary.each_start(stride, &mut |start| {
                if !ranked.iter().any(|r| r.pixel == start.pixel && r.dark == start.dark) {
                    self.follow_and_judge(binary, start.pixel, start.dark, border, &mut marks);
                }
                self.work.charge(binary.cost());
                !self.is_over()
            });
        }
        if self.best.is_some() {
            return;
        }
        let mut missed = Missed::Unknown;
        for y in marks.rows(height) {
            let Some((x0, x1)) = binary.region.span(y) else { continue };
            if self.is_over() || !self.work.try_spend(work::line_cost(x0, x1)) {
                break;
            }
            let crossings = binary.each_crossing(y, (x0, x1), &mut marks, |pixel, dark, marks| {
                self.follow_from_line(binary, pixel, dark, border, marks, &mut missed);
                !self.is_over()
            });
            self.work.charge(crossings * work::CROSSING + binary.cost());
            if missed == Missed::Some {
                missed = Missed::Found;
                if !self.work.try_spend(work::ring_cost(width, height)) {
                    break;
                }
                binary.each_narrow_start(stride, &mut |start| {
                    self.follow_and_judge(binary, start.pixel, start.dark, border, &mut marks);
                    self.work.charge(binary.cost());
                    !self.is_over()
                });
            }
        }
    }

    /// Examines an edge that a search line meets. An edge that ends at the border also begins there, between two pixels
    /// that were read, and only a part of it is followed from the search line. It is therefore not judged; instead,
    /// `missed` requests a search of the whole border, which finds the edge from its beginning. After that search,
    /// every edge is judged.
    fn follow_from_line<P: Pixels>(
        &mut self,
        binary: &BinaryPicture<'_, T, P, O>,
        pixel: Pixel,
        dark: u8,
        border: &mut [Pixel],
        marks: &mut Marks<'_>,
        missed: &mut Missed,
    ) {
        let mut edge = Thinned::new(border);
        match self.follow(binary, pixel, dark, &mut edge, marks) {
            Some(End::Open) if *missed != Missed::Found => *missed = Missed::Some,
            Some(_) => self.judge_edge(binary, &edge),
            None => {}
        }
    }

    /// Examines every outer border of the picture.
    #[cfg(feature = "horace")]
    pub(super) fn raster<P: Pixels>(
        &mut self,
        binary: &BinaryPicture<'_, T, P, O>,
        border: &mut [Pixel],
        bits: &mut [u32],
    ) {
        let budget = self.work.remaining();
        let mut steps = budget;
        let ended = contour::raster::each_border(binary, bits, border, &mut steps, |edge| {
            self.judge_edge(binary, edge);
            !self.work.is_exhausted()
        });
        self.report.counters.followed += budget - steps;
        self.work.charge(budget - steps);
        if ended == contour::raster::Scanned::Truncated {
            self.work.mark_truncated();
        }
    }

    /// Examines all edge pixels of the picture as one edge, for methods that do not separate edges.
    #[cfg(any(feature = "horace", feature = "zju"))]
    pub(super) fn judge_all_as_one<'b, P: Pixels>(
        &mut self,
        binary: &BinaryPicture<'_, T, P, O>,
        edges: impl FnOnce(&mut WorkBudget) -> Thinned<'b>,
    ) {
        let edge = edges(&mut self.work);
        self.judge_edge(binary, &edge);
    }

    /// Follows one edge and takes it through every stage.
    fn follow_and_judge<P: Pixels>(
        &mut self,
        binary: &BinaryPicture<'_, T, P, O>,
        pixel: Pixel,
        dark: u8,
        border: &mut [Pixel],
        marks: &mut Marks<'_>,
    ) {
        let mut edge = Thinned::new(border);
        if self.follow(binary, pixel, dark, &mut edge, marks).is_some() {
            self.judge_edge(binary, &edge);
        }
    }

    /// Follows one edge and returns how it ended; `None` if the edge is a hole, or if the work budget does not allow
    /// it.
    fn follow<P: Pixels>(
        &mut self,
        binary: &BinaryPicture<'_, T, P, O>,
        pixel: Pixel,
        dark: u8,
        edge: &mut Thinned<'_>,
        marks: &mut Marks<'_>,
    ) -> Option<End> {
        if !self.work.try_spend(work::EDGE) {
            return None;
        }
        let end = self.work.limit_edge(|steps| binary.follow(pixel, dark, edge, marks, steps));
        self.report.counters.followed += edge.total();
        // A hole is sky or ground that is seen through something.
        let hole = matches!(end, End::Closed { twice_area } if twice_area > 0);
        (!hole).then_some(end)
    }

    /// Takes a followed edge through every stage, and keeps its answer if it is the best so far.
    pub(super) fn judge_edge<P: Pixels>(&mut self, binary: &BinaryPicture<'_, T, P, O>, edge: &Thinned<'_>) {
        let counters = &mut self.report.counters;
        let length = edge.total();
        if length < u32::from(self.min_points) {
            self.short += 1;
            return;
        }
        let keep = u32::from(self.sensor.config.candidates.keep_points);
        let points = (edge.pixels().len() as u32).min(if keep == 0 { u32::MAX } else { keep });
        let point = budget::point_cost(self.sensor.config.candidates.sub_pixel, binary.mask_cost());
        if !self.work.try_spend(points.saturating_mul(point)) {
            return;
        }
        let number = counters.candidates;
        counters.candidates += 1;
        counters.dropped += length - length.div_ceil(edge.stride().max(1));
        self.observer.edge(number, edge.pixels().iter().copied(), edge.stride());
        if !self.observer.wants(number) {
            return;
        }
        let (outcome, solution) = self.candidate(binary, number, length, edge.pixels());
        self.observer.verdict(number, &outcome, solution.as_ref().map(|b| &b.solution));
        if let Some(new) = solution {
            self.keep_better(new);
        }
        self.fitted |=
            !matches!(outcome.verdict, Verdict::NoConsensus | Verdict::NoFit | Verdict::FewInliers | Verdict::Taken);
        // When the list is full, the candidate is only counted. `Report::choose` lists it later if it is chosen.
        let _ = self.report.candidates.push(outcome);
        self.observer.enter(Stage::Contour);
    }

    /// Takes an edge from its border to a verdict. Returns the answer if the edge passes every gate.
    fn candidate<P: Pixels>(
        &mut self,
        binary: &BinaryPicture<'_, T, P, O>,
        number: u32,
        length: u32,
        border: &[Pixel],
    ) -> (Candidate<T>, Option<Best<T>>) {
        let mut outcome = Candidate {
            number,
            length_px: length,
            points: 0,
            inliers: 0,
            rms_px: T::from_f64(f64::NAN),
            verdict: Verdict::NoConsensus,
        };
        let best = self.locate_points(binary, border, &mut outcome).and_then(|points| {
            let clipped = T::from_i32(points.clipped as i32) / T::from_i32(points.count.max(1) as i32);
            let expected = self.expected.clipped(clipped);
            let (fit, threshold) = self.fit(&points, &expected, &mut outcome)?;
            self.judge(binary, &points, &expected, &fit, threshold, &mut outcome)
        });
        (outcome, best)
    }

    /// Locates the edge points. The caller has paid for them; the extra work of slow points is charged here.
    #[inline(always)]
    fn locate_points<P: Pixels>(
        &mut self,
        binary: &BinaryPicture<'_, T, P, O>,
        border: &[Pixel],
        outcome: &mut Candidate<T>,
    ) -> Option<Points> {
        self.enter(Stage::Candidates);
        let slow = work::slow_point_cost(binary.mask_cost());
        let most_slow = self.work.remaining() / slow;
        let config = &self.sensor.config.candidates;
        let points = edge_points::locate_edge_points(binary, config, border, outcome.number, self.blocks, most_slow);
        if points.slow == most_slow {
            self.work.exhaust();
            return None;
        }
        self.work.charge(points.slow * slow);
        outcome.points = points.count;
        self.report.counters.edge_points += points.count;
        self.report.counters.fallback_points += points.fallback;
        self.report.counters.cut_points += points.cut;
        Some(points)
    }

    /// Computes the rays, finds the consensus and fits the cone. Returns the fit with the threshold of the consensus.
    #[inline(always)]
    fn fit(
        &mut self,
        points: &Points,
        expected: &Expected<T>,
        outcome: &mut Candidate<T>,
    ) -> Option<(Fit<T>, Threshold<T>)> {
        let (config, camera) = (&self.sensor.config, self.camera);
        let used = (points.count as usize).div_ceil(LANES);
        let blocks = self.blocks.get_mut(..used)?;
        enter(self.report, self.observer, Stage::Undistort);
        rays::to_rays(camera, blocks);

        enter(self.report, self.observer, Stage::Reject);
        let configured_px = T::from_f64(config.reject.threshold_px);
        let on_another: u32 = self.taken.iter().map(|t| t.withdraw(blocks, configured_px)).sum();
        if on_another * 2 > points.count {
            outcome.verdict = Verdict::Taken;
            return None;
        }
        let (fx, fy) = camera.focal_px();
        let focal = (fx + fy) * T::from_f64(0.5);
        let threshold = Threshold::new(blocks, points.count, expected, focal, &config.reject);
        let work = &mut self.work;
        let consensus = consensus::find(blocks, points.count, expected, focal, threshold, &config.reject, work)?;
        self.report.counters.draws += consensus.draws;

        enter(self.report, self.observer, Stage::Estimate);
        outcome.verdict = Verdict::NoFit;
        if !self.work.try_spend(used as u32 * work::FIT + work::GATES) {
            return None;
        }
        let fit = fit::fit(blocks, &consensus, expected, camera, threshold.px, &config.estimate, self.noise)?;
        outcome.inliers = fit.inliers;
        outcome.rms_px = fit.rms_px;
        for place in 0..points.count {
            if let Some(block) = blocks.get(place as usize / LANES) {
                self.observer.weight(outcome.number, place, block.weight[place as usize % LANES]);
            }
        }
        Some((fit, threshold))
    }

    /// Computes the covariance and applies the gates. Returns the answer if every gate is passed.
    #[inline(always)]
    fn judge<P: Pixels>(
        &mut self,
        binary: &BinaryPicture<'_, T, P, O>,
        points: &Points,
        expected: &Expected<T>,
        fit: &Fit<T>,
        threshold: Threshold<T>,
        outcome: &mut Candidate<T>,
    ) -> Option<Best<T>> {
        let (config, camera) = (&self.sensor.config, self.camera);
        let blocks = self.blocks.get(..(points.count as usize).div_ceil(LANES))?;
        enter(self.report, self.observer, Stage::Covariance);
        let mut budget = self.observer.wants_budget().then(ErrorBudget::new);
        let fused = covariance::fuse(blocks, fit, expected, self.noise, &config.estimate, camera, budget.as_mut())?;
        if let Some(budget) = &budget {
            self.observer.budget(outcome.number, budget);
        }

        enter(self.report, self.observer, Stage::Select);
        let (b1, b2) = basis(&fused.e);
        let covariance = Cov3::from_tangent(&b1, &b2, fused.p);
        let sigma = covariance.sigma_max_rad();
        let (made, factor) = (points.count, threshold.factor);
        let judged = gates::judge(fit, &fused, sigma, expected, blocks, made, factor, binary, camera, &config.select);
        outcome.verdict = match judged.verdict {
            Verdict::Passed => papers::verdict(fit, expected, blocks, camera, binary.region, &config.select),
            failed => failed,
        };
        let fewest = T::from_i32(points.count as i32) * T::from_f64(config.recover.min_part);
        if self.report.counters.looks > 0 && T::from_i32(fit.inliers as i32) < fewest {
            outcome.verdict = Verdict::NoConsensus;
            return None;
        }
        if outcome.verdict != Verdict::Passed || !sigma.is_finite() {
            return None;
        }
        if config.estimate.half_angle == fit::HalfAngle::Fused
            && !self.is_side_known(fit, &fused, expected)
            && !expected.free
        {
            outcome.verdict = Verdict::Straight;
            return None;
        }
        let solution = self.make_solution(fit, &fused, covariance, expected, outcome.number);
        let share = T::from_i32(fit.inliers as i32)
            > T::from_i32(points.count as i32) * T::from_f64(config.select.certain_share);
        let certain = judged.support > T::from_f64(config.select.certain_support)
            && (share || fit.rms_px * T::from_f64(4.0) < threshold.px);
        let next =
            (self.needs_next_threshold && !P::STREAMED).then(|| gates::middle_level(&fused.e, blocks, binary, camera));
        Some(Best { solution, outcome: *outcome, score: judged.score, certain, level: next.flatten() })
    }

    /// Returns whether the curvature of the edge shows on which side of the edge the body is.
    ///
    /// A body on the other side of the same edge would have the half-angle π − α. The half-angle that the edge itself
    /// gives must be much nearer to α: (ĉ + c₀)² − (ĉ − c₀)² = 4 ĉ c₀ must exceed `min_side_sigma`² variances.
    fn is_side_known(&self, fit: &Fit<T>, fused: &Fused<T>, expected: &Expected<T>) -> bool {
        let sides = T::from_f64(self.sensor.config.select.min_side_sigma);
        fused.var_free_cos.is_some_and(|v| v * sides * sides < fit.c * expected.cos * T::from_f64(4.0))
    }

    #[inline(always)]
    fn make_solution(
        &self,
        fit: &Fit<T>,
        fused: &Fused<T>,
        covariance: Cov3<Cam, T>,
        expected: &Expected<T>,
        number: u32,
    ) -> Solution<T> {
        let axis = UnitVec3::assume_unit(fused.e);
        let one = T::one();
        let half_angle = |k: T| (k * (one + one - k)).max(T::ZERO).sqrt().atan2(one - k);
        Solution {
            axis,
            covariance,
            axis_ecef: expected.axis_ecef(),
            axis_body: self.sensor.cam_to_body.as_ref().map(|r| r.apply(&axis)),
            half_angle_rad: half_angle(fit.k),
            fused_half_angle_rad: half_angle(fit.k - (fused.c - fit.c)),
            altitude_m: fused.var_free_cos.and_then(|v| expected.altitude(fit.c, v)),
            free: fused.var_free_cos.map(|var_cos| Free {
                axis: UnitVec3::assume_unit(fit.e),
                cos: fit.c,
                var_cos,
                cos_per_px: fit.sums.cos_per_px(),
            }),
            rms_px: fit.rms_px,
            inliers: fit.inliers,
            arc_px: fit.arc_px,
            candidate: number,
        }
    }

    /// Keeps the better of two answers. If they point in different directions, the score of the other is kept as the
    /// rival's.
    fn keep_better(&mut self, new: Best<T>) {
        let Some(old) = self.best.take() else {
            self.best = Some(new);
            return;
        };
        let apart = new.solution.axis.angle_rad(&old.solution.axis)
            > T::from_f64(self.sensor.config.select.ambiguous_deg.to_radians());
        let (better, other) = if new.score < old.score { (new, old) } else { (old, new) };
        if apart {
            self.rival = Some(self.rival.map_or(other.score, |r| r.min(other.score)));
        }
        self.best = Some(better);
    }

    fn enter(&mut self, stage: Stage) {
        enter(self.report, self.observer, stage);
    }

    /// Writes the answer into the report. Returns the rest of the work budget.
    pub(super) fn conclude(self) -> WorkBudget {
        let (report, work) = (self.report, self.work);
        report.counters.work = work.spent();
        report.counters.looks += 1;
        if let Some(best) = self.best {
            let factor = T::from_f64(self.sensor.config.select.ambiguous_score);
            if !best.certain && self.rival.is_some_and(|r| r < best.score * factor) {
                report.status = Status::Ambiguous;
                return work;
            }
            report.choose(best.outcome);
            report.status = Status::Ok;
            report.next_level = best.level;
            report.solution = Some(best.solution);
            return work;
        }
        report.status = if work.was_truncated() {
            Status::Truncated
        } else if self.fitted {
            Status::Rejected
        } else if report.counters.candidates == 0 && self.short > 0 {
            Status::TooFewPoints
        } else {
            Status::NoLimb
        };
        work
    }
}

fn enter<T, O: Observer<T>>(report: &mut Report<T>, observer: &O, stage: Stage) {
    report.stage = report.stage.max(stage);
    observer.enter(stage);
}
