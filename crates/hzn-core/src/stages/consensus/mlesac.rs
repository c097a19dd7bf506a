//! MLESAC (Torr & Zisserman 2000): RANSAC with the likelihood in place of the number of points.
//!
//! A point's distance d from the limb comes from a normal distribution of standard deviation σ if it is an inlier, and
//! from an even one over ν otherwise; the share γ of inliers is found for every hypothesis by a few steps of
//! expectation and maximisation. The hypothesis with the least −Σ ln(γ N(d; σ) + (1 − γ)/ν) wins. Every point is looked
//! at several times in every draw, with an exponential each.

use super::sampled::{FEWEST, conclude, distances2, drawn, needed};
use super::{Config, Consensus, Threshold};
use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::base::rng::Rng;
use crate::geometry::block::{Block, LANES, sum};
use crate::model::work::{DRAW, LIKELIHOOD, WorkBudget};

/// Steps for the share of inliers.
const STEPS: usize = 3;
/// Standard deviations within the threshold: 95 % of the inliers.
const SIGMAS: f64 = 1.96;

/// The most likely cone; points farther from it than the threshold lose their weight. `None` with fewer than three
/// points, or when hardly any is on a cone.
pub(super) fn keep<T: Real>(
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
    // Outliers lie up to a radian from the limb, to both sides.
    let mixture = Mixture { sigma: threshold.px / T::from_f64(SIGMAS), range: focal_px * T::from_f64(2.0) };
    let mut rng = Rng::new(config.seed);
    let mut best: Option<(V3<T>, T, T)> = None;
    let (mut draws, mut enough) = (0, config.max_draws);
    let a_draw = DRAW + blocks.len() as u32 * LIKELIHOOD;
    while draws < enough.max(FEWEST).min(config.max_draws) && work.try_spend(a_draw) {
        draws += 1;
        let Some((e, c)) = drawn(blocks, count, &mut rng) else { continue };
        let (cost, share) = mixture.cost(blocks, &e, c);
        if best.is_none_or(|(_, _, least)| cost < least) && share * T::from_f64(f64::from(count)) > T::from_f64(3.5) {
            best = Some((e, c, cost));
            enough = needed(share);
        }
    }
    let cone = best.map(|(e, c, _)| (e, c));
    conclude(blocks, cone, threshold.px * threshold.px, draws)
}

/// Inliers and outliers: standard deviation of the ones, range of the others, in pixels.
struct Mixture<T> {
    sigma: T,
    range: T,
}

impl<T: Real> Mixture<T> {
    /// Of the inliers, at a squared distance; nothing beyond eight standard deviations, where numbers become too small
    /// to be computed with at speed.
    #[inline]
    fn density(&self, d2: T) -> T {
        let z2 = d2 / (self.sigma * self.sigma);
        if z2 < T::from_f64(64.0) {
            T::from_f64(0.398_942_280_401_432_7) / self.sigma * (z2 * T::from_f64(-0.5)).exp()
        } else {
            T::ZERO
        }
    }

    /// −Σ ln of the likelihood, and the share of inliers.
    fn cost(&self, blocks: &[Block<T>], e: &V3<T>, c: T) -> (T, T) {
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
            // Neither all nor none, so that the logarithm is finite.
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
