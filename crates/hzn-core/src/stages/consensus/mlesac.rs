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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::block::Lit;
    use crate::geometry::camera::{self, Camera};
    use crate::geometry::pixel::ImagePoint;
    use crate::stages::rays;
    use std::vec::Vec;

    const FOCAL_PX: f64 = 1000.0;
    const RADIUS_PX: f64 = 100.0;

    /// Makes points around a circle, each with its distance outside of the circle in pixels.
    fn points(off_px: &[f64]) -> Vec<Block<f64>> {
        let camera = Camera::try_new(&camera::Config::ideal(camera::Model::Pinhole, 640, 480, FOCAL_PX)).unwrap();
        let mut blocks: Vec<_> = off_px.chunks(LANES).map(|_| Block::default()).collect();
        for (i, off) in off_px.iter().enumerate() {
            let (s, c) = libm::sincos(0.7 * i as f64);
            let at = ImagePoint { u: 319.5 + (RADIUS_PX + off) * c, v: 239.5 + (RADIUS_PX + off) * s };
            blocks[i / LANES].set_point(i % LANES, at, Lit::Left);
        }
        rays::to_rays(&camera, &mut blocks);
        blocks
    }

    /// Returns the cosine of the half-angle of the circle, about the optical axis.
    fn half_angle_cos() -> f64 {
        libm::cos(libm::atan(RADIUS_PX / FOCAL_PX))
    }

    #[test]
    fn the_density_is_normal_up_to_eight_sigmas() {
        let mixture = Mixture { sigma: 0.5, range: 2000.0 };
        let normal = |d: f64| libm::exp(-0.5 * d * d / 0.25) / (0.5 * (2.0 * core::f64::consts::PI).sqrt());
        for d in [0.0, 0.3, 1.0, 3.9] {
            assert!((mixture.density(d * d) / normal(d) - 1.0).abs() < 1e-12, "{d}");
        }
        assert_eq!(mixture.density(16.001), 0.0);
    }

    #[test]
    fn the_cost_is_the_likelihood_of_the_mixture() {
        // Twelve points are inliers at distances below a sigma, and the others are far away. One counts half.
        let off_px: Vec<f64> = (0..24).map(|i| if i % 2 == 0 { 0.04 * f64::from(i) - 0.4 } else { 30.0 }).collect();
        let (mut blocks, e, c) = (points(&off_px), V3::new(0.0, 0.0, 1.0), half_angle_cos());
        blocks[1].weight[2] = 0.5;
        let mixture = Mixture { sigma: 0.5, range: 2000.0 };
        let (cost, share) = mixture.cost(&blocks, &e, c);
        let weight = |i: usize| if i == 10 { 0.5 } else { 1.0 };
        // Of a circle about the optical axis, a pixel is the same angle everywhere.
        let density =
            |i: usize| if i.is_multiple_of(2) { 0.797_884_56 * libm::exp(-2.0 * off_px[i] * off_px[i]) } else { 0.0 };
        let mut want = 0.5;
        for _ in 0..3 {
            let inlier = |i: usize| want * density(i) / (want * density(i) + (1.0 - want) / 2000.0);
            want = (0..24).map(|i| weight(i) * inlier(i)).sum::<f64>() / 23.5;
        }
        assert!((share - want).abs() < 1e-5 && (0.48..0.49).contains(&share), "{share} {want}");
        let likelihood = |i: usize| -weight(i) * libm::log(want * density(i) + (1.0 - want) / 2000.0);
        let all: f64 = (0..24).map(likelihood).sum();
        assert!((cost / all - 1.0).abs() < 1e-4, "{cost} {all}");
        // The share is never 0 or 1.
        assert_eq!(mixture.cost(&points(&[0.0; 8]), &e, c).1, 0.999);
        assert_eq!(mixture.cost(&points(&[50.0; 8]), &e, c).1, 1e-3);
    }

    fn found(off_px: &[f64], max_draws: u32) -> (Option<Consensus<f64>>, Vec<Block<f64>>, u32) {
        let (mut blocks, mut work) = (points(off_px), WorkBudget::unlimited());
        let config = Config { max_draws, ..Config::default() };
        let threshold = Threshold { px: 2.0, factor: 1.0 };
        let cone = find(&mut blocks, off_px.len() as u32, FOCAL_PX, threshold, &config, &mut work);
        (cone, blocks, work.spent())
    }

    #[test]
    fn the_circle_is_found_among_outliers_and_these_get_no_weight() {
        let off_px: Vec<f64> = (0..48u32).map(|i| if i % 3 == 0 { 5.0 + f64::from(i * i % 37) } else { 0.0 }).collect();
        let (cone, blocks, spent) = found(&off_px, 800);
        let cone = cone.unwrap();
        assert!((cone.c - half_angle_cos()).abs() < 1e-9 && cone.e.z > 1.0 - 1e-9 && !cone.all);
        for (i, off) in off_px.iter().enumerate() {
            assert_eq!(blocks[i / LANES].weight[i % LANES], f64::from(u8::from(*off == 0.0)), "{i}");
        }
        // A third of outliers needs 14 draws with 99 %: ln 0.01/ln(1 − (2/3)³).
        assert!((10..40).contains(&cone.draws), "{}", cone.draws);
        assert_eq!(spent, cone.draws * (DRAW + 6 * LIKELIHOOD));
    }

    #[test]
    fn three_points_on_a_cone_are_no_consensus() {
        // Each of these cones goes through three of five points.
        let (cone, ..) = found(&[0.0, 40.0, -30.0, 90.0, 15.0], 100);
        assert!(cone.is_none());
        let (cone, ..) = found(&[0.0, 0.0, 0.0, 0.0, 15.0], 100);
        assert!(cone.is_some());
        assert!(found(&[0.0, 0.0], 100).0.is_none());
    }

    #[test]
    fn no_more_cones_are_drawn_than_the_limit_and_the_work_allow() {
        let off_px: Vec<f64> = (0..40u32).map(|i| if i < 12 { 0.0 } else { f64::from(i * i % 61) + 4.0 }).collect();
        assert_eq!(found(&off_px, 25).0.unwrap().draws, 25);
        let mut blocks = points(&off_px);
        let limits = crate::model::work::Config { max_work: Some(20 * (DRAW + 5 * LIKELIHOOD)) };
        let mut work = WorkBudget::new(&limits, 0, crate::model::work::POINT);
        let threshold = Threshold { px: 2.0, factor: 1.0 };
        let cone = find(&mut blocks, 40, FOCAL_PX, threshold, &Config::default(), &mut work);
        assert_eq!((cone.map(|cone| cone.draws), work.remaining()), (Some(20), 0));
    }
}
