//! Outlier rejection: finds the cone that most points agree on.
//!
//! The default method is random sample consensus (RANSAC) with the minimal solver for a known half-angle, which needs
//! two points. It uses three points if the sigma of the half-angle is above one degree. A further point verifies each
//! hypothesis, so that most wrong hypotheses cost little. The others are scored by truncated squared distances on a
//! part of the points. With 80 % outliers, 574 draws find the limb with a probability of 99 %.

#[cfg(feature = "zju")]
mod mlesac;
mod noise;
#[cfg(feature = "zju")]
mod preverified;
#[cfg(feature = "dlr")]
mod ransac;
#[cfg(any(feature = "dlr", feature = "zju"))]
mod sampled;

use crate::base::keys::{choices, section};
use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::base::rng::Rng;
use crate::geometry::block::{Block, LANES, sum};
use crate::geometry::cone::{through_three, through_two};
use crate::model::body::Expected;
use crate::model::work::{DRAW, SCORE, WorkBudget};

choices! {
    /// How the inliers are found.
    pub enum Method {
        /// RANSAC on two points with the expected half-angle (three points where that is too uncertain); a further
        /// point verifies a draw before it is scored.
        @0 TwoPoint = "two-point";
        /// Every point is an inlier.
        @1 None = "none";
        /// RANSAC on three points; every draw is scored with every point (Braun & Barf 2022, 3.6).
        @- Ransac = "ransac" needs "dlr";
        /// RANSAC on five points, of which two verify the cone through the other three before it is scored (Wang et al.
        /// 2022, 2.3); it needs about 20000 draws.
        @- RansacPreverify = "ransac-preverify" needs "zju";
        /// RANSAC on three points by the likelihood of a mixture (Torr & Zisserman 2000).
        @- Mlesac = "mlesac" needs "zju";
    }
}

section! {
    /// `[reject]` of sensor.toml: the cone that most edge points agree on, and their outliers.
    "reject" pub struct Config: Copy {
        /// How the inliers are found.
        @80 method: Method = Method::TwoPoint, [choice];
        /// Largest distance of an inlier from the limb, px.
        @81 threshold_px: f64 = 3.0, [above 0.0 to 1000.0];
        /// The largest distance is at least this many times the noise from point to point; 0 leaves it at
        /// `threshold_px`.
        ///
        /// It is at most the sigma of the limb height. A threshold that cuts into the noise keeps the points that
        /// happen to lie near some limb. Two sigmas hold 95 % of a limb's points.
        @84 noise_sigma: f64 = 2.0, [0.0 to 100.0];
        /// Seed of the random draws; the same seed gives the same answer.
        @82 seed: u32 = 1, [0.0 to 4294967295.0];
        /// Largest number of draws; 800 find the limb among 80 % of outliers.
        @83 max_draws: u32 = 800, [1.0 to 100000.0];
    }
}

/// Largest distance from the limb at which a point of one edge can be an inlier.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Threshold<T> {
    /// The largest distance, in pixels.
    pub(crate) px: T,
    /// Ratio of the largest distance to `threshold_px`, 1 or more. The largest RMS of the fit grows with it.
    pub(crate) factor: T,
}

impl<T: Real> Threshold<T> {
    /// Uses `threshold_px` of the configuration as it is.
    #[cfg(test)]
    pub(crate) fn from_config(config: &Config) -> Self {
        Self { px: T::from_f64(config.threshold_px), factor: T::one() }
    }
    /// Makes the threshold for the first `count` points of the blocks, which are rays in the order of the edge.
    ///
    /// Noise raises the threshold at most to the sigma of the limb height. Air does not spread a limb farther, so an
    /// edge with more scatter belongs to something else.
    pub(crate) fn new(blocks: &[Block<T>], count: u32, expected: &Expected<T>, focal_px: T, config: &Config) -> Self {
        let told = T::from_f64(config.threshold_px);
        let most = if expected.free { told } else { told.max(expected.limb_sigma_rad() * focal_px) };
        let factor = T::from_f64(config.noise_sigma);
        let px = if most > told && factor > T::ZERO {
            told.max((factor * noise::point_to_point(blocks, count)).min(most))
        } else {
            told
        };
        Self { px, factor: px / told }
    }
}

/// The cone that most points agree on.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Consensus<T> {
    /// Unit axis of the cone, in the camera frame.
    pub(crate) e: V3<T>,
    /// cos of the half-angle of the cone.
    pub(crate) c: T,
    /// Number of draws.
    pub(crate) draws: u32,
    /// Every point is an inlier: the fit leaves none out.
    #[allow(dead_code, reason = "for the estimators behind features")]
    pub(crate) all: bool,
}

/// Largest number of blocks that are scored.
const SCORED: usize = 20;
/// Smallest number of draws, even if the first one fits well.
const FEWEST: u32 = 6;

