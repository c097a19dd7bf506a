//! Classic RANSAC on three points (Fischler & Bolles 1981; Braun & Barf 2022, section 3.6).
//!
//! Three rays determine a cone, its half-angle included: the normal of their plane. Every point is compared with it,
//! and the cone with the most points within the threshold wins. Nothing of what is known beforehand is used, neither
//! the half-angle nor on which side of the edge the light is, and every draw looks at every point: that is what the
//! default, `two-point`, is better at.

use super::{Config, Consensus, ray};
use crate::block::{Block, LANES, sum};
use crate::limb::through_three;
use crate::linalg::V3;
use crate::real::Real;
use crate::rng::Rng;

/// Fewest draws, however well the first one fits.
const FEWEST: u32 = 6;

/// The cone with the most points near it; the others lose their weight. `None` with fewer than three points, or when
/// no cone has more points than the three it goes through.
pub(super) fn keep<T: Real>(blocks: &mut [Block<T>], count: u32, config: &Config) -> Option<Consensus<T>> {
    if count < 3 {
        return None;
    }
    let limit2 = T::of(config.threshold_px * config.threshold_px);
    let mut rng = Rng::new(config.seed);
    let (mut best, mut most) = (None, T::of(3.5));
    let (mut draws, mut needed) = (0, config.max_draws);
    while draws < needed.max(FEWEST).min(config.max_draws) {
        draws += 1;
        let (i, j, k) = (rng.below(count), rng.below(count), rng.below(count));
        let (Some(a), Some(b), Some(c)) = (ray(blocks, i), ray(blocks, j), ray(blocks, k)) else { continue };
        let Some((e, c)) = through_three(&a, &b, &c) else { continue };
        let near = agreeing(blocks, &e, c, limit2);
        if near > most {
            (best, most) = (Some((e, c)), near);
            // With the share w of inliers a draw succeeds with w³: as many as find one with 99 %.
            let w = near / T::of(f64::from(count));
            let p = w * w * w;
            needed = if p > T::of(0.99) {
                FEWEST
            } else {
                (T::of(-4.6) / (T::one() - p).ln()).to_i32().clamp(1, 100_000) as u32
            };
        }
    }
    let (e, c) = best?;
    for block in blocks.iter_mut() {
        let d2 = distances2(block, &e, c);
        for (w, d2) in block.weight.iter_mut().zip(d2) {
            if !(d2 <= limit2) {
                *w = T::ZERO;
            }
        }
    }
    Some(Consensus { e, c, draws, all: false })
}

/// Points that may count within the threshold of a cone.
fn agreeing<T: Real>(blocks: &[Block<T>], e: &V3<T>, c: T, limit2: T) -> T {
    let mut n = [T::ZERO; LANES];
    for b in blocks {
        let d2 = distances2(b, e, c);
        for l in 0..LANES {
            n[l] += if d2[l] <= limit2 { b.weight[l] } else { T::ZERO };
        }
    }
    sum(&n)
}

/// Squared distances of the points from the limb in pixels.
fn distances2<T: Real>(b: &Block<T>, e: &V3<T>, c: T) -> [T; LANES] {
    let g = b.gradient(e);
    core::array::from_fn(|l| {
        let r = c - (b.s[0][l] * e.x + b.s[1][l] * e.y + b.s[2][l] * e.z);
        r * r / (g[0][l] * g[0][l] + g[1][l] * g[1][l]).most(T::of(1e-20))
    })
}
