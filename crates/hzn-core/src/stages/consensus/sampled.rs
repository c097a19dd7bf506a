//! What the published samplers share: cones through three points, compared with every point.

use super::Consensus;
use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::base::rng::Rng;
use crate::geometry::block::{Block, LANES, sum};
use crate::geometry::cone::through_three;

/// Fewest draws, however well the first one fits.
pub(super) const FEWEST: u32 = 6;

/// Most draws that `max_draws` can ask for.
const MOST: u32 = 100_000;

/// A point that may count.
pub(super) fn point<T: Real>(blocks: &[Block<T>], i: u32) -> Option<V3<T>> {
    let (block, lane) = (blocks.get(i as usize / LANES)?, i as usize % LANES);
    (block.weight[lane] > T::ZERO).then(|| block.ray(lane))
}

/// Axis and cos of the half-angle of the cone through three points drawn at random, if they make one.
pub(super) fn drawn<T: Real>(blocks: &[Block<T>], count: u32, rng: &mut Rng) -> Option<(V3<T>, T)> {
    let [i, j, k] = [(); 3].map(|()| rng.below(count));
    through_three(&point(blocks, i)?, &point(blocks, j)?, &point(blocks, k)?)
}

/// Draws after which one of three inliers was among them with 99 %, when the share `w` of the points are inliers.
pub(super) fn needed<T: Real>(w: T) -> u32 {
    let p = w * w * w;
    if p > T::from_f64(0.99) {
        FEWEST
    } else if p > T::from_f64(1e-4) {
        (T::from_f64(-4.6) / (T::one() - p).ln()).to_i32().clamp(1, MOST as i32) as u32
    } else {
        MOST
    }
}

/// Squared distances of the points from the limb in pixels.
pub(super) fn distances2<T: Real>(b: &Block<T>, e: &V3<T>, c: T) -> [T; LANES] {
    let g = b.gradient(e);
    core::array::from_fn(|l| {
        let r = c - (b.s[0][l] * e.x + b.s[1][l] * e.y + b.s[2][l] * e.z);
        r * r / (g[0][l] * g[0][l] + g[1][l] * g[1][l]).max(T::from_f64(1e-20))
    })
}

/// Number of points that may count within the threshold of a cone.
pub(super) fn agreeing<T: Real>(blocks: &[Block<T>], e: &V3<T>, c: T, limit2: T) -> T {
    let mut n = [T::ZERO; LANES];
    for b in blocks {
        let d2 = distances2(b, e, c);
        for l in 0..LANES {
            n[l] += if d2[l] <= limit2 { b.weight[l] } else { T::ZERO };
        }
    }
    sum(&n)
}

/// The consensus on the cone that was found; the points beyond the threshold lose their weight.
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

/// Takes the weight from the points beyond the threshold.
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
