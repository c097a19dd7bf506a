//! Gate: a limb is a step of the brightness. Where the light of a twilight fades over a long distance, each
//! threshold has an edge, too: a contour line of the brightness, which may have the form of a limb.

use super::case::{Case, refuse_if};
use super::places::{MAX_PLACES, Places, mean_brightness};
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
/// Fewest places at which both sides must be visible.
const LEAST: usize = 3;

/// Refuses a limb whose step of the brightness is below the least contrast of an edge point. A picture that shows too
/// little of both sides is no evidence.
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
    refuse_if(body - sky < binary.least_contrast, Verdict::Faint)
}

type Counts = heapless::Vec<u16, MAX_PLACES>;
