//! Common parts of the published samplers: cones through three points that are compared with every point.

use super::inliers::Consensus;
use super::two_point::MIN_DRAWS;
use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::base::rng::Rng;
use crate::geometry::block::{Block, LANES, LEAST_GRADIENT2, sum};
use crate::geometry::cone::through_three;

/// Largest value of `max_draws`.
const MOST: u32 = 100_000;

/// Returns the ray of a point with a weight above 0.
pub(super) fn point<T: Real>(blocks: &[Block<T>], i: u32) -> Option<V3<T>> {
    let (block, lane) = (blocks.get(i as usize / LANES)?, i as usize % LANES);
    (block.weight[lane] > T::ZERO).then(|| block.ray(lane))
}

/// Draws three points at random and returns the axis and the cos of the half-angle of the cone through them, if there
/// is one.
pub(super) fn draw_cone<T: Real>(blocks: &[Block<T>], count: u32, rng: &mut Rng) -> Option<(V3<T>, T)> {
    let [i, j, k] = [(); 3].map(|()| rng.below(count));
    through_three(&point(blocks, i)?, &point(blocks, j)?, &point(blocks, k)?)
}

/// Returns the number of draws that give 99 % probability of a draw with three inliers, if the share `w` of the points
/// are inliers.
pub(super) fn required_draws<T: Real>(w: T) -> u32 {
    let p = w * w * w;
    // For p = 1 the logarithm would be infinite.
    if p > T::from_f64(0.99) {
        MIN_DRAWS
    } else if p > T::from_f64(1e-4) {
        // −4.6 is ln 0.01: the probability that no draw succeeds is then one percent.
        (T::from_f64(-4.6) / (T::one() - p).ln()).to_i32().clamp(1, MOST as i32) as u32
    } else {
        // For a smaller p, 1 − p keeps few digits of p in single precision, so that the quotient would be noise.
        MOST
    }
}

/// Returns the squared distances of the points from the limb, in px².
pub(super) fn distances2<T: Real>(b: &Block<T>, e: &V3<T>, c: T) -> [T; LANES] {
    let g = b.gradient(e);
    core::array::from_fn(|l| {
        let r = c - (b.s[0][l] * e.x + b.s[1][l] * e.y + b.s[2][l] * e.z);
        // A cleared point has no gradient; the floor turns it into a very large distance instead of NaN.
        r * r / (g[0][l] * g[0][l] + g[1][l] * g[1][l]).max(T::from_f64(LEAST_GRADIENT2))
    })
}

/// Returns the number of points with a weight that are within the threshold of a cone.
pub(super) fn count_inliers<T: Real>(blocks: &[Block<T>], e: &V3<T>, c: T, limit2: T) -> T {
    let mut n = [T::ZERO; LANES];
    for b in blocks {
        let d2 = distances2(b, e, c);
        for l in 0..LANES {
            n[l] += if d2[l] <= limit2 { b.weight[l] } else { T::ZERO };
        }
    }
    sum(&n)
}

/// Returns the consensus for the cone that was found. Points beyond the threshold get weight 0.
pub(super) fn conclude<T: Real>(
    blocks: &mut [Block<T>],
    cone: Option<(V3<T>, T)>,
    limit2: T,
    draws: u32,
) -> Option<Consensus<T>> {
    let (e, c) = cone?;
    leave_out(blocks, &e, c, limit2);
    Some(Consensus { e, c, draws, all: false })
}

/// Sets the weight of the points beyond the threshold to 0.
fn leave_out<T: Real>(blocks: &mut [Block<T>], e: &V3<T>, c: T, limit2: T) {
    for block in blocks {
        let d2 = distances2(block, e, c);
        for (w, d2) in block.weight.iter_mut().zip(d2) {
            if !(d2 <= limit2) {
                *w = T::ZERO;
            }
        }
    }
}
