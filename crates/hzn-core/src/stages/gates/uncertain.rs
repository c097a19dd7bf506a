//! Gate: an answer is only useful if its direction is known well enough.

use super::case::{Case, refuse_if};
use crate::base::real::Real;
use crate::model::verdict::Verdict;

/// Refuses an answer whose standard deviation is too large or no number.
pub(super) fn refuse<T: Real>(case: &Case<'_, T>) -> Result<(), Verdict> {
    let is_certain = case.sigma_max_rad <= T::from_f64(case.config.max_sigma_deg.to_radians());
    refuse_if(!is_certain, Verdict::Uncertain)
}
