//! Faint gate: a limb is a step of the brightness. Where the light of a twilight fades over a long distance, each
//! threshold has an edge, too: a contour line of the brightness, which may have the form of a limb.

use super::places::{MAX_PLACES, Places, mean_brightness};
use crate::base::median;
use crate::base::real::Real;
use crate::image::Pixels;
use crate::model::observer::Observer;
use crate::stages::contour::BinaryPicture;

/// Distance from the limb at which the brightness on both sides is read, in pixels. So far the sub-pixel search looks
/// for the plateaus of an edge.
const ASIDE_PX: f64 = 10.0;
/// Largest distance as a part of the diameter of the body's disc.
const PART_OF_DISC: f64 = 0.125;
/// Fewest places at which both sides must be visible.
const LEAST: usize = 3;

/// Returns whether the step of the brightness at the limb is below the least contrast of an edge point. `false` if the
/// picture shows too little of both sides. `disc_px` is the diameter of the body's disc in pixels.
pub(super) fn is_faint<T: Real, P: Pixels, O: Observer<T>>(
    places: &Places<T>,
    binary: &BinaryPicture<'_, T, P, O>,
    disc_px: T,
) -> bool {
    let aside = T::from_f64(ASIDE_PX).min(disc_px * T::from_f64(PART_OF_DISC));
    let (mut body, mut sky) = (Counts::new(), Counts::new());
    for place in places {
        let at = |inwards_px: T| mean_brightness(place, inwards_px, binary);
        if let (Some(b), Some(s)) = (at(aside), at(-aside)) {
            let _ = (body.push(b), sky.push(s));
        }
    }
    if body.len() < LEAST {
        return false;
    }
    let [body, sky] = [&body, &sky].map(|all| i32::from(median::median_of_counts(all)));
    body - sky < binary.least_contrast
}

type Counts = heapless::Vec<u16, MAX_PLACES>;
