//! Covariance of the direct nadir (Braun & Barf 2022, (33) to (37)), in one pass.
//!
//! An edge point wrong by δ(u, v) changes its equation p·e = cos α ‖p‖, p = s/s_z, by g·δ(u, v)/s_z, where g is the
//! derivative of s·e by (u, v). With b = p gᵀ/s_z the covariance of the *unnormalised* vector is
//! P = (HᵀH)⁻¹ R (Σ Σ b ρ… bᵀ) (HᵀH)⁻¹, the double sum over all pairs of points with the correlation of their errors;
//! it collapses to one recursion as in [`super`].
//!
//! What differs from the paper, and why:
//! - (29) is meant as pᵀ δe = (cos α/‖p‖ pᵀ − eᵀ) δp; the second line prints the left side as δpᵀ e.
//! - (33) has raw pixels in p. It holds on the undistorted plane; here g goes through the lens, so that an error is one
//!   of the picture's pixels. For a pinhole both are the same.
//! - (35) takes 1 − 1/L from point to point. Points are not one pixel apart (diagonal steps, thinning): the correlation
//!   is exp(−Δs/L) over the distance between them.
//! - (37), λ_max I in place of P, is said to be needed because P has no full rank after e is normalised. A filter needs
//!   no full rank: project on the plane across e. The overbound is an option; it is some twenty times too careful.

use super::{Config, EdgeNoise, Fused};
use crate::base::linalg::{M3, V3, basis, symmetric_eigen};
use crate::base::real::Real;
use crate::geometry::block::{Block, LANES};
use crate::stages::fit::Fit;
use crate::stages::fit::direct::{LEAST_Z, Normal};

/// The answer of a fit with this covariance.
pub(super) fn fused<T: Real>(blocks: &[Block<T>], fit: &Fit<T>, config: &Config) -> Option<Fused<T>> {
    let p = of(blocks, &fit.e, T::from_f64(config.correlation_px))? * T::from_f64(config.sigma_px * config.sigma_px);
    // The length of the unnormalised vector is cos α assumed over cos α measured.
    let var_c = fit.c * fit.c * fit.e.dot(&(p * fit.e));
    Some(Fused {
        e: fit.e,
        c: fit.c,
        p: across(&p, &fit.e, config.overbound),
        var_free_cos: Some(var_c),
        chi2: T::ZERO,
        edge: EdgeNoise {
            var_cos: var_c,
            sigma_px: T::from_f64(config.sigma_px),
            length_px: T::from_f64(config.correlation_px),
        },
    })
}

/// P of the unnormalised nadir in the camera frame for unit variance of the edge errors (px²), at the unit axis `e`.
/// `None` when the points do not determine it.
pub(crate) fn of<T: Real>(blocks: &[Block<T>], e: &V3<T>, length_px: T) -> Option<M3<T>> {
    let (b1, b2) = basis(e);
    let normal = Normal::new(blocks, &b1, &b2, e)?;
    let zero = V3::new(T::ZERO, T::ZERO, T::ZERO);
    // Errors in u and in v: what the points before carry over to this one.
    let mut carried = [zero; 2];
    let mut x = M3::from_columns(&[zero; 3]);
    for b in blocks {
        let g = b.gradient(e);
        for l in 0..LANES {
            let z = b.s[2][l];
            if !(z > T::from_f64(LEAST_Z)) {
                continue;
            }
            let row = normal.row(&b.ray(l)) * (b.weight[l] / (z * z));
            let rho = if length_px > T::ZERO { (b.step_px[l] / length_px).exp_neg() } else { T::ZERO };
            for (k, a) in carried.iter_mut().enumerate() {
                let new = row * g[k][l];
                *a *= rho;
                x += new * new.transpose() + new * a.transpose() + *a * new.transpose();
                *a += new;
            }
        }
    }
    let p = normal.inverse() * x * normal.inverse();
    // Columns of the change from the sheared basis to the camera frame.
    let turn = M3::from_columns(&[
        normal.vector(&V3::new(T::one(), T::ZERO, T::ZERO)),
        normal.vector(&V3::new(T::ZERO, T::one(), T::ZERO)),
        normal.vector(&V3::new(T::ZERO, T::ZERO, T::one())),
    ]);
    Some(turn * p * turn.transpose())
}

/// What of `p` lies across the unit axis `e`: (11, 12, 22) on its tangent basis, rad². With `overbound`, (37): the
/// largest eigenvalue in every direction.
pub(crate) fn across<T: Real>(p: &M3<T>, e: &V3<T>, overbound: bool) -> [T; 3] {
    if overbound {
        let rows = core::array::from_fn(|i| core::array::from_fn(|j| p[(i, j)]));
        let ([_, _, largest], _) = symmetric_eigen::<T, 3>(rows);
        return [largest, T::ZERO, largest];
    }
    let (b1, b2) = basis(e);
    [b1.dot(&(p * b1)), b1.dot(&(p * b2)), b2.dot(&(p * b2))]
}
