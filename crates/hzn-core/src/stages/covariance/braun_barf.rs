//! Covariance of the direct nadir (Braun & Barf 2022, (33) to (37)), in one pass.
//!
//! The equation of an edge point is p·e = cos α ‖p‖, with p = s/s_z. An error δ(u, v) of the point changes it by
//! g·δ(u, v)/s_z, where g is the derivative of s·e by (u, v). With b = p gᵀ/s_z, the covariance of the *unnormalised*
//! vector is P = (HᵀH)⁻¹ R (Σ Σ b ρ… bᵀ) (HᵀH)⁻¹. The double sum is over all pairs of points, with the correlation of
//! their errors. It reduces to one recursion as in [`super`].
//!
//! Differences from the paper:
//! - (29) means pᵀ δe = (cos α/‖p‖ pᵀ − eᵀ) δp; its second line prints the left side as δpᵀ e.
//! - (33) has raw pixels in p and holds on the undistorted plane. Here g includes the lens, so that an error is in
//!   pixels of the picture. For a pinhole camera both are the same.
//! - (35) uses 1 − 1/L from point to point. Points are not one pixel apart, because of diagonal steps and thinning.
//!   Here the correlation is exp(−Δs/L), with the distance Δs between the points.
//! - (37) replaces P by λ_max I. The paper says that this is necessary, because P does not have full rank after e is
//!   normalised. A filter does not need full rank: P can be projected on the plane perpendicular to e. The overbound is
//!   an option; it is about twenty times too large.

use super::answer::{EdgeNoise, Fused};
use crate::base::linalg::{M3, V3, basis, symmetric_eigen};
use crate::base::real::Real;
use crate::geometry::block::{Block, LANES};
use crate::model::edge_noise::Config;
use crate::stages::fit::Fit;
use crate::stages::fit::direct::{LEAST_Z, Normal};

/// Returns the answer of a fit with this covariance.
pub(super) fn fused<T: Real>(blocks: &[Block<T>], fit: &Fit<T>, config: &Config) -> Option<Fused<T>> {
    let p = covariance(blocks, &fit.e, T::from_f64(config.correlation_px))?
        * T::from_f64(config.sigma_px * config.sigma_px);
    // The length of the unnormalised vector is the assumed cos α divided by the measured one.
    let var_c = fit.c * fit.c * fit.e.dot(&(p * fit.e));
    let across = project(&p, &fit.e, config.overbound);
    Some(Fused {
        e: fit.e,
        c: fit.c,
        p: across,
        // The paper has errors of the edge points only. Nothing says that no error is common, so that there is no zero.
        common: None,
        free_p: across,
        free_with_cos: [T::ZERO; 2],
        free_common: None,
        // The expected half-angle is not fused in the paper, so that its terms are 0.
        by_cos: [T::ZERO; 2],
        var_free_cos: Some(var_c),
        chi2: T::ZERO,
        edge: EdgeNoise {
            var_cos: var_c,
            lens_var_cos: T::ZERO,
            sigma_px: T::from_f64(config.sigma_px),
            length_px: T::from_f64(config.correlation_px),
            shift_px: T::ZERO,
        },
        located: None,
    })
}

/// Returns P of the unnormalised nadir in the camera frame at the unit axis `e`, for an edge variance of 1 px². The
/// result is `None` if the points do not determine it.
pub(crate) fn covariance<T: Real>(blocks: &[Block<T>], e: &V3<T>, length_px: T) -> Option<M3<T>> {
    let (b1, b2) = basis(e);
    let normal = Normal::new(blocks, &b1, &b2, e)?;
    let zero = V3::new(T::ZERO, T::ZERO, T::ZERO);
    // Errors in u and in v that the previous points carry over to this one.
    let mut carried = [zero; 2];
    let mut x = M3::from_columns(&[zero; 3]);
    for b in blocks {
        let g = b.gradient(e);
        for l in 0..LANES {
            let z = b.s[2][l];
            if !(z > T::from_f64(LEAST_Z)) {
                continue;
            }
            // One z comes from p = s/s_z and the other from the error of the point. Near z = 0 the point of the plane
            // lies at infinity, which is why it is passed over.
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
    // The columns transform from the sheared basis to the camera frame.
    let turn = M3::from_columns(&[
        normal.vector(&V3::new(T::one(), T::ZERO, T::ZERO)),
        normal.vector(&V3::new(T::ZERO, T::one(), T::ZERO)),
        normal.vector(&V3::new(T::ZERO, T::ZERO, T::one())),
    ]);
    Some(turn * p * turn.transpose())
}

/// Projects `p` on the plane perpendicular to the unit axis `e`: (11, 12, 22) on its tangent basis, rad². With
/// `overbound`, the largest eigenvalue holds in every direction, as in (37).
pub(crate) fn project<T: Real>(p: &M3<T>, e: &V3<T>, overbound: bool) -> [T; 3] {
    if overbound {
        let rows = core::array::from_fn(|i| core::array::from_fn(|j| p[(i, j)]));
        let ([_, _, largest], _) = symmetric_eigen::<T, 3>(rows);
        return [largest, T::ZERO, largest];
    }
    let (b1, b2) = basis(e);
    [b1.dot(&(p * b1)), b1.dot(&(p * b2)), b2.dot(&(p * b2))]
}
