//! Gate: the points of a limb lie close to a cone.

use super::case::{Case, refuse_if};
use crate::base::real::Real;
use crate::model::verdict::Verdict;

/// Radius of a disc from which on `gates.max_rms_px` holds, in pixels. The limit of a smaller disc is smaller in
/// proportion to its radius: with the default of 1.7 px it is 4.3 % of the radius.
///
/// The outline of a regular hexagon departs from its mean circle by 4.3 %: by (tan(a)/(a m²) − 1)^½ for sec θ along a
/// half side, with a = π/6 and the mean m = ln(tan(π/3))/a. An outline that is no rounder than a hexagon is the corner
/// of a chessboard or a patch of light, and no disc. The Earth from afar, lit in part, has up to 2.3 %, and 90 % of
/// such limbs have up to 0.6 % (kind `far` of `tests/python/decoy_campaign.py`).
const FULL_RADIUS_PX: f64 = 39.5;
/// Smallest part of the limit: half a pixel of the default. Blur and sampling cause as much on an outline of a few
/// pixels.
const LEAST_PART: f64 = 0.3;

/// Refuses an edge whose inliers are too far from the cone, for the picture or for the size of the disc.
pub(super) fn refuse<T: Real>(case: &Case<'_, T>) -> Result<(), Verdict> {
    let largest_px = T::from_f64(case.config.max_rms_px) * case.raised * part_of_disc(case);
    refuse_if(!(case.fit.rms_px <= largest_px), Verdict::Residuals)
}

/// Returns the part of the limit that a disc of this size may have. Sun and Moon in the sky bloom and have phases, so
/// that their outlines are no circles: they have the whole limit.
fn part_of_disc<T: Real>(case: &Case<'_, T>) -> T {
    if case.expected.free {
        return T::one();
    }
    let part = radius_px(case) * T::from_f64(1.0 / FULL_RADIUS_PX);
    part.max(T::from_f64(LEAST_PART)).min(T::one())
}

/// Returns the radius of the fitted disc in the middle of the picture, in pixels.
pub(super) fn radius_px<T: Real>(case: &Case<'_, T>) -> T {
    let (fx, fy) = case.camera.focal_px();
    // sin² α = k (2 − k) with k = 1 − cos α keeps the precision of a small disc.
    let k = case.fit.k;
    let sin = (k * (T::from_f64(2.0) - k)).max(T::ZERO).sqrt();
    sin * (fx + fy) * T::from_f64(0.5)
}
