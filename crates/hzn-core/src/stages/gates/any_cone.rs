//! Gate: without a known distance, a part of any smooth curve, a ring or a shadow, is near some cone. Only the
//! residuals tell them apart: those of the body's own shape are noise.

use super::case::{Case, refuse_if};
use super::shape::Residuals;
use crate::base::real::Real;
use crate::model::verdict::Verdict;

/// Refuses a position without a known distance if its residuals are neither noise nor less than half of the shift in
/// the covariance.
pub(super) fn refuse<T: Real>(case: &Case<'_, T>, residuals: &Residuals<'_, T>) -> Result<(), Verdict> {
    let is_any_cone = case.expected.has_any_size();
    let shift_px = case.fused.edge.shift_px;
    refuse_if(
        is_any_cone && residuals.exceed_noise() && residuals.rms_px + residuals.rms_px > shift_px,
        Verdict::Residuals,
    )
}
