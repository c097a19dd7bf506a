//! Gate: the points of a limb lie close to a cone.

use super::case::{Case, refuse_if};
use crate::base::real::Real;
use crate::model::verdict::Verdict;

/// Radius of a disc from which on `gates.max_rms_px` holds, in pixels. The limit of a smaller disc is smaller in
/// proportion to its radius: with the default of 2 px it is 4.3 % of the radius.
///
/// The outline of a regular hexagon departs from its mean circle by 4.3 %: by (tan(a)/(a m²) − 1)^½ for sec θ along a
/// half side, with a = π/6 and the mean m = ln(tan(π/3))/a. An outline that is no rounder than a hexagon is the corner
/// of a chessboard or a patch of light, and no disc. The Earth from afar, lit in part, has up to 2.3 %, and 90 % of
/// such limbs have up to 0.6 % (kind `far` of `tests/python/decoy_campaign.py`).
pub(super) const FULL_RADIUS_PX: f64 = 46.5;
/// Smallest part of the limit: half a pixel of the default. Blur and sampling cause as much on an outline of a few
/// pixels.
const LEAST_PART: f64 = 0.25;
/// RMS of points that are evenly spread over a width on both sides, as a part of the width: 1/√3.
const EVEN: f64 = 0.577_350_269_189_625_8;

/// Refuses an edge whose inliers are too far from the cone, for the picture or for the size of the disc.
///
/// Where the Sun may be low, the edge may be any line in the light of the ground. There it is refused, too, if its
/// inliers fill the width of the consensus as evenly as clutter does.
pub(super) fn refuse<T: Real>(case: &Case<'_, T>) -> Result<(), Verdict> {
    let largest_px = T::from_f64(case.config.max_rms_px) * case.raised * part_of_disc(case);
    let even_px = case.width_px * T::from_f64(EVEN);
    // A limit above the width means that the gate is off.
    let is_even = largest_px < case.width_px && case.fit.rms_px > even_px;
    let may_have_low_sun = || case.expected.sun_seen.is_none() && case.expected.may_have_low_sun();
    refuse_if(!(case.fit.rms_px <= largest_px) || (is_even && may_have_low_sun()), Verdict::Residuals)
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

#[cfg(test)]
mod tests {
    use super::super::tests::Limb;
    use super::*;
    use crate::model::body::Expected;
    use crate::stages::fit::Fit;

    #[test]
    fn with_a_low_sun_the_inliers_must_not_fill_the_width_evenly() {
        let limb = Limb::exact();
        let case = limb.case();
        let at = |rms_px: f64, sun_elevation_rad: Option<f64>| {
            let fit = Fit { rms_px, ..*case.fit };
            let expected = Expected { scale_height_m: 7.5e3, sun_elevation_rad, ..*case.expected };
            refuse(&Case { fit: &fit, expected: &expected, ..limb.case() })
        };
        // 3 px/√3, where the Sun is unknown or low.
        let refused = Err(Verdict::Residuals);
        assert_eq!((at(1.73, None), at(1.74, None), at(1.74, Some(0.1))), (Ok(()), refused, refused));
        assert_eq!((at(1.99, Some(1.0)), at(2.01, Some(1.0))), (Ok(()), refused));
        // The limit of the papers' methods is far above the width.
        let config = crate::stages::gates::Config { max_rms_px: 1e6, ..*case.config };
        let fit = Fit { rms_px: 2.9, ..*case.fit };
        let expected = Expected { scale_height_m: 7.5e3, ..*case.expected };
        assert_eq!(refuse(&Case { fit: &fit, expected: &expected, config: &config, ..limb.case() }), Ok(()));
    }
}
