//! The default method: RANSAC with the expected half-angle, verified on one further point.

use super::config::Config;
use super::inliers::{Consensus, Threshold};
use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::base::rng::Rng;
use crate::geometry::block::{Block, LANES, LEAST_GRADIENT2, sum};
use crate::geometry::cone::{through_three, through_two};
use crate::model::body::Expected;
use crate::model::work::{DRAW, SCORE, WorkBudget};

/// Largest number of blocks that are scored.
// A part of the points suffices to rank cones, because neighbours have correlated errors.
const SCORED: usize = 20;

/// Smallest number of draws, even if the first one fits well.
// The first cone goes through two points with their noise; a few more draws find one whose points are better.
pub(super) const MIN_DRAWS: u32 = 6;

/// Sigma of the expected half-angle in radians.
fn sigma_alpha<T: Real>(expected: &Expected<T>) -> T {
    expected.sigma_cos / expected.sin
}

pub(super) fn ray<T: Real>(blocks: &[Block<T>], i: u32) -> Option<V3<T>> {
    blocks.get(i as usize / LANES).map(|b| b.ray(i as usize % LANES))
}

// Above one degree (0.0175) the expected half-angle is worse than that of three points, so that two points would draw
// wrong cones. Every n-th block is scored instead of the first ones, so that the whole edge takes part. A cone must
// cost at most 0.95 of `nothing`, because rounding alone could otherwise make one. The last limit is 0.06 and not a
// tenth, because an inlier still costs its squared distance.
pub(super) fn search<T: Real>(
    blocks: &[Block<T>],
    count: u32,
    expected: &Expected<T>,
    focal_px: T,
    threshold: Threshold<T>,
    config: &Config,
    work: &mut WorkBudget,
) -> Option<Consensus<T>> {
    if count < 3 {
        return None;
    }
    let free = expected.free || sigma_alpha(expected) > T::from_f64(0.0175);
    let limit = limit_px(threshold.px, free, expected, focal_px);
    let limit2 = limit * limit;
    let scored = blocks.len().div_ceil(SCORED).max(1);
    let looked_at = blocks.len().div_ceil(scored);
    let points = looked_at as f64 * LANES as f64;
    let nothing = limit2 * T::from_f64(points);
    let mut best_cost = nothing * T::from_f64(0.95);
    let mut best = None;
    let mut rng = Rng::new(config.seed);
    let mut needed = config.max_draws;
    let mut draws = 0;
    let score_cost = looked_at as u32 * SCORE;
    'draws: while draws < needed.max(MIN_DRAWS).min(config.max_draws) && work.try_spend(DRAW) {
        draws += 1;
        let i = rng.below(count);
        // Points far apart give a precise cone. Points close together find a limb that is a small part of the edge,
        // because most neighbours of a limb point are limb points, too. The reach varies from draw to draw.
        let reach = (count >> (draws % 6)).max(8);
        let mut near = || (i + 1 + rng.below(reach)) % count;
        let (j, k, check) = (near(), near(), near());
        let (Some(a), Some(b)) = (ray(blocks, i), ray(blocks, j)) else { continue };
        let third = if free { ray(blocks, k) } else { None };
        let hypotheses = hypotheses(&a, &b, third, free, expected.cos);
        for (e, c) in hypotheses.into_iter().flatten() {
            let faces = |i: u32| faces_light(blocks, i, &e, c, expected, focal_px);
            if !(faces(i) && faces(j) && faces(check)) || distance2(blocks, check, &e, c) > limit2 {
                continue;
            }
            if !work.try_spend(score_cost) {
                break 'draws;
            }
            let cost = score(blocks, scored, &e, c, limit2);
            if cost < best_cost {
                best_cost = cost;
                best = Some((e, c));
                // With the inlier share w, a draw succeeds with probability w³ (w⁴ with three points). After `needed`
                // draws the probability of a success is 99 %.
                let share = T::one() - cost / nothing;
                needed = required_draws(share * share * share * if free { share } else { T::one() });
            }
        }
    }
    let (e, c) = best?;
    let share = T::one() - best_cost / nothing;
    (share > T::from_f64(0.06)).then_some(Consensus { e, c, draws, all: false })
}

/// Returns the largest distance of an inlier from a drawn cone, in pixels. An error of the half-angle bends the edge by
/// a small part of this error. The limit grows accordingly, at most by three thresholds.
#[inline(always)]
fn limit_px<T: Real>(threshold_px: T, free: bool, expected: &Expected<T>, focal_px: T) -> T {
    let bend = (sigma_alpha(expected) * focal_px * T::from_f64(0.05)).min(threshold_px * T::from_f64(3.0));
    threshold_px + if free { T::ZERO } else { bend }
}

/// Returns the cones through two points with the half-angle of cosine `cos`. With a `free` half-angle, the result is
/// the cone through three points.
#[inline(always)]
fn hypotheses<T: Real>(a: &V3<T>, b: &V3<T>, third: Option<V3<T>>, free: bool, cos: T) -> [Option<(V3<T>, T)>; 2] {
    if free {
        [third.and_then(|third| through_three(a, b, &third)), None]
    } else {
        through_two(a, b, cos).map_or([None; 2], |axes| axes.map(|e| Some((e, cos))))
    }
}

/// Returns whether the lit side of a point lies towards the axis and the Sun lights the body there.
#[inline(always)]
fn faces_light<T: Real>(blocks: &[Block<T>], i: u32, e: &V3<T>, c: T, expected: &Expected<T>, focal_px: T) -> bool {
    let lane = i as usize % LANES;
    let block = blocks.get(i as usize / LANES);
    block.is_some_and(|b| b.is_lit_towards(lane, e) && expected.is_lit(&b.ray(lane), e, c, focal_px))
}

/// Returns the number of draws that give 99 % probability of a success, if one draw succeeds with the probability `p`.
#[inline(always)]
fn required_draws<T: Real>(p: T) -> u32 {
    if p > T::from_f64(0.99) {
        MIN_DRAWS
    } else {
        (T::from_f64(-4.6) / (T::one() - p).ln()).to_i32().clamp(1, 100_000) as u32
    }
}

/// Returns the squared distance of a point from the limb, in px².
fn distance2<T: Real>(blocks: &[Block<T>], i: u32, e: &V3<T>, c: T) -> T {
    let Some(block) = blocks.get(i as usize / LANES) else { return T::from_f64(1e30) };
    let lane = i as usize % LANES;
    let r = c - block.ray(lane).dot(e);
    let [gu, gv] = block.gradient_at(lane, e);
    r * r / (gu * gu + gv * gv).max(T::from_f64(LEAST_GRADIENT2))
}

/// Returns the sum of the squared distances, each at most `limit2`, over every `scored`-th block, in px². Empty lanes
/// count as outliers.
fn score<T: Real>(blocks: &[Block<T>], scored: usize, e: &V3<T>, c: T, limit2: T) -> T {
    let mut total = [T::ZERO; LANES];
    for b in blocks.iter().step_by(scored) {
        let g = b.gradient(e);
        for l in 0..LANES {
            let r = c - (b.s[0][l] * e.x + b.s[1][l] * e.y + b.s[2][l] * e.z);
            let d2 = r * r / (g[0][l] * g[0][l] + g[1][l] * g[1][l]).max(T::from_f64(LEAST_GRADIENT2));
            // Truncated squares prefer the better of two cones with the same inliers, which a count of inliers cannot.
            total[l] += d2.min(limit2);
        }
    }
    sum(&total)
}
