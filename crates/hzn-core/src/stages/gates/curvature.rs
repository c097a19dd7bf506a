//! Gate: the fitted half-angle agrees with the expected one within the noise of the residuals, too. The noise that is
//! given may be far larger.

use super::case::{Case, refuse_if};
use crate::base::linalg::basis;
use crate::base::real::Real;
use crate::model::verdict::Verdict;
use crate::stages::covariance;

/// Refuses a half-angle that differs from the expected one by more than the residuals allow. If an edge is smoother
/// than the told noise says, its curvature is also more accurate than the told noise allows.
///
/// The test is (c₀ − ĉ)² / (P₃₃ + σ_c² + other given variances). P₃₃ uses the RMS of the residuals, at least
/// `gates.residual_floor_px`, and the correlation length from the length of the edge
/// ([`covariance::measured_length_px`]). P₃₃ grows with the square of the RMS, and at most in proportion to the
/// correlation length. The points are evaluated again only if this bound does not decide the test.
pub(super) fn refuse<T: Real>(case: &Case<'_, T>) -> Result<(), Verdict> {
    let Case { fit, fused, expected, blocks, config, .. } = *case;
    let Some(var_free) = fused.var_free_cos.filter(|_| config.residual_floor_px > 0.0 && !expected.free) else {
        return Ok(());
    };
    let difference = expected.cos - fit.c;
    let chi = T::from_f64(config.max_half_angle_sigma);
    // Without a limit on this side no half-angle contradicts the expected one.
    let Some(prior) = expected.variance_towards(fit.c, chi) else { return Ok(()) };
    let (edge, rest) = (fused.edge.var_cos, var_free - fused.edge.var_cos + prior);
    // The half-angles disagree unless the variance from the edge is at least this value.
    let needed = difference * difference / (chi * chi) - rest;
    let sigma = fit.rms_px.max(T::from_f64(config.residual_floor_px));
    let length = covariance::measured_length_px(fit);
    let (smaller, shorter) = (sigma / fused.edge.sigma_px, length / fused.edge.length_px.max(T::from_f64(1e-6)));
    let bound = edge * smaller * smaller * shorter.min(T::one());
    if bound >= needed || (smaller >= T::one() && shorter >= T::one()) {
        return Ok(());
    }
    let (b1, b2) = basis(&fit.e);
    let x = covariance::correlated(blocks, &fit.e, &b1, &b2, fit.mean, length.min(fused.edge.length_px));
    let response = covariance::response(&fit.sums, fit.mean, true);
    let agrees = response.is_some_and(|response| covariance::sandwich(&response, &x).m33 * sigma * sigma >= needed);
    refuse_if(!agrees, Verdict::HalfAngle)
}
