//! Sum over all pairs of points whose errors are a Gauss-Markov process along the edge.

use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::geometry::block::{Block, HALF_LANES, LANES, LEAST_GRADIENT2, exp_neg};

/// Returns the upper triangle of Σ (1 − ρ²) c cᵀ about `mean`.
pub(crate) fn correlated<T: Real>(
    blocks: &[Block<T>],
    e: &V3<T>,
    b1: &V3<T>,
    b2: &V3<T>,
    mean: [T; 2],
    length_px: T,
) -> [T; 6] {
    // Six sums of four lanes stay in registers; with eight lanes they would not.
    let mut sums = [[T::ZERO; HALF_LANES]; 6];
    // c for the errors in u and for those in v.
    let mut c = [[T::ZERO; 3]; 2];
    let per_length = if length_px > T::ZERO { T::one() / length_px } else { T::ZERO };
    for block in blocks {
        let g = block.gradient(e);
        let mut q = [[T::ZERO; LANES]; 3];
        for l in 0..LANES {
            let (sx, sy, sz) = (block.s[0][l], block.s[1][l], block.s[2][l]);
            let w = block.weight[l] / (g[0][l] * g[0][l] + g[1][l] * g[1][l]).max(T::from_f64(LEAST_GRADIENT2));
            q[0][l] = w * (sx * b1.x + sy * b1.y + sz * b1.z - mean[0]);
            q[1][l] = w * (sx * b2.x + sy * b2.y + sz * b2.z - mean[1]);
            q[2][l] = -w;
        }
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
    for [c1, c2, c3] in c {
        x[0] += c1 * c1;
        x[1] += c1 * c2;
        x[2] += c1 * c3;
        x[3] += c2 * c2;
        x[4] += c2 * c3;
        x[5] += c3 * c3;
    }
    x
}
