//! Gate: a limb has many points. A curve fits a few points of anything.

use super::case::{Case, refuse_if};
use super::size::{sin_for_points, small_disc_points, small_picture_points};
use crate::base::real::Real;
use crate::model::verdict::Verdict;

/// Refuses an edge with too few inliers. A small disc and a small picture need fewer.
pub(super) fn refuse<T: Real>(case: &Case<'_, T>) -> Result<(), Verdict> {
    let fewest = case
        .config
        .min_inliers
        .min(small_disc_points(sin_for_points(case.fused, case.expected), case.camera, 3))
        .min(small_picture_points(case.camera, 3));
    refuse_if(case.fit.inliers < u32::from(fewest), Verdict::FewInliers)
}
