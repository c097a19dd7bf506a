//! Gate: a band has sky on both sides, for example a ring, a streak or the frame of a window. A limb has the body
//! inside. From some inliers, the gate reads the brightness along lines inwards.

use super::case::{Case, refuse_if};
use super::places::{Place, Places};
use super::size::disc_px;
use super::sky::Sky;
use crate::base::real::Real;
use crate::image::Pixels;
use crate::model::observer::Observer;
use crate::model::verdict::Verdict;
use crate::stages::contour::BinaryPicture;

/// Number of places that are read along a line, evenly from the limb to the border of the region.
const PLACES: i32 = 16;
/// Shortest line that counts, in pixels.
const SHORTEST_PX: i32 = 32;
/// Largest length of a line as a part of the diameter of the body's disc. The line ends before the far side of the
/// disc.
const ACROSS: f64 = 0.8;
/// Distance to each side over which the step of the limb, and that of the far edge of a band, is read, in pixels.
const ASIDE_PX: i32 = 6;
/// Smallest part of the places behind a band that must be sky, as numerator and denominator. Inside a body, almost no
/// place is sky.
const MIN_SKY_SHARE: [i32; 2] = [2, 3];
/// Largest brightness of a sky place behind a band, above the median of the sky, as a part of the step at the limb. It
/// allows for blur and stray light.
const SKY_PART: f64 = 0.1;

/// Smallest brightness step of the second edge, as a part of the brightness step of the limb. A terminator fades and is
/// no edge.
const STEP: f64 = 0.4;

/// Refuses a limb if too many of the lines inwards come back to the sky across a second edge. The step of this edge
/// must be at least [`STEP`] times that of the limb.
///
/// Of a picture that came row by row, only lit and dark pixels are left, and a terminator is as steep as an edge. A
/// disc that is whole in the picture may be a crescent, which is a band, too.
pub(super) fn refuse<T: Real, P: Pixels, O: Observer<T>>(
    case: &Case<'_, T>,
    binary: &BinaryPicture<'_, T, P, O>,
    places: &Places<T>,
    sky: &Sky<T>,
) -> Result<(), Verdict> {
    let Case { expected, camera, config, .. } = *case;
    let disc_px = disc_px(expected, camera);
    let is_wide = disc_px > T::from_i32(camera.width().min(camera.height()).into());
    if P::STREAMED || config.max_band >= 1.0 || !is_wide {
        return Ok(());
    }
    let step = T::from_f64(STEP);
    let (mut looks, mut bands) = (0, 0);
    for place in places {
        let Some(is_band) = comes_back(place, binary, sky, disc_px, step) else { continue };
        looks += 1;
        bands += i32::from(is_band);
    }
    let part = T::from_i32(bands) / T::from_i32(looks.max(1));
    refuse_if(part >= T::from_f64(config.max_band), Verdict::Band)
}

/// Returns whether the line inwards from one inlier comes back to the sky across a second edge; `None` if the picture
/// does not show enough of the body there.
#[inline(always)]
fn comes_back<T: Real, P: Pixels, O: Observer<T>>(
    from: &Place<T>,
    binary: &BinaryPicture<'_, T, P, O>,
    sky: &Sky<T>,
    disc_px: T,
    step: T,
) -> Option<bool> {
    let at = |px: i32| {
        let [x, y] = from.inwards_by(T::from_i32(px)).map(Real::to_i32);
        let (x, y) = (u16::try_from(x).ok()?, u16::try_from(y).ok()?);
        binary.region.contains(x, y).then_some((x, y))
    };
    let seen = |px: i32| {
        at(px).filter(|&(x, y)| !binary.masked(x, y)).map(|(x, y)| T::from_i32(binary.brightness(x, y).into()))
    };
    let most = i32::from(binary.region.width()) + i32::from(binary.region.height());
    let end = inside(&at, most.min((disc_px * T::from_f64(ACROSS)).to_i32()));
    if end < SHORTEST_PX {
        return None;
    }
    // The brightest pixel is used, because a band may be narrower than `ASIDE_PX`.
    let lit = (1..=ASIDE_PX).filter_map(seen).fold(T::ZERO, |a, b| a.max(b));
    let limb = (lit - sky.median).max(T::one());
    let dark = (sky.spread * T::from_f64(3.0)).max(limb * T::from_f64(SKY_PART)) + sky.median;
    let place = |k: i32| ASIDE_PX + (end - ASIDE_PX) * k / PLACES;
    let is_sky = |k: i32| seen(place(k)).map(|b| b < dark);
    let Some(back) = first_lasting_sky(is_sky) else { return Some(false) };
    // The far edge is where half of the brightness of the band is left: after the last place that is brighter.
    let above = |px: i32| seen(px).map_or(T::ZERO, |b| b - sky.median);
    let passed = |k: i32| above(if k == 0 { ASIDE_PX } else { place(k) });
    let level = (0..=back).fold(limb, |most, k| most.max(passed(k))) * T::from_f64(0.5);
    let last = (0..=back).rev().find(|&k| passed(k) >= level).unwrap_or(0);
    let (mut near, mut far) = (place(last), place(last + 1));
    while far - near > 1 {
        let middle = (near + far) / 2;
        if seen(middle).is_some_and(|b| b - sky.median < level) { far = middle } else { near = middle }
    }
    // The mean of three pixels reduces the noise.
    let edge = |px: i32| {
        let (mut sum, mut count) = (T::ZERO, 0);
        for b in [px - 1, px, px + 1].into_iter().filter_map(seen) {
            sum += b;
            count += 1;
        }
        if count > 0 { sum / T::from_i32(count) } else { sky.median }
    };
    // In a narrow band, the brightest pixel is less than `ASIDE_PX` from the far edge.
    let bright = ((near - ASIDE_PX).max(1)..=near).map(edge).fold(T::ZERO, |a, b| a.max(b));
    Some(bright - edge(far + ASIDE_PX) >= limb * step)
}

/// Returns how far the region extends from the limb inwards, in pixels, at most `most`. The search halves the interval.
fn inside(at: &impl Fn(i32) -> Option<(u16, u16)>, most: i32) -> i32 {
    let (mut within, mut beyond) = (0, most);
    while beyond - within > 4 {
        let middle = (within + beyond) / 2;
        if at(middle).is_some() { within = middle } else { beyond = middle }
    }
    within
}

/// Returns the place before the first one that is sky and from which on at least `MIN_SKY_SHARE` of the visible places
/// are sky. At least three visible places are necessary. `is_sky` reads a place, 1 to `PLACES`; `None` is not visible.
fn first_lasting_sky(is_sky: impl Fn(i32) -> Option<bool>) -> Option<i32> {
    let [part, whole] = MIN_SKY_SHARE;
    let (mut first, mut sky, mut all) = (None, 0, 0);
    // The loop begins at the far end, so that each place is added to those behind it.
    for k in (1..=PLACES).rev() {
        // Inside a body, the share is soon out of reach even if all places that are left are sky.
        if (sky + k) * whole < (all + k) * part {
            break;
        }
        let Some(is_sky) = is_sky(k) else { continue };
        all += 1;
        sky += i32::from(is_sky);
        if is_sky && all >= 3 && sky * whole >= all * part {
            first = Some(k - 1);
        }
    }
    first
}