/// Finds the consensus. A point whose lit side is away from the consensus gets weight 0, because it belongs to another
/// edge. The result is `None` if no cone goes through about a tenth of the points.
pub(crate) fn find<T: Real>(
    blocks: &mut [Block<T>],
    count: u32,
    expected: &Expected<T>,
    focal_px: T,
    threshold: Threshold<T>,
    config: &Config,
    work: &mut WorkBudget,
) -> Option<Consensus<T>> {
    let best = match config.method {
        Method::None => {
            let (a, b) = (ray(blocks, 0)?, ray(blocks, count.saturating_sub(1))?);
            let mid = ray(blocks, count / 2)?;
            let (e, c) = through_three(&a, &mid, &b)?;
            return Some(Consensus { e, c, draws: 1, all: true });
        }
        #[cfg(feature = "dlr")]
        Method::Ransac => return ransac::find(blocks, count, threshold, config, work),
        #[cfg(feature = "zju")]
        Method::RansacPreverify => return preverified::find(blocks, count, threshold, config, work),
        #[cfg(feature = "zju")]
        Method::Mlesac => return mlesac::find(blocks, count, focal_px, threshold, config, work),
        // `Config::check` refuses a method that is not built in.
        _ => search(blocks, count, expected, focal_px, threshold, config, work)?,
    };
    for block in blocks {
        let g = block.gradient(&best.e);
        for lane in 0..LANES {
            let lit = || is_lit(&block.ray(lane), &best.e, best.c, expected);
            if !(block.is_lit_along(lane, [g[0][lane], g[1][lane]]) && lit()) {
                block.weight[lane] = T::ZERO;
            }
        }
    }
    Some(best)
}

/// Sigma of the expected half-angle in radians.
fn sigma_alpha<T: Real>(expected: &Expected<T>) -> T {
    expected.sigma_cos / expected.sin
}

/// Whether the Sun lights the body where the ray touches it. The answer is yes if the direction of the Sun is unknown.
/// The surface normal at this place is (s cos α − e)/sin α.
fn is_lit<T: Real>(s: &V3<T>, e: &V3<T>, c: T, expected: &Expected<T>) -> bool {
    expected.sun.as_ref().is_none_or(|sun| s.dot(sun) * c - e.dot(sun) > T::ZERO)
}

fn ray<T: Real>(blocks: &[Block<T>], i: u32) -> Option<V3<T>> {
    blocks.get(i as usize / LANES).map(|b| b.ray(i as usize % LANES))
}

fn search<T: Real>(
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
    let sigma_alpha = sigma_alpha(expected);
    let free = expected.free || sigma_alpha > T::from_f64(0.0175);
    // An error of the half-angle bends the edge by a small part of this error. The limit grows accordingly, at most by
    // three thresholds.
    let threshold = threshold.px;
    let bend =
        if free { T::ZERO } else { (sigma_alpha * focal_px * T::from_f64(0.05)).min(threshold * T::from_f64(3.0)) };
    let limit2 = (threshold + bend) * (threshold + bend);
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
    'draws: while draws < needed.max(FEWEST).min(config.max_draws) && work.try_spend(DRAW) {
        draws += 1;
        let i = rng.below(count);
        // Points far apart give a precise cone. Points close together find a limb that is a small part of the edge,
        // because most neighbours of a limb point are limb points, too. The reach varies from draw to draw.
        let reach = (count >> (draws % 6)).max(8);
        let mut near = || (i + 1 + rng.below(reach)) % count;
        let (j, k, check) = (near(), near(), near());
        let (Some(a), Some(b)) = (ray(blocks, i), ray(blocks, j)) else { continue };
        let hypotheses = if free {
            let Some(third) = ray(blocks, k) else { continue };
            let Some((e, c)) = through_three(&a, &b, &third) else { continue };
            [Some((e, c)), None]
        } else {
            let Some([e, f]) = through_two(&a, &b, expected.cos) else { continue };
            [Some((e, expected.cos)), Some((f, expected.cos))]
        };
        for (e, c) in hypotheses.into_iter().flatten() {
            let faces = |i: u32| {
                let lane = i as usize % LANES;
                blocks
                    .get(i as usize / LANES)
                    .is_some_and(|b| b.is_lit_towards(lane, &e) && is_lit(&b.ray(lane), &e, c, expected))
            };
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
                let p = share * share * share * if free { share } else { T::one() };
                needed = if p > T::from_f64(0.99) {
                    FEWEST
                } else {
                    (T::from_f64(-4.6) / (T::one() - p).ln()).to_i32().clamp(1, 100_000) as u32
                };
            }
        }
    }
    let (e, c) = best?;
    let share = T::one() - best_cost / nothing;
    (share > T::from_f64(0.06)).then_some(Consensus { e, c, draws, all: false })
}

/// Returns the squared distance of a point from the limb, in px².
fn distance2<T: Real>(blocks: &[Block<T>], i: u32, e: &V3<T>, c: T) -> T {
    let Some(block) = blocks.get(i as usize / LANES) else { return T::from_f64(1e30) };
    let lane = i as usize % LANES;
    let r = c - block.ray(lane).dot(e);
    let [gu, gv] = block.gradient_at(lane, e);
    r * r / (gu * gu + gv * gv).max(T::from_f64(1e-20))
}

/// Returns the sum of the squared distances, each at most `limit2`, over every `scored`-th block, in px². Empty lanes
/// count as outliers.
fn score<T: Real>(blocks: &[Block<T>], scored: usize, e: &V3<T>, c: T, limit2: T) -> T {
    let mut total = [T::ZERO; LANES];
    for b in blocks.iter().step_by(scored) {
        let g = b.gradient(e);
        for l in 0..LANES {
            let r = c - (b.s[0][l] * e.x + b.s[1][l] * e.y + b.s[2][l] * e.z);
            let d2 = r * r / (g[0][l] * g[0][l] + g[1][l] * g[1][l]).max(T::from_f64(1e-20));
            total[l] += d2.min(limit2);
        }
    }
    sum(&total)
}
