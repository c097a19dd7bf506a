//! Outlier rejection: the cone that most points agree on.
//!
//! Random sample consensus on the minimal solver for a known half-angle, two points; on three points where the
//! half-angle is known to no better than a degree. A hypothesis is first verified on one further point, so that most
//! wrong ones cost next to nothing, then scored by truncated squares on a part of the points. With 80 % outliers 574
//! draws find the limb with 99 % probability.

#[cfg(feature = "zju")]
mod mlesac;
mod noise;
#[cfg(feature = "zju")]
mod preverified;
#[cfg(feature = "dlr")]
mod ransac;
#[cfg(any(feature = "dlr", feature = "zju"))]
mod sampled;

use crate::base::error::{ConfigError, Limit, above, between, require};
use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::base::rng::Rng;
use crate::geometry::block::{Block, LANES, sum};
use crate::geometry::cone::{through_three, through_two};
use crate::model::body::Expected;
use crate::model::work::{DRAW, SCORE, WorkBudget};

/// How outliers are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Method {
    /// RANSAC on two points with the expected half-angle (three points when it is too uncertain), verified on one
    /// further point before it is scored.
    #[default]
    TwoPoint,
    /// Every point is taken.
    None,
    /// RANSAC on three points, every point counted in every draw (Braun & Barf 2022, 3.6).
    #[cfg(feature = "dlr")]
    Ransac,
    /// RANSAC on five points, of which two verify the cone through the others before it is counted (Wang et al. 2022,
    /// 2.3). Give it 20000 draws.
    #[cfg(feature = "zju")]
    RansacPreverify,
    /// RANSAC on three points by the likelihood of a mixture (Torr & Zisserman 2000).
    #[cfg(feature = "zju")]
    Mlesac,
}

/// `[reject]` of sensor.toml.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct Config {
    /// How outliers are found.
    pub method: Method,
    /// Distance from the limb in pixels up to which a point can be an inlier, above 0 to 1000.
    pub threshold_px: f64,
    /// The threshold is at least this many times the noise of the edge from point to point, 0 to 100, but no more than
    /// the sigma of the limb's height; 0 leaves it at `threshold_px`. A threshold that cuts into the noise keeps the points
    /// that happen to lie near some limb. Two sigmas hold 95 % of a limb's points.
    pub noise_sigma: f64,
    /// Seed of the sampler: the same seed gives the same answer.
    pub seed: u32,
    /// Most draws, 1 to 100000. 800 find the limb among 80 % of outliers.
    pub max_draws: u32,
}

impl Default for Config {
    fn default() -> Self {
        Self { method: Method::TwoPoint, threshold_px: 3.0, noise_sigma: 2.0, seed: 1, max_draws: 800 }
    }
}

impl Config {
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        above("reject.threshold_px", self.threshold_px, 0.0)?;
        between("reject.threshold_px", self.threshold_px, 0.0, 1000.0)?;
        between("reject.noise_sigma", self.noise_sigma, 0.0, 100.0)?;
        let draws = f64::from(self.max_draws);
        require((1..=100_000).contains(&self.max_draws), "reject.max_draws", draws, Limit::Between(1.0, 1e5))
    }
}

/// The distance from the limb up to which a point of one edge can be an inlier.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Threshold<T> {
    /// The distance in pixels.
    pub(crate) px: T,
    /// The distance over `threshold_px`, 1 or more. The largest RMS of the fit grows with it.
    pub(crate) raised: T,
}

