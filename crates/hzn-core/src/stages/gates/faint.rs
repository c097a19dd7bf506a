//! Gate: a limb is a step of the brightness. Where the light of a twilight fades over a long distance, each
//! threshold has an edge, too: a contour line of the brightness, which may have the form of a limb. So has the light of
//! the air above a limb by day, which is such a line in the direction of the limb, but too high.

use super::case::{Case, refuse_if};
use super::places::{MAX_PLACES, Place, Places, mean_brightness, sum_of_nine};
use super::profile::Values;
use super::size::disc_px;
use crate::base::median;
use crate::base::real::Real;
use crate::image::Pixels;
use crate::model::observer::Observer;
use crate::model::verdict::Verdict;
use crate::stages::contour::BinaryPicture;

/// Distance from the limb at which the brightness on both sides is read, in pixels. So far the sub-pixel search looks
/// for the plateaus of an edge.
const ASIDE_PX: f64 = 10.0;
/// Largest distance as a part of the diameter of the body's disc.
const PART_OF_DISC: f64 = 0.125;
/// Distance on both sides at which the light of the air is compared, in scale heights.
///
/// An edge point is at half of the light of its limb. Above the limb the light falls by e over one scale height. An
/// edge there has e⁻³ = 1/20 of the light three scale heights below, however high it is.
const SCALE_HEIGHTS: f64 = 3.0;
/// Smallest light at an edge, as a part of that below: in the middle between the two, in the logarithm.
const LEAST_LIGHT: f64 = 0.158;
/// Smallest scale height at which the air can be told from the blur, in pixels.
const LEAST_SCALE_HEIGHT_PX: f64 = 1.2;
/// Fewest places at which both sides must be visible.
const LEAST: usize = 3;

/// Refuses a limb whose step of the brightness is below the least contrast of an edge point, and an edge in the air
/// above a limb. A picture that shows too little of both sides is no evidence.
///
/// Of a picture that came row by row, only lit and dark pixels are left. Where bands are allowed, the inside of the
/// limb may be as dark as the sky.
pub(super) fn refuse<T: Real, P: Pixels, O: Observer<T>>(
    case: &Case<'_, T>,
    binary: &BinaryPicture<'_, T, P, O>,
    places: &Places<T>,
) -> Result<(), Verdict> {
    if P::STREAMED || case.config.max_band >= 1.0 {
        return Ok(());
    }
    has_contrast(case)?;
    let aside = T::from_f64(ASIDE_PX).min(disc_px(case.expected, case.camera) * T::from_f64(PART_OF_DISC));
    let (mut body, mut sky) = (Counts::new(), Counts::new());
    for place in places {
        let at = |inwards_px: T| mean_brightness(place, inwards_px, binary);
        if let (Some(b), Some(s)) = (at(aside), at(-aside)) {
            let _ = (body.push(b), sky.push(s));
        }
    }
    if body.len() < LEAST {
        return Ok(());
    }
    let [body, sky] = [&body, &sky].map(|all| i32::from(median::median_of_counts(all)));
    refuse_if(body - sky < binary.least_contrast || is_in_air(case, binary, places), Verdict::Faint)
}

/// Refuses an edge of which more than half of the points have no contrast of their own. They lie on a contour line of
/// the brightness, which may be anywhere in a slow gradient.
fn has_contrast<T: Real>(case: &Case<'_, T>) -> Result<(), Verdict> {
    refuse_if(2 * case.fallback > case.points, Verdict::Faint)
}

/// Returns whether an edge lies in the light of the air above the limb. A threshold far below half of the body's light
/// has such an edge: it follows the limb, and is up to 40 km too high.
fn is_in_air<T: Real, P: Pixels, O: Observer<T>>(
    case: &Case<'_, T>,
    binary: &BinaryPicture<'_, T, P, O>,
    places: &Places<T>,
) -> bool {
    let expected = case.expected;
    if !(expected.is_in_sunlight && expected.scale_height_m > T::ZERO) || expected.is_airglow {
        return false;
    }
    let scale_m = expected.scale_height_m * case.cos_by_m();
    let mut parts = Values::new();
    for place in places {
        let scale_px = scale_m / place.by_px;
        if scale_px >= T::from_f64(LEAST_SCALE_HEIGHT_PX)
            && let Some(part) = part_of_light(place, scale_px * T::from_f64(SCALE_HEIGHTS), binary)
        {
            let _ = parts.push(part);
        }
    }
    parts.len() >= LEAST && median::median_of_reals(&parts, T::one()) < T::from_f64(LEAST_LIGHT)
}

/// Returns the light at a place over that at a distance inwards, both above the light at the same distance outwards,
/// from 0 to 1; `None` outside of the region, and where it does not become brighter inwards.
fn part_of_light<T: Real, P: Pixels, O: Observer<T>>(
    place: &Place<T>,
    off_px: T,
    binary: &BinaryPicture<'_, T, P, O>,
) -> Option<T> {
    let at = |inwards_px: T| sum_of_nine(place, inwards_px, binary).map(|sum| T::from_i32(sum as i32));
    let (body, here, sky) = (at(off_px)?, at(T::ZERO)?, at(-off_px)?);
    if body <= sky {
        return None;
    }
    let full = T::from_i32(binary.picture.full_scale().into()) * T::from_i32(9);
    // The light as a part of that of the body. If the tone of the picture is unknown, it is that of the counts.
    let light = |counts: T| match &binary.curve {
        None => counts / body,
        Some(curve) => curve.light_over(counts / full, body / full),
    };
    let (here, sky) = (light(here), light(sky));
    Some(((here - sky) / (T::one() - sky)).max(T::ZERO).min(T::one()))
}

type Counts = heapless::Vec<u16, MAX_PLACES>;

#[cfg(test)]
mod tests {
    use super::super::tests::Limb;
    use super::*;

    #[test]
    fn half_of_the_points_must_have_a_contrast_of_their_own() {
        let limb = Limb::exact();
        let with = |fallback: u32| has_contrast(&Case { fallback, ..limb.case() });
        let half = limb.case().points / 2;
        assert_eq!((with(0), with(half), with(half + 1)), (Ok(()), Ok(()), Err(Verdict::Faint)));
    }
}
