//! Gate: the curvature of a limb shows on which side of the edge the body is.

use super::case::{Case, refuse_if};
use crate::base::real::Real;
use crate::model::verdict::Verdict;
use crate::stages::fit;

/// Smallest distance of the fitted half-angle from that of a body on the other side of the edge, in standard
/// deviations.
const MIN_SIGMA: f64 = 4.0;

/// Refuses an edge that is too short or too rough to show on which side of it the body is.
///
/// A body on the other side of the same edge would have the half-angle π − α. The half-angle that the edge itself gives
/// must be much nearer to α: (ĉ + c₀)² − (ĉ − c₀)² = 4 ĉ c₀ must exceed [`MIN_SIGMA`]² variances. Only an expected
/// half-angle that is fused can hide a wrong side.
#[inline(always)]
pub(super) fn refuse<T: Real>(case: &Case<'_, T>) -> Result<(), Verdict> {
    if case.fit_config.half_angle != fit::HalfAngle::Fused || case.expected.free {
        return Ok(());
    }
    let sides = T::from_f64(MIN_SIGMA);
    let apart = case.fit.c * case.expected.cos * T::from_f64(4.0);
    let is_known = case.fused.var_free_cos.is_some_and(|variance| variance * sides * sides < apart);
    refuse_if(!is_known, Verdict::Straight)
}
