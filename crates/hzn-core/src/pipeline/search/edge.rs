//! The way of one edge from its border to a verdict.

use super::{Best, Search};
use crate::base::linalg::basis;
use crate::base::real::Real;
use crate::geometry::block::LANES;
use crate::geometry::frames::{Cam, Cov3, UnitVec3};
use crate::geometry::pixel::Pixel;
use crate::image::Pixels;
use crate::model::body::Expected;
use crate::model::body::Target;
use crate::model::error_budget::ErrorBudget;
use crate::model::observer::{Border, Observer};
use crate::model::report::{Candidate, Free, FreeCommon, Report, Solution};
use crate::model::status::Stage;
use crate::model::verdict::Verdict;
use crate::model::work;
use crate::pipeline::budget;
use crate::stages::consensus::{self, Threshold};
use crate::stages::contour::{BinaryPicture, Thinned};
use crate::stages::covariance::{self, Fused};
use crate::stages::edge_points::{self, Points};
use crate::stages::fit::{self, Fit};
use crate::stages::gates::{self, Case, Choice, Cover, Passed};
use crate::stages::rays;

/// An answer ends the search where its edge covers more than this part of the limb in view, and where more than
/// [`CERTAIN_SHARE`] of its points are inliers.
const CERTAIN_SUPPORT: f64 = 0.5;
/// See [`CERTAIN_SUPPORT`]. An RMS below a quarter of the largest distance of an inlier replaces this condition.
pub(super) const CERTAIN_SHARE: f64 = 0.8;
/// Smallest part of an edge's points that must be inliers. With one inlier in 20 points and a threshold of three
/// pixels, a cone that is free to turn passes through clutter by chance.
const MIN_INLIER_SHARE: f64 = 0.05;
/// The same in a further look. The gate `no_consensus` asks less of a half-lit disc.
const LATER_INLIER_SHARE: f64 = 0.5;

