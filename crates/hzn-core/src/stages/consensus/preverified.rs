//! RANSAC with pre-verification (Wang et al. 2022, 2.3).
//!
//! Five points are drawn, and three of them define a cone. The cone is compared with every point only if the mean
//! deviation of the five is below the threshold; that of the first three is 0. Most wrong hypotheses therefore cost
//! only two comparisons. The search ends when more than half of the points agree, or after k_max hypotheses.
//!
//! Equation (25) gives k_max = ln(1 − p)/ln(1 − (1 − r)³). With p = 90 % and a share r = 80 % of outliers the paper
//! prints 286; rounded up it is 287. This number can only count *accepted* hypotheses. A draw passes the test only if
//! all five points are on the limb, which needs 7195 draws for the same p. With 286 draws in all, only 8.7 % of these
//! pictures are solved. Here `max_draws` limits the number of draws.

use super::config::Config;
use super::inliers::{Consensus, Threshold};
use super::sampled::{conclude, count_inliers, distances2, point};
use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::base::rng::Rng;
use crate::geometry::block::{Block, LANES};
use crate::geometry::cone::through_three;
use crate::model::work::{DRAW, SCORE, WorkBudget};

/// Largest number of accepted hypotheses, k_max.
// The number counts accepted cones only: with 286 draws in all, 29 % of the pictures with 80 % of outliers were solved
// instead of 99 %.
const HYPOTHESES: u32 = 287;
/// Number of points in a draw.
const SAMPLE: usize = 5;

/// Finds the accepted cone with the most points near it; the other points get weight 0. The result is `None` with fewer
/// than five points, or if no draw is accepted.
pub(super) fn find<T: Real>(
    blocks: &mut [Block<T>],
    count: u32,
    threshold: Threshold<T>,
    config: &Config,
    work: &mut WorkBudget,
) -> Option<Consensus<T>> {
    if count < SAMPLE as u32 {
        return None;
    }
    let limit2 = threshold.px * threshold.px;
    let most_sum = threshold.px * T::from_f64(SAMPLE as f64);
    let mut rng = Rng::new(config.seed);
    let (mut best, mut most) = (None, T::ZERO);
    let (mut draws, mut hypotheses) = (0, 0);
    while draws < config.max_draws && hypotheses < HYPOTHESES && work.try_spend(DRAW) {
        draws += 1;
        let sample = [(); SAMPLE].map(|()| rng.below(count));
        let Some((e, c)) = verified(blocks, sample, most_sum) else { continue };
        hypotheses += 1;
        if !work.try_spend(blocks.len() as u32 * SCORE) {
            break;
        }
        let near = count_inliers(blocks, &e, c, limit2);
        if near > most {
            (best, most) = (Some((e, c)), near);
            // More than half cannot be beaten by another edge, which is why the paper ends here. Beyond 50 % of
            // outliers it never happens, and the method is then slower than classic RANSAC.
            if near * T::from_f64(2.0) > T::from_f64(f64::from(count)) {
                break;
            }
        }
    }
    conclude(blocks, best, limit2, draws)
}

/// Returns the cone through the first three points if the deviations of the other two are `most_sum` together, at most.
fn verified<T: Real>(blocks: &[Block<T>], sample: [u32; SAMPLE], most_sum: T) -> Option<(V3<T>, T)> {
    let [i, j, k, m, n] = sample;
    // A point that is drawn twice verifies nothing.
    if m == n || [i, j, k].contains(&m) || [i, j, k].contains(&n) {
        return None;
    }
    let (e, c) = through_three(&point(blocks, i)?, &point(blocks, j)?, &point(blocks, k)?)?;
    let mut sum = T::ZERO;
    for check in [m, n] {
        point(blocks, check)?;
        let d2 = distances2(blocks.get(check as usize / LANES)?, &e, c);
        sum += d2[check as usize % LANES].sqrt();
        if !(sum <= most_sum) {
            return None;
        }
    }
    Some((e, c))
}
