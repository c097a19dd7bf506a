//! Gate: a limb is one distinct edge. In clutter, some points of many edges are near any cone.

use super::case::{Case, refuse_if};
use crate::base::real::Real;
use crate::model::verdict::Verdict;

/// Largest number of points close to the fitted limb that are no inliers, as a part of the inliers. Close means within
/// three times the cut-off. A limb stands alone; a curve through many edges has other points close to it.
const MAX_NEARBY: f64 = 1.0 / 3.0;
/// Longest path along the inliers, as a multiple of the limb that they cover. A cloud's edge winds, and a part of it
/// may lie on a limb by chance.
const MAX_PATH: f64 = 3.0;

/// Refuses a limb with many other edge points close to it, and a limb that a winding edge follows only in parts.
#[inline(always)]
pub(super) fn refuse<T: Real>(case: &Case<'_, T>) -> Result<(), Verdict> {
    let (fit, config) = (case.fit, case.config);
    let counts = |n: u32| T::from_i32(n as i32);
    let is_crowded = counts(fit.nearby) > counts(fit.inliers) * T::from_f64(MAX_NEARBY);
    // Only a part of a winding edge is on the cone; this may happen by chance.
    let is_winding = fit.arc_px > case.cover.length_px * T::from_f64(MAX_PATH);
    let is_by_chance = is_winding && !case.has_inliers_of(config.whole_edge);
    refuse_if(is_crowded || is_by_chance, Verdict::Indistinct)
}
