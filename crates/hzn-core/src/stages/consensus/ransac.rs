//! Classic RANSAC on three points (Fischler & Bolles 1981; Braun & Barf 2022, section 3.6).
//!
//! Three rays determine a cone with its half-angle: the axis is the normal of the plane through the rays. Every point
//! is compared with the cone, and the cone with the most points within the threshold wins. The method uses no prior
//! knowledge: neither the half-angle nor the side of the edge on which the light is. Every draw is compared with every
//! point. The default method, `two-point`, is better in these respects.

use super::config::Config;
use super::inliers::{Consensus, Threshold};
use super::sampled::{conclude, count_inliers, draw_cone, required_draws};
use super::two_point::MIN_DRAWS;
use crate::base::real::Real;
use crate::base::rng::Rng;
use crate::geometry::block::Block;
use crate::model::work::{DRAW, SCORE, WorkBudget};

/// Finds the cone with the most points near it; the other points get weight 0. The result is `None` with fewer than
/// three points, or if no cone has more points than the three through which it goes.
pub(super) fn find<T: Real>(
    blocks: &mut [Block<T>],
    count: u32,
    threshold: Threshold<T>,
    config: &Config,
    work: &mut WorkBudget,
) -> Option<Consensus<T>> {
    if count < 3 {
        return None;
    }
    let limit2 = threshold.px * threshold.px;
    let mut rng = Rng::new(config.seed);
    // A cone always goes through its own three points, therefore more than three must agree.
    let (mut best, mut most) = (None, T::from_f64(3.5));
    let (mut draws, mut enough) = (0, config.max_draws);
    // Every draw is compared with every point, so that its whole cost is known before it.
    let a_draw = DRAW + blocks.len() as u32 * SCORE;
    while draws < enough.max(MIN_DRAWS).min(config.max_draws) && work.try_spend(a_draw) {
        draws += 1;
        let Some((e, c)) = draw_cone(blocks, count, &mut rng) else { continue };
        let near = count_inliers(blocks, &e, c, limit2);
        if near > most {
            (best, most) = (Some((e, c)), near);
            enough = required_draws(near / T::from_f64(f64::from(count)));
        }
    }
    conclude(blocks, best, limit2, draws)
}
