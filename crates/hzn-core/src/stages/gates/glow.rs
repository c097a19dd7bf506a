//! Glow: airglow and aurora are layers of light high above the limb, and their edge has the form of a limb. Air
//! fades within a few scale heights above the limb, so light that reaches higher is a glow.

use super::case::Case;
use super::places::{MAX_PLACES, Places, mean_brightness};
use crate::base::median;
use crate::base::real::Real;
use crate::image::Pixels;
use crate::model::body::Expected;
use crate::model::observer::Observer;
use crate::stages::contour::BinaryPicture;

/// Number of standard deviations of the limb height, and of scale heights of the air, above which the air is dark. The
/// light of the air decays by e over one scale height. The counts of an sRGB picture are about the 2.4th root of the
/// light, so they decay by e over 2.4 scale heights. Twice that leaves e⁻² of the brightness at the limb, a fifteenth
/// of the step. A camera with linear counts leaves far less.
const SIGMAS: f64 = 3.0;
const SCALE_HEIGHTS: f64 = 2.0 * 2.4;
/// Allowance for the blur of the picture, in pixels. A Gaussian blur of 3.5 px leaves an eighth of a step there.
const BLUR_PX: f64 = 4.0;
/// The same for an edge at half of the light in pictures that are not linear: half of the counts lies higher, by the
/// first number in scale heights of the air, and by a part of the blur. A Gaussian blur that leaves an eighth of the
/// counts of sRGB 4 px above half of the counts leaves it here above half of the light.
// In sRGB half of the counts is 0.214 of the light, ln(0.5/0.214) scale heights or 0.79 standard deviations of a blur
// higher. An eighth of the counts is 0.0144 of the light, 2.19 standard deviations from the middle.
const CURVED: [f64; 2] = [0.85, BLUR_PX * 2.19 / (2.19 - 0.79)];
/// Farthest place at which the brightness of the sky is read, and the nearest that counts, as multiples of the distance
/// at which the air is dark.
const FARTHEST: f64 = 8.0;
const NEAREST: f64 = 2.0;
/// Fewest places from which the sky must be visible.
const LEAST: usize = 3;
/// Height of the lowest glow in scale heights of the air.
// The airglow of the Earth is a layer from 85 to 105 km, with the scale height of 7.5 km. A layer that the camera is
// below has no limb, because every line of sight leaves through it. Other bodies glow at about the same pressure.
const LOWEST_SCALE_HEIGHTS: f64 = 85.0 / 7.5;
/// Number of standard deviations of the altitude by which a camera must be below the lowest glow.
const BELOW_SIGMAS: f64 = 3.0;

/// Returns whether the camera is below every glow, so that light above the limb can only be that of the air.
fn is_below<T: Real>(expected: &Expected<T>) -> bool {
    let (altitude_m, sigma_m) = expected.altitude_and_sigma_m();
    let lowest_m = expected.scale_height_m * T::from_f64(LOWEST_SCALE_HEIGHTS);
    altitude_m + sigma_m * T::from_f64(BELOW_SIGMAS) < lowest_m
}

/// Returns the angle above the limb at which the air is dark, in radians; `None` for a body without known air.
fn dark_angle<T: Real>(sin: T, c: T, expected: &Expected<T>, scale_heights: f64) -> Option<T> {
    let height_m =
        expected.limb_sigma_parts_m[0] * T::from_f64(SIGMAS) + expected.scale_height_m * T::from_f64(scale_heights);
    // An angle is a height divided by the distance (R + d) cot α of the limb.
    let by_height = sin / (c.max(T::from_f64(1e-6)) * (expected.radius_m + expected.limb_m));
    (expected.scale_height_m > T::ZERO).then_some(height_m * by_height)
}

/// Returns whether a limb may belong to a glow: if the light above it, above the sky farther out, is more than
/// `gates.max_glow` of the step from the sky to the body. `false` if the body's air is unknown, if the camera is below
/// every glow, or if the picture shows too little of the sky.
///
/// This is no gate, although the verdict on an answer may be [`crate::model::verdict::Verdict::Glow`]: the edge stays
/// in the choice, because another edge in the same glow is no better. If it wins, the picture has no answer.
pub(crate) fn is_likely<T: Real, P: Pixels, O: Observer<T>>(
    case: &Case<'_, T>,
    binary: &BinaryPicture<'_, T, P, O>,
    places: &Places<T>,
) -> bool {
    // Of a picture that came row by row, only lit and dark pixels are left.
    if P::STREAMED || is_below(case.expected) {
        return false;
    }
    let (c, most) = (case.fused.c, T::from_f64(case.config.max_glow));
    let sin = (T::one() - c * c).max(T::ZERO).sqrt();
    let (scale_heights, blur_px) =
        if binary.curve.is_some() { (SCALE_HEIGHTS + CURVED[0], CURVED[1]) } else { (SCALE_HEIGHTS, BLUR_PX) };
    let Some(dark) = dark_angle(sin, c, case.expected, scale_heights) else { return false };
    let blur = T::from_f64(blur_px);
    let (mut body, mut air, mut sky) = (Counts::new(), Counts::new(), Counts::new());
    for place in places {
        let at = |inwards_px: T| mean_brightness(place, inwards_px, binary);
        // The derivative is that of s·e = cos ρ, sin ρ dρ.
        let dark_px = dark * (sin / place.by_px) + blur;
        let mut multiple = T::from_f64(FARTHEST);
        let mut far = None;
        while far.is_none() && multiple >= T::from_f64(NEAREST) {
            far = at(-dark_px * multiple);
            multiple *= T::from_f64(0.5);
        }
        if let (Some(b), Some(a), Some(s)) = (at(blur), at(-dark_px), far) {
            let _ = (body.push(b), air.push(a), sky.push(s));
        }
    }
    if body.len() < LEAST {
        return false;
    }
    let [body, air, sky] = [&body, &air, &sky].map(|all| T::from_i32(median::median_of_counts(all).into()));
    air - sky > (body - sky).max(T::one()) * most
}

type Counts = heapless::Vec<u16, MAX_PLACES>;
