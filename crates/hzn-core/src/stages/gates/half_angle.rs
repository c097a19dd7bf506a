//! Gate: the limb of the body has the expected size.

use super::case::{Case, refuse_if};
use super::size::is_possible_size;
use crate::base::real::Real;
use crate::model::verdict::Verdict;

/// Refuses a half-angle that differs from the expected one by more than the told noise allows. For a body with a free
/// half-angle, the gate refuses a size that the body never has.
pub(super) fn refuse<T: Real>(case: &Case<'_, T>) -> Result<(), Verdict> {
    let chi = T::from_f64(case.config.max_half_angle_sigma);
    let agrees = case.fused.chi2 <= chi * chi && is_possible_size(&case.fit.c, case.expected, case.camera);
    refuse_if(!agrees, Verdict::HalfAngle)
}
