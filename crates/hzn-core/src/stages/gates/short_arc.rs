//! Gate: a limb is long. Many curves fit a short edge.

use super::case::{Case, refuse_if};
use super::size::{lit_share, min_arc};
use crate::base::real::Real;
use crate::model::verdict::Verdict;

/// Refuses an edge whose inliers cover too short a part of the limb.
pub(super) fn refuse<T: Real>(case: &Case<'_, T>) -> Result<(), Verdict> {
    let shortest = min_arc(&case.fused.c, case.camera, case.config) * T::from_f64(lit_share(case.expected));
    refuse_if(case.cover.length_px < shortest, Verdict::ShortArc)
}
