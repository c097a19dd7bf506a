//! Gate: most points of the edge of a body lie on its limb. A curve may fit a small part of any long edge.

use super::case::{Case, refuse_if};
use crate::base::real::Real;
use crate::model::verdict::Verdict;

/// Refuses an edge of which too small a part is on the limb.
pub(super) fn refuse<T: Real>(case: &Case<'_, T>) -> Result<(), Verdict> {
    refuse_if(!case.has_inliers_of(case.min_inlier_share), Verdict::NoConsensus)
}
