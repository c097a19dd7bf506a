//! Gate: the limb of the body has the expected size.

use super::case::{Case, refuse_if};
use super::size::is_possible_size;
use crate::base::real::Real;
use crate::model::verdict::Verdict;

/// Refuses a half-angle that differs from the expected one by more than the told noise allows. For a body with a free
/// half-angle, the gate refuses a size that the body never has.
pub(super) fn refuse<T: Real>(case: &Case<'_, T>) -> Result<(), Verdict> {
    let agrees = is_expected(case) && is_possible_size(&case.fit.c, case.expected, case.camera);
    refuse_if(!agrees, Verdict::HalfAngle)
}

/// Returns whether the fitted half-angle is within the bounds of the expected one, widened by its own variance. The
/// bounds are the exact half-angles at k sigmas of altitude and limb height: (ĉ − c₀)² ≤ k² P₃₃ + (c_k − c₀)².
fn is_expected<T: Real>(case: &Case<'_, T>) -> bool {
    let Case { fused, expected, .. } = *case;
    let chi = T::from_f64(case.config.max_half_angle_sigma);
    // A position was compared with the known distance itself, and a half-angle that was not fused with nothing.
    let compared = fused.var_free_cos.filter(|_| fused.located.is_none() && fused.chi2 > T::ZERO);
    let Some(var_free) = compared else { return fused.chi2 <= chi * chi };
    let difference = expected.cos - case.fit.c;
    let variance = expected.variance_towards(case.fit.c, chi);
    variance.is_none_or(|variance| difference * difference <= (var_free + variance) * chi * chi)
}
