//! Gate: the axis agrees with the attitude of the prior.

use super::case::{Case, refuse_if};
use super::turn::{angle_rad, combined_sigmas};
use crate::base::real::Real;
use crate::model::verdict::Verdict;

/// Refuses an axis that is farther from the axis that the prior attitude and the position predict than both sigmas
/// allow.
#[inline(always)]
pub(super) fn refuse<T: Real>(case: &Case<'_, T>) -> Result<(), Verdict> {
    let Some((axis, sigma)) = &case.expected.predicted else { return Ok(()) };
    let limit = case.config.max_attitude_sigma;
    let agrees = angle_rad(&case.fused.e, axis) <= combined_sigmas(case.sigma_max_rad, *sigma) * T::from_f64(limit);
    refuse_if(!agrees, Verdict::Attitude)
}
