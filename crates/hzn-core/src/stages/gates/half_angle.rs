//! The half-angle against the expected one, with the noise that the residuals show instead of the one that was told.

use super::Config;
use crate::base::linalg::basis;
use crate::base::real::Real;
use crate::geometry::block::Block;
use crate::model::body::Expected;
use crate::stages::covariance::{self, Fused};
use crate::stages::fit::Fit;

/// Whether the half-angles differ by more than the residuals allow: an edge that is told to be rough and is smooth says
/// more of its own curvature than its told noise admits.
///
/// (c₀ − ĉ)² / (P₃₃ + σ_c² + what else was told), where P₃₃ has the RMS of the residuals, `select.residual_floor_px` at
/// least, alike over the length that the edge itself tells ([`covariance::measured_length_px`]). P₃₃ grows with the
/// square of the first and at most in proportion to the second; the points are gone through once more only where that
/// bound does not settle it.
pub(super) fn disagrees<T: Real>(
    fit: &Fit<T>,
    fused: &Fused<T>,
    expected: &Expected<T>,
    blocks: &[Block<T>],
    config: &Config,
) -> bool {
    let Some(var_free) = fused.var_free_cos.filter(|_| config.residual_floor_px > 0.0 && !expected.free) else {
        return false;
    };
    let (edge, rest) = (fused.edge.var_cos, var_free - fused.edge.var_cos + expected.sigma_cos * expected.sigma_cos);
    let difference = expected.cos - fit.c;
    let chi = T::from_f64(config.max_half_angle_sigma);
    // Disagrees unless the edge's variance is at least this.
    let needed = difference * difference / (chi * chi) - rest;
    let sigma = fit.rms_px.max(T::from_f64(config.residual_floor_px));
    let length = covariance::measured_length_px(fit);
    let (smaller, shorter) = (sigma / fused.edge.sigma_px, length / fused.edge.length_px.max(T::from_f64(1e-6)));
    let bound = edge * smaller * smaller * shorter.min(T::one());
    if bound >= needed || (smaller >= T::one() && shorter >= T::one()) {
        return false;
    }
    let (b1, b2) = basis(&fit.e);
    let x = covariance::correlated(blocks, &fit.e, &b1, &b2, fit.mean, length.min(fused.edge.length_px));
    let response = covariance::response(&fit.sums, fit.mean, true);
    !response.is_some_and(|response| covariance::sandwich(&response, &x).m33 * sigma * sigma >= needed)
}
