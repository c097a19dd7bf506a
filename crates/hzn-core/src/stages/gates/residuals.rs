//! Gate: the points of a limb lie close to a cone.

use super::case::{Case, refuse_if};
use crate::base::real::Real;
use crate::model::verdict::Verdict;

/// Refuses an edge whose inliers are too far from the cone.
pub(super) fn refuse<T: Real>(case: &Case<'_, T>) -> Result<(), Verdict> {
    let is_close = case.fit.rms_px <= T::from_f64(case.config.max_rms_px) * case.raised;
    refuse_if(!is_close, Verdict::Residuals)
}
