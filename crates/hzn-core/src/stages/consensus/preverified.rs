//! RANSAC with pre-verification (Wang et al. 2022, 2.3).
//!
//! Five points are drawn; three make a cone, and only if the other two lie on it as well, every point is compared with
//! it. So most wrong hypotheses cost two comparisons. It ends when half of the points agree, or after k_max hypotheses.
//!
//! k_max by (25), ln(1 − p)/ln(1 − (1 − r)³) with p = 90 % and a share r = 80 % of outliers, is printed as 286; rounded
//! up it is 287. And it can only count the *accepted* hypotheses: a draw comes through the test with all five points on
//! the limb, which needs 7195 draws for the same p. With 286 draws in all, 8.7 % of such pictures are solved. Draws are
//! bounded by `max_draws`.

use super::sampled::{agreeing, conclude, distances2, point};
use super::{Config, Consensus, Threshold};
use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::base::rng::Rng;
use crate::geometry::block::{Block, LANES};
use crate::geometry::cone::through_three;
use crate::model::work::{DRAW, SCORE, WorkBudget};

/// k_max.
const HYPOTHESES: u32 = 287;
/// Drawn points.
const SAMPLE: usize = 5;

/// The accepted cone with the most points near it; the others lose their weight. `None` with fewer than five points,
/// or when no draw was accepted.
pub(super) fn keep<T: Real>(
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
    let mut rng = Rng::new(config.seed);
    let (mut best, mut most) = (None, T::ZERO);
    let (mut draws, mut hypotheses) = (0, 0);
    while draws < config.max_draws && hypotheses < HYPOTHESES && work.try_spend(DRAW) {
        draws += 1;
        let sample = [(); SAMPLE].map(|()| rng.below(count));
        let Some((e, c)) = verified(blocks, sample, limit2) else { continue };
        hypotheses += 1;
        if !work.try_spend(blocks.len() as u32 * SCORE) {
            break;
        }
        let near = agreeing(blocks, &e, c, limit2);
        if near > most {
            (best, most) = (Some((e, c)), near);
            if near * T::from_f64(2.0) > T::from_f64(f64::from(count)) {
                break;
            }
        }
    }
    conclude(blocks, best, limit2, draws)
}

/// The cone through the first three points, if the others lie on it too.
fn verified<T: Real>(blocks: &[Block<T>], sample: [u32; SAMPLE], limit2: T) -> Option<(V3<T>, T)> {
    let [i, j, k, m, n] = sample;
    // A point drawn twice verifies nothing.
    if m == n || [i, j, k].contains(&m) || [i, j, k].contains(&n) {
        return None;
    }
    let (e, c) = through_three(&point(blocks, i)?, &point(blocks, j)?, &point(blocks, k)?)?;
    for check in [m, n] {
        point(blocks, check)?;
        let d2 = distances2(blocks.get(check as usize / LANES)?, &e, c);
        if !(d2[check as usize % LANES] <= limit2) {
            return None;
        }
    }
    Some((e, c))
}
