//! Gate: a limb is one distinct edge. In clutter, some points of many edges are near any cone.

use super::case::{Case, refuse_if};
use crate::base::real::Real;
use crate::model::verdict::Verdict;

/// Refuses a limb with many other edge points close to it, and a limb that a winding edge follows only in parts.
#[inline(always)]
pub(super) fn refuse<T: Real>(case: &Case<'_, T>) -> Result<(), Verdict> {
    let (fit, config) = (case.fit, case.config);
    let counts = |n: u32| T::from_i32(n as i32);
    let is_crowded = counts(fit.nearby) > counts(fit.inliers) * T::from_f64(config.max_nearby);
    // Only a part of a winding edge is on the cone; this may happen by chance.
    let is_winding = fit.arc_px > case.cover.length_px * T::from_f64(config.max_path);
    let is_by_chance = is_winding && !case.has_inliers_of(config.whole_edge);
    refuse_if(is_crowded || is_by_chance, Verdict::Indistinct)
}
