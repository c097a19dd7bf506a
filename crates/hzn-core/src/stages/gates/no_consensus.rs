//! Gate: most points of the edge of a body lie on its limb. A curve may fit a small part of any long edge.

use super::case::{Case, refuse_if};
use crate::base::real::Real;
use crate::model::verdict::Verdict;

/// An edge that covers this part of the whole circle of the limb may have a long terminator, see [`TERMINATOR_SHARE`].
/// The lit limb of a distant body is half of the circle; clouds and night leave a part of it without an edge.
const HALF_LIT: f64 = 1.0 / 3.0;
/// Smallest part of the points of such an edge that must be inliers. A smooth terminator is at most as long as the
/// limb; clouds make its contour line half as long again.
const TERMINATOR_SHARE: f64 = 0.4;

/// Refuses an edge of which too small a part is on the limb.
pub(super) fn refuse<T: Real>(case: &Case<'_, T>) -> Result<(), Verdict> {
    let has_enough = case.has_inliers_of(case.min_inlier_share)
        || case.has_inliers_of(TERMINATOR_SHARE) && case.expected.phases && is_half_lit(case);
    refuse_if(!has_enough, Verdict::NoConsensus)
}

/// Returns whether the inliers cover so much of the circle of a limb that the rest of the edge may be its terminator.
fn is_half_lit<T: Real>(case: &Case<'_, T>) -> bool {
    let (fx, fy) = case.camera.focal_px();
    let circle_px = T::from_f64(core::f64::consts::PI) * (fx + fy) * case.expected.sin;
    !case.expected.free && case.cover.length_px >= circle_px * T::from_f64(HALF_LIT)
}