impl<T: Real> Threshold<T> {
    /// `threshold_px` as it was told.
    #[cfg(test)]
    pub(crate) fn told(config: &Config) -> Self {
        Self { px: T::from_f64(config.threshold_px), raised: T::one() }
    }
    /// The threshold for the first `count` points of the blocks, which are rays in the order of the edge.
    ///
    /// Noise raises it to no more than the sigma of the limb's own height. The air spreads a limb no farther, so an edge
    /// that scatters more belongs to something else.
    pub(crate) fn new(blocks: &[Block<T>], count: u32, expected: &Expected<T>, focal_px: T, config: &Config) -> Self {
        let told = T::from_f64(config.threshold_px);
        let most = if expected.free { told } else { told.max(expected.limb_sigma_rad() * focal_px) };
        let factor = T::from_f64(config.noise_sigma);
        let px = if most > told && factor > T::ZERO {
            told.max((factor * noise::point_to_point(blocks, count)).min(most))
        } else {
            told
        };
        Self { px, raised: px / told }
    }
}

/// What most points agree on.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Consensus<T> {
    /// Axis of the cone.
    pub(crate) e: V3<T>,
    /// cos of its half-angle.
    pub(crate) c: T,
    /// Draws made.
    pub(crate) draws: u32,
    /// No point is to be left out.
    #[allow(dead_code, reason = "for the estimators behind features")]
    pub(crate) all: bool,
}

/// Blocks that are scored.
const SCORED: usize = 20;
/// Fewest draws, however well the first one fits.
const FEWEST: u32 = 6;

/// Finds the consensus, and takes the weight from the points whose lit side lies away from it: they are edges of
/// something else. `None` when no cone goes through a tenth of the points.
pub(crate) fn keep<T: Real>(
    blocks: &mut [Block<T>],
    count: u32,
    expected: &Expected<T>,
    focal_px: T,
    threshold: Threshold<T>,
    config: &Config,
    work: &mut WorkBudget,
) -> Option<Consensus<T>> {
    let best = match config.method {
        Method::TwoPoint => search(blocks, count, expected, focal_px, threshold, config, work)?,
        Method::None => {
            let (a, b) = (ray(blocks, 0)?, ray(blocks, count.saturating_sub(1))?);
            let mid = ray(blocks, count / 2)?;
            let (e, c) = through_three(&a, &mid, &b)?;
            return Some(Consensus { e, c, draws: 1, all: true });
        }
        #[cfg(feature = "dlr")]
        Method::Ransac => return ransac::keep(blocks, count, threshold, config, work),
        #[cfg(feature = "zju")]
        Method::RansacPreverify => return preverified::keep(blocks, count, threshold, config, work),
        #[cfg(feature = "zju")]
        Method::Mlesac => return mlesac::keep(blocks, count, focal_px, threshold, config, work),
    };
    for block in blocks {
        let g = block.gradient(&best.e);
        for lane in 0..LANES {
            let lit = || is_lit(&block.ray(lane), &best.e, best.c, expected);
            if !(block.faces_along(lane, [g[0][lane], g[1][lane]]) && lit()) {
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

/// Whether the Sun lights the body where the ray touches it; yes, where its direction is unknown. The normal there is
/// (s cos α − e)/sin α.
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
    // An error of the half-angle bends the edge by a small part of itself: room for it, within reason.
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
        // Far apart for precision, close together for a limb that is a small part of the edge: there, neighbours of a
        // limb point are limb points more often than not.
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
                    .is_some_and(|b| b.faces(lane, &e) && is_lit(&b.ray(lane), &e, c, expected))
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
                // With the inlier share w a draw succeeds with w³ (w⁴ on three points): 99 % of finding a better one.
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

/// Squared distance of a point from the limb in pixels.
fn distance2<T: Real>(blocks: &[Block<T>], i: u32, e: &V3<T>, c: T) -> T {
    let Some(block) = blocks.get(i as usize / LANES) else { return T::from_f64(1e30) };
    let lane = i as usize % LANES;
    let r = c - block.ray(lane).dot(e);
    let [gu, gv] = block.gradient_at(lane, e);
    r * r / (gu * gu + gv * gv).max(T::from_f64(1e-20))
}

/// Sum of squared distances, each at most `limit2`, over every `scored`-th block. Empty lanes count as outliers.
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