impl<T: Real, O: Observer<T>> Search<'_, T, O> {
    /// Takes a followed edge through every stage, and keeps its answer if it is the best so far.
    pub(super) fn judge_edge<P: Pixels>(&mut self, binary: &BinaryPicture<'_, T, P, O>, edge: &Thinned<'_>) {
        let length = edge.total();
        if length < u32::from(self.min_points) {
            self.short += 1;
            return;
        }
        if self.choice() == Choice::Longest {
            if length <= self.longest {
                return;
            }
            // Only the longest edge counts: an answer of a shorter one is no answer.
            self.longest = length;
            self.best = None;
        }
        let keep = u32::from(self.sensor.config.edge_points.keep_points);
        let points = (edge.pixels().len() as u32).min(if keep == 0 { u32::MAX } else { keep });
        let point = budget::point_cost(self.sensor.config.edge_points.sub_pixel, binary.mask_cost());
        if !self.work.try_spend(points.saturating_mul(point)) {
            return;
        }
        let counters = &mut self.report.counters;
        let number = counters.candidates;
        counters.candidates += 1;
        counters.dropped += length - length.div_ceil(edge.stride().max(1));
        self.observer.edge(number, Border::new(edge.pixels(), edge.stride()));
        if !self.observer.wants(number) {
            return;
        }
        let mut outcome = Candidate {
            number,
            length_px: length,
            points: 0,
            inliers: 0,
            rms_px: T::from_f64(f64::NAN),
            verdict: Verdict::NoConsensus,
        };
        let solution = self.candidate(binary, edge.pixels(), &mut outcome);
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
        border: &[Pixel],
        outcome: &mut Candidate<T>,
    ) -> Option<Best<T>> {
        let points = self.locate_points(binary, border, outcome)?;
        let clipped = T::from_i32(points.clipped as i32) / T::from_i32(points.count.max(1) as i32);
        let expected = self.expected.clipped(clipped);
        let (fit, threshold) = self.fit(&points, &expected, outcome)?;
        self.judge(binary, &points, &expected, &fit, threshold, outcome)
    }

    /// Locates the edge points. The caller has paid for them; the extra work of slow points is charged here.
    #[inline(always)]
    fn locate_points<P: Pixels>(
        &mut self,
        binary: &BinaryPicture<'_, T, P, O>,
        border: &[Pixel],
        outcome: &mut Candidate<T>,
    ) -> Option<Points> {
        self.enter(Stage::EdgePoints);
        let most_extra = self.work.remaining();
        let config = &self.sensor.config.edge_points;
        let points = edge_points::locate_edge_points(binary, config, border, outcome.number, self.blocks, most_extra);
        if points.extra_cost >= most_extra {
            self.work.exhaust();
            return None;
        }
        self.work.charge(points.extra_cost);
        outcome.points = points.count;
        self.observer.points(outcome.number, points.count, points.clipped);
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
        enter(self.report, self.observer, Stage::Rays);
        rays::to_rays(camera, blocks);

        enter(self.report, self.observer, Stage::Consensus);
        let configured_px = T::from_f64(config.consensus.threshold_px);
        let on_another: u32 = self.taken.iter().map(|t| t.withdraw(blocks, camera, configured_px)).sum();
        if on_another * 2 > points.count {
            outcome.verdict = Verdict::Taken;
            return None;
        }
        let (fx, fy) = camera.focal_px();
        let focal = (fx + fy) * T::from_f64(0.5);
        let uneven_px = expected.uneven_px(camera);
        let threshold = Threshold::new(blocks, points.count, expected, focal, uneven_px, &config.consensus);
        let work = &mut self.work;
        let consensus = consensus::find(blocks, points.count, expected, focal, threshold, &config.consensus, work)?;
        self.report.counters.draws += consensus.draws;

        enter(self.report, self.observer, Stage::Fit);
        outcome.verdict = Verdict::NoFit;
        if !self.work.try_spend(used as u32 * work::FIT + work::GATES) {
            return None;
        }
        let mut fit = fit::fit(blocks, &consensus, expected, camera, threshold.px, &config.fit, self.noise)?;
        (fit.profiles, fit.tone) = (points.profiles, config.input.tone);
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
        let refined = expected.target().map(|_| expected.seen_along(&fit.e));
        let expected = refined.as_ref().unwrap_or(expected);
        outcome.verdict = Verdict::Uncertain;
        let mut budget = self.observer.wants_budget().then(ErrorBudget::new);
        let fused = covariance::fuse(blocks, fit, expected, self.noise, &config.fit, camera, budget.as_mut())?;
        budget.iter().for_each(|budget| self.observer.budget(outcome.number, budget));

        enter(self.report, self.observer, Stage::Gates);
        let (b1, b2) = basis(&fused.e);
        let covariance = Cov3::from_tangent(&b1, &b2, fused.p);
        self.show_fit(fit, &fused, covariance, expected, outcome.number);
        let case = Case {
            number: outcome.number,
            fit,
            fused: &fused,
            sigma_max_rad: covariance.sigma_max_rad(),
            expected,
            taken: self.taken,
            blocks,
            points: points.count,
            fallback: points.fallback,
            min_inlier_share: self.min_inlier_share(),
            raised: threshold.factor,
            width_px: threshold.px,
            camera,
            region: binary.region,
            fit_config: &config.fit,
            config: &config.gates,
            cover: Cover::new(fit, &fused, blocks, camera, binary.region),
        };
        let judged = gates::judge(&case, binary);
        outcome.verdict = judged.err().unwrap_or(Verdict::Passed);
        let Passed { glows, p_limb } = judged.ok()?;
        let mut solution = self.make_solution(fit, &fused, covariance, expected, outcome.number)?;
        solution.p_limb = p_limb;
        let share = T::from_i32(fit.inliers as i32) > T::from_i32(points.count as i32) * T::from_f64(CERTAIN_SHARE);
        let certain = !self.examines_all()
            && case.cover.share > T::from_f64(CERTAIN_SUPPORT)
            && (share || fit.rms_px * T::from_f64(4.0) < threshold.px);
        let next = (self.needs_next_threshold && !P::STREAMED)
            .then(|| gates::middle_level(&fused.e, blocks, fit.inliers, binary, camera));
        Some(Best { solution, outcome: *outcome, score: gates::score(&case), glows, certain, level: next.flatten() })
    }

    /// Returns the smallest part of an edge's points that must be inliers. A further look is another chance for a false
    /// answer, so it asks for more.
    fn min_inlier_share(&self) -> f64 {
        if self.report.counters.looks > 0 { LATER_INLIER_SHARE } else { MIN_INLIER_SHARE }
    }

    /// Shows the fit of a candidate to the observer, if the observer wants it.
    #[inline(always)]
    fn show_fit(&self, fit: &Fit<T>, fused: &Fused<T>, covariance: Cov3<Cam, T>, expected: &Expected<T>, number: u32) {
        if self.observer.wants_fit()
            && let Some(solution) = self.make_solution(fit, fused, covariance, expected, number)
        {
            self.observer.fit(number, &solution, expected);
        }
    }

    #[inline(always)]
    fn make_solution(
        &self,
        fit: &Fit<T>,
        fused: &Fused<T>,
        covariance: Cov3<Cam, T>,
        expected: &Expected<T>,
        number: u32,
    ) -> Option<Solution<T>> {
        let axis = UnitVec3::assume_unit(fused.e);
        let one = T::one();
        let (b1, b2) = basis(&fit.e);
        let half_angle = |k: T| (k * (one + one - k)).max(T::ZERO).sqrt().atan2(one - k);
        let in_camera = |[on_1, on_2]: [T; 2]| -> [T; 3] { (b1 * on_1 + b2 * on_2).into() };
        let solution = Solution {
            axis,
            covariance,
            common: fused.common.map(|p| {
                let (n1, n2) = basis(&fused.e);
                Cov3::from_tangent(&n1, &n2, p)
            }),
            axis_fixed: expected.axis_fixed(),
            axis_vehicle: self.sensor.vehicle_from_camera.as_ref().map(|r| r.apply(&axis)),
            half_angle_rad: half_angle(fit.k),
            fused_half_angle_rad: half_angle(fit.k - (fused.c - fit.c)),
            altitude_m: fused.var_free_cos.and_then(|v| expected.altitude(fit.c, v)),
            free: fused.var_free_cos.map(|var_cos| Free {
                axis: UnitVec3::assume_unit(fit.e),
                covariance: Cov3::from_tangent(&b1, &b2, fused.free_p),
                cos: fit.c,
                var_cos,
                axis_with_cos: Some(in_camera(fused.free_with_cos)),
                cos_per_px: fit.sums.cos_per_px(),
                common: fused.free_common.map(|p| FreeCommon {
                    covariance: Cov3::from_tangent(&b1, &b2, [p.m11, p.m12, p.m22]),
                    var_cos: p.m33,
                    axis_with_cos: in_camera([p.m13, p.m23]),
                }),
            }),
            axis_by_cos: Some(in_camera(fused.by_cos)),
            position: None,
            p_limb: None,
            is_airglow: expected.is_airglow,
            rms_px: fit.rms_px,
            inliers: fit.inliers,
            arc_px: fit.arc_px,
            candidate: number,
        };
        if let Some(target) = expected.target() {
            return self.place(solution, fused, target, expected);
        }
        Some(solution)
    }

    /// Replaces what is in scaled space by the same in the camera frame, and adds the position.
    fn place(
        &self,
        solution: Solution<T>,
        fused: &Fused<T>,
        target: &Target<T>,
        expected: &Expected<T>,
    ) -> Option<Solution<T>> {
        let placed = covariance::place(fused, target, expected.radius_m)?;
        let axis = UnitVec3::assume_unit(placed.axis);
        let (b1, b2) = basis(&placed.axis);
        let [half_angle_rad, fused_half_angle_rad] = placed.half_angles_rad;
        Some(Solution {
            axis,
            covariance: Cov3::from_tangent(&b1, &b2, placed.p),
            common: placed.common.map(|p| Cov3::from_tangent(&b1, &b2, p)),
            axis_vehicle: self.sensor.vehicle_from_camera.as_ref().map(|r| r.apply(&axis)),
            half_angle_rad,
            fused_half_angle_rad,
            altitude_m: placed.altitude_m,
            free: None,
            axis_by_cos: None,
            position: placed.position,
            ..solution
        })
    }

    fn enter(&mut self, stage: Stage) {
        enter(self.report, self.observer, stage);
    }
}

fn enter<T, O: Observer<T>>(report: &mut Report<T>, observer: &O, stage: Stage) {
    report.stage = report.stage.max(stage);
    observer.enter(stage);
}
