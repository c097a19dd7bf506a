//! MLESAC (Torr & Zisserman 2000): RANSAC that maximises the likelihood instead of the number of points.
//!
//! The distance d of a point from the limb has a normal distribution with standard deviation σ if the point is an
//! inlier. Otherwise it has a uniform distribution over the range ν. For every hypothesis, a few steps of
//! expectation-maximisation find the share γ of inliers. The hypothesis with the smallest −Σ ln(γ N(d; σ) + (1 − γ)/ν)
//! wins. Every draw evaluates every point several times, with one exponential each.

use super::config::Config;
use super::inliers::{Consensus, Threshold};
use super::sampled::{conclude, distances2, draw_cone, required_draws};
use super::two_point::MIN_DRAWS;
use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::base::rng::Rng;
use crate::geometry::block::{Block, LANES, sum};
use crate::model::work::{DRAW, LIKELIHOOD, WorkBudget};

/// Number of steps that find the share of inliers.
const STEPS: usize = 3;
/// The threshold in standard deviations: 95 % of the inliers are within it.
const SIGMAS: f64 = 1.96;

/// Finds the most likely cone; points beyond the threshold get weight 0. The result is `None` with fewer than three
/// points, or if hardly any points are on a cone.
pub(super) fn find<T: Real>(
    blocks: &mut [Block<T>],
    count: u32,
    focal_px: T,
    threshold: Threshold<T>,
    config: &Config,
    work: &mut WorkBudget,
) -> Option<Consensus<T>> {
    if count < 3 {
        return None;
    }
    // Outliers are up to one radian from the limb, on both sides.
    // The threshold is turned into a sigma, so that all methods have the same key.
    let mixture = Mixture { sigma: threshold.px / T::from_f64(SIGMAS), range: focal_px * T::from_f64(2.0) };
    let mut rng = Rng::new(config.seed);
    let mut best: Option<(V3<T>, T, T)> = None;
    let (mut draws, mut enough) = (0, config.max_draws);
    let a_draw = DRAW + blocks.len() as u32 * LIKELIHOOD;
    while draws < enough.max(MIN_DRAWS).min(config.max_draws) && work.try_spend(a_draw) {
        draws += 1;
        let Some((e, c)) = draw_cone(blocks, count, &mut rng) else { continue };
        let (cost, share) = mixture.cost(blocks, &e, c);
        if best.is_none_or(|(_, _, least)| cost < least) && share * T::from_f64(f64::from(count)) > T::from_f64(3.5) {
            best = Some((e, c, cost));
            enough = required_draws(share);
        }
    }
    let cone = best.map(|(e, c, _)| (e, c));
    conclude(blocks, cone, threshold.px * threshold.px, draws)
}

/// Mixture of inliers and outliers: standard deviation of the inliers, and range of the outliers, in pixels.
struct Mixture<T> {
    sigma: T,
    range: T,
}

impl<T: Real> Mixture<T> {
    /// Returns the density of the inliers at a squared distance. It is 0 beyond eight standard deviations, where the
    /// numbers would become so small that computing is slow.
    #[inline]
    fn density(&self, d2: T) -> T {
        let z2 = d2 / (self.sigma * self.sigma);
        if z2 < T::from_f64(64.0) {
            T::from_f64(0.398_942_280_401_432_7) / self.sigma * (z2 * T::from_f64(-0.5)).exp()
        } else {
            T::ZERO
        }
    }

    /// Returns −Σ ln of the likelihood, and the share of inliers.
    fn cost(&self, blocks: &[Block<T>], e: &V3<T>, c: T) -> (T, T) {
        // Nothing is known of the share before, so that the steps begin in the middle.
        let mut share = T::from_f64(0.5);
        for _ in 0..STEPS {
            let outlier = (T::one() - share) / self.range;
            let (mut inliers, mut points) = ([T::ZERO; LANES], [T::ZERO; LANES]);
            for b in blocks {
                let d2 = distances2(b, e, c);
                for l in 0..LANES {
                    let inlier = share * self.density(d2[l]);
                    inliers[l] += b.weight[l] * inlier / (inlier + outlier);
                    points[l] += b.weight[l];
                }
            }
            // The share is neither 0 nor 1, so that the logarithm is finite.
            share = (sum(&inliers) / sum(&points).max(T::one())).max(T::from_f64(1e-3)).min(T::from_f64(0.999));
        }
        let outlier = (T::one() - share) / self.range;
        let mut cost = [T::ZERO; LANES];
        for b in blocks {
            let d2 = distances2(b, e, c);
            for l in 0..LANES {
                cost[l] -= b.weight[l] * (share * self.density(d2[l]) + outlier).ln();
            }
        }
        (sum(&cost), share)
    }
}
