//! Gate: between two answers the vehicle turns no faster than it can.

use super::case::{Case, refuse_if};
use super::turn::{angle_rad, combined_sigmas};
use crate::base::real::Real;
use crate::model::verdict::Verdict;

/// Allowed distance between two answers in sigmas, in addition to the turn. `gates.max_rate_deg_s` limits the turn
/// itself.
const LAST_SIGMAS: f64 = 4.0;

/// Refuses an axis that is farther from the last answer than the vehicle can have turned.
#[inline(always)]
pub(super) fn refuse<T: Real>(case: &Case<'_, T>) -> Result<(), Verdict> {
    let (Some(rate), Some(last)) = (case.config.max_rate_deg_s, &case.expected.last) else { return Ok(()) };
    let turned = T::from_f64(rate.to_radians()) * last.age_s.abs();
    let noise = combined_sigmas(case.sigma_max_rad, last.sigma_rad) * T::from_f64(LAST_SIGMAS);
    let is_possible = angle_rad(&case.fused.e, last.axis.v()) <= turned + noise;
    refuse_if(!is_possible, Verdict::Rate)
}
