//! Sum over all pairs of points whose errors are a Gauss-Markov process along the edge.
//!
//! Points that are much closer together than the correlation length L have nearly the same error, so that one of them
//! stands for all. With the distance Δ between the points of the sum, the sum replaces the integral of exp(−|s|/L), 2
//! L, by Δ coth(Δ/2L) ≈ 2 L (1 + Δ²/12L²). At Δ = L/2 sigma grows by 1 %.

use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::geometry::block::{Block, HALF_LANES, LANES, LEAST_GRADIENT2, exp_neg, sum};

/// Longest distance between the points of the sum, in correlation lengths.
const SPACING: f64 = 0.5;

/// Returns the upper triangle of Σ (1 − ρ²) c cᵀ about `mean`.
pub(crate) fn correlated<T: Real>(
    blocks: &[Block<T>],
    e: &V3<T>,
    b1: &V3<T>,
    b2: &V3<T>,
    mean: [T; 2],
    length_px: T,
) -> [T; 6] {
    let arc_px = blocks.iter().fold(T::ZERO, |arc, block| arc + sum(&block.step_px));
    let points = T::from_i32((blocks.len() * LANES) as i32);
    let room = length_px * T::from_f64(SPACING) * points;
    // The stretches divide a block: 8, 4, 2 or 1 points.
    match [8u8, 4, 2].into_iter().find(|&n| room >= arc_px * T::from_i32(i32::from(n))) {
        Some(stretch) => by_stretch(blocks, e, b1, b2, mean, length_px, usize::from(stretch)),
        None => by_point(blocks, e, b1, b2, mean, length_px),
    }
}

/// The sum over stretches of `stretch` points, each of which has one error. The point with the largest weight stands
/// for its stretch.
fn by_stretch<T: Real>(
    blocks: &[Block<T>],
    e: &V3<T>,
    b1: &V3<T>,
    b2: &V3<T>,
    mean: [T; 2],
    length_px: T,
    stretch: usize,
) -> [T; 6] {
    let mut x = [T::ZERO; 6];
    // c for the errors in u and for those in v.
    let mut c = [[T::ZERO; 3]; 2];
    let per_length = T::one() / length_px;
    let mut step_px = T::ZERO;
    for (block, first) in blocks.iter().flat_map(|block| (0..LANES).step_by(stretch).map(move |first| (block, first))) {
        let mut weight = T::ZERO;
        let mut best = first;
        for l in first..first + stretch {
            step_px += block.step_px[l & 7];
            weight += block.weight[l & 7];
            if block.weight[l & 7] > block.weight[best & 7] {
                best = l;
            }
        }
        // The way over points that do not count belongs to the next step.
        if !(weight > T::ZERO) {
            continue;
        }
        let g = block.gradient_at(best, e);
        let s = block.ray(best);
        let w = weight / (g[0] * g[0] + g[1] * g[1]).max(T::from_f64(LEAST_GRADIENT2));
        let q = [w * (s.dot(b1) - mean[0]), w * (s.dot(b2) - mean[1]), -w];
        let rho = (step_px * per_length).exp_neg();
        step_px = T::ZERO;
        add_outer(&mut x, &c, T::one() - rho * rho);
        for (c, g) in c.iter_mut().zip(g) {
            for (c, q) in c.iter_mut().zip(q) {
                *c = rho * *c + q * g;
            }
        }
    }
    add_outer(&mut x, &c, T::one());
    x
}

/// Returns w h of each point of a block.
#[inline(always)]
fn weighted<T: Real>(block: &Block<T>, g: &[[T; LANES]; 2], b1: &V3<T>, b2: &V3<T>, mean: [T; 2]) -> [[T; LANES]; 3] {
    let mut q = [[T::ZERO; LANES]; 3];
    for l in 0..LANES {
        let (sx, sy, sz) = (block.s[0][l], block.s[1][l], block.s[2][l]);
        let w = block.weight[l] / (g[0][l] * g[0][l] + g[1][l] * g[1][l]).max(T::from_f64(LEAST_GRADIENT2));
        q[0][l] = w * (sx * b1.x + sy * b1.y + sz * b1.z - mean[0]);
        q[1][l] = w * (sx * b2.x + sy * b2.y + sz * b2.z - mean[1]);
        q[2][l] = -w;
    }
    q
}

/// Adds `factor` times c cᵀ of both directions to the upper triangle `x`.
fn add_outer<T: Real>(x: &mut [T; 6], c: &[[T; 3]; 2], factor: T) {
    for [c1, c2, c3] in c {
        let (f1, f2, f3) = (factor * *c1, factor * *c2, factor * *c3);
        let terms = [f1 * *c1, f1 * *c2, f1 * *c3, f2 * *c2, f2 * *c3, f3 * *c3];
        x.iter_mut().zip(terms).for_each(|(x, term)| *x += term);
    }
}

/// The sum over all points.
fn by_point<T: Real>(blocks: &[Block<T>], e: &V3<T>, b1: &V3<T>, b2: &V3<T>, mean: [T; 2], length_px: T) -> [T; 6] {
    // Six sums of four lanes stay in registers; with eight lanes they would not.
    let mut sums = [[T::ZERO; HALF_LANES]; 6];
    // c for the errors in u and for those in v.
    let mut c = [[T::ZERO; 3]; 2];
    let per_length = if length_px > T::ZERO { T::one() / length_px } else { T::ZERO };
    for block in blocks {
        let g = block.gradient(e);
        let q = weighted(block, &g, b1, b2, mean);
        let mut rho = [T::ZERO; LANES];
        // White noise has no correlation, and exp(−∞) need not be computed.
        if per_length > T::ZERO {
            for l in 0..LANES {
                rho[l] = block.step_px[l] * per_length;
            }
            rho = exp_neg(&rho);
        }
        // Each step completes the term of the point before with 1 − ρ², then updates c. Only the update depends on the
        // lane before.
        let mut gap = [T::ZERO; LANES];
        for l in 0..LANES {
            gap[l] = T::one() - rho[l] * rho[l];
        }
        // The chain from lane to lane is kept apart from the products, so that the products become vector instructions.
        let mut before = [[[T::ZERO; LANES]; 3]; 2];
        for (before, (c, g)) in before.iter_mut().zip(c.iter_mut().zip(&g)) {
            for i in 0..3 {
                for l in 0..LANES {
                    before[i][l] = c[i];
                    c[i] = rho[l] * c[i] + q[i][l] * g[l];
                }
            }
        }
        let [[u1, u2, u3], [v1, v2, v3]] = &before;
        for l in 0..HALF_LANES {
            let terms = |l: usize| {
                let (g1, g2, g3) = (gap[l] * u1[l], gap[l] * u2[l], gap[l] * u3[l]);
                let (h1, h2, h3) = (gap[l] * v1[l], gap[l] * v2[l], gap[l] * v3[l]);
                [
                    g1 * u1[l] + h1 * v1[l],
                    g1 * u2[l] + h1 * v2[l],
                    g1 * u3[l] + h1 * v3[l],
                    g2 * u2[l] + h2 * v2[l],
                    g2 * u3[l] + h2 * v3[l],
                    g3 * u3[l] + h3 * v3[l],
                ]
            };
            let (one, other) = (terms(l), terms(l + HALF_LANES));
            for (sum, (a, b)) in sums.iter_mut().zip(one.iter().zip(&other)) {
                sum[l] += *a + *b;
            }
        }
    }
    let mut x = sums.map(|[a, b, c, d]| (a + b) + (c + d));
    add_outer(&mut x, &c, T::one());
    x
}
