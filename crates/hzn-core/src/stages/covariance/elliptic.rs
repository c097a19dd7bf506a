//! Covariance of an elliptic cone: the same correlated errors, with the response of this fit.
//!
//! An error δ(u, v) of a point along the gradient g of its equation moves the axis and cos α by k g·δ(u, v), where k is
//! the response of the fit to the row of the point. With b = k gᵀ the covariance is R Σ Σ b ρ… bᵀ. It reduces to a
//! recursion as in [`super`]: c₁ = b₁, c_{j+1} = ρ_j c_j + b_{j+1}, Σ (1 − ρ_j²) c_j c_jᵀ.

use crate::base::linalg::{M3, V3};
use crate::base::real::Real;
use crate::geometry::block::{Block, LANES};
use crate::stages::fit::Quadric;

/// Returns the covariance of (δ₁₂, δc) for an edge variance of 1 px².
pub(super) fn covariance<T: Real>(blocks: &[Block<T>], quadric: &Quadric<T>, length_px: T) -> M3<T> {
    let zero = V3::new(T::ZERO, T::ZERO, T::ZERO);
    let mut p = M3::from_columns(&[zero; 3]);
    // Carried errors in u and in v.
    let mut carried = [zero; 2];
    for block in blocks {
        for lane in 0..LANES {
            let rho = if length_px > T::ZERO { (block.step_px[lane] / length_px).exp_neg() } else { T::ZERO };
            let gap = T::one() - rho * rho;
            let (k, g) = quadric.influence(block, lane);
            for (c, g) in carried.iter_mut().zip(g) {
                p += *c * c.transpose() * gap;
                *c = *c * rho + V3::from(k) * g;
            }
        }
    }
    // The last point has no successor, so that its term counts in full (its ρ is 0).
    for c in carried {
        p += c * c.transpose();
    }
    p
}
