//! The default method: locates the crossing of the mid-level along the axis of the larger gradient.

use super::plateau::{Crossing, REACH};
use super::point::{Aside, EdgePoint, orientation, point_off};
use super::reads::{Around, Line};
use crate::base::real::Real;
use crate::geometry::pixel::Pixel;
use crate::image::Pixels;
use crate::model::observer::Observer;
use crate::model::work;
use crate::stages::contour::BinaryPicture;

/// Longest step of a profile, in pixels.
const WIDEST: i32 = 6;

/// All reads are within this distance from a border pixel, in steps.
pub(super) const MARGIN: i32 = REACH + 3;

/// Distance from the border pixel towards the dark, in pixels. There, an edge at most four pixels wide has faded to
/// half of the threshold.
const FADED: i32 = 3;

/// More than the largest distance of an edge point from its border pixel, in pixels.
const FARTHEST: i32 = 1024;

/// Locates the crossing of the mid-level along the axis of the larger gradient.
#[inline(always)]
pub(super) fn linear<T: Real, P: Pixels, O: Observer<T>, const FREE: bool>(
    binary: &BinaryPicture<'_, T, P, O>,
    p: Pixel,
    aside: &mut Aside,
) -> Option<EdgePoint<T>> {
    let around = Around::<T, P, O, FREE>::new(binary, p);
    if !FREE {
        // These are nine of the 45 reads of a point, so a quarter is more than enough.
        aside.extra_cost += binary.region.checks_cost(p.x, p.y, 1) / 4;
    }
    let near = around.read_3x3()?;
    let gradient = near.gradient();
    let (lit, dx, dy) = orientation(gradient)?;
    let level = i32::from(binary.level);
    // The Sun's glare has no plateau, and the mid-level would follow it: at the threshold of the picture the points are
    // five times as accurate.
    if binary.blooms {
        let [_, inner, outer] = near.across(lit);
        // The level is kept between both values, so that the point stays within the pixel pair that has the border.
        let level4 = (4 * level).max(outer + 1).min(inner);
        let part = T::from_i32(inner - level4) / T::from_i32((inner - outer).max(1));
        return (inner > outer).then(|| EdgePoint::plain(point_off(p, (dx, dy), part), lit));
    }
    // The edge fades over level / gradient pixels. At the top of a narrow edge, the gradient says less than the
    // distance at which the profile is dark, so both are tested. A step is half of the fading width, so that the
    // profile of air seen from a rocket is read to its end. Above 4 pixels, a step is only a fifth of this width,
    // because in haze through a long lens the clouds begin just below.
    let steep = gradient.0.abs().max(gradient.1.abs());
    let line = Line::new(&around, (dx, dy), 1);
    // Sharp edges take this short way; on wide edges it would end before the plateaus, and the limb would move with the
    // light.
    if FREE && (2 * level < steep || line.at(FADED, 0).is_some_and(|v| 2 * v < level)) {
        let Crossing { part, fallback, clipped, .. } = line.crossing(near.across(lit), aside)?;
        return Some(EdgePoint { point: point_off(p, (dx, dy), part), lit, fallback, clipped });
    }
    let (half, fifth) = (4 * level / steep.max(1), 3 * level / (2 * steep.max(1)));
    let step = half.min(fifth.max(4)).clamp(1, WIDEST);
    let here = near.across(lit)[1];
    let reach = (MARGIN * step) as u16;
    aside.extra_cost += work::SLOW_POINT;
    let found = if is_line_clear(binary, p, (dx, dy), reach) || (FREE && is_clear(binary, p, reach)) {
        locate_in_steps::<T, P, O, true>(binary, p, (dx, dy), step, here, aside)?
    } else {
        aside.extra_cost += binary.region.checks_cost(p.x, p.y, reach);
        locate_in_steps::<T, P, O, false>(binary, p, (dx, dy), step, here, aside)?
    };
    let WideCrossing { off, fallback, clipped, .. } =
        if found.rising { recentre_profile(binary, p, (dx, dy), step, found, aside) } else { found };
    Some(EdgePoint { point: point_off(p, (dx, dy), off), lit, fallback, clipped })
}

/// Largest number of times that a profile is read again about its crossing.
// The number bounds the cost: each time the whole profile is read again.
const CLIMBS: u32 = 4;

/// Reads a profile again about its crossing, until the crossing is in the middle of the profile. This is necessary if
/// the lit side still rises at the end of the reach. There is no plateau then, and the mid-level depends on the
/// threshold that determined the border pixel.
#[inline(never)]
fn recentre_profile<T: Real, P: Pixels, O: Observer<T>>(
    binary: &BinaryPicture<'_, T, P, O>,
    p: Pixel,
    (dx, dy): (i32, i32),
    step: i32,
    mut found: WideCrossing<T>,
    aside: &mut Aside,
) -> WideCrossing<T> {
    let mut whole = 0;
    for _ in 0..CLIMBS {
        // The sum is positive, so that the cast rounds down for both signs.
        let moved = (found.off + T::from_i32(FARTHEST)).to_i32() - FARTHEST - whole;
        if !found.rising || moved.abs() < step {
            break;
        }
        let (x, y) = (i32::from(p.x) + dx * (whole + moved), i32::from(p.y) + dy * (whole + moved));
        if !binary.region.is_usable(x, y) {
            break;
        }
        aside.extra_cost += work::SLOW_POINT;
        let (p, reach) = (Pixel { x: x as u16, y: y as u16 }, (MARGIN * step) as u16);
        let next = if is_line_clear(binary, p, (dx, dy), reach) {
            locate_from::<T, P, O, true>(binary, p, (dx, dy), step, aside)
        } else {
            aside.extra_cost += binary.region.checks_cost(p.x, p.y, reach);
            locate_from::<T, P, O, false>(binary, p, (dx, dy), step, aside)
        };
        let Some(next) = next else { break };
        whole += moved;
        found = WideCrossing { off: next.off + T::from_i32(whole), ..next };
    }
    found
}

/// Locates the crossing as [`locate_in_steps`], from any pixel.
#[inline(always)]
fn locate_from<T: Real, P: Pixels, O: Observer<T>, const FREE: bool>(
    binary: &BinaryPicture<'_, T, P, O>,
    p: Pixel,
    towards_dark: (i32, i32),
    step: i32,
    aside: &mut Aside,
) -> Option<WideCrossing<T>> {
    let around = Around::<T, P, O, FREE>::new(binary, p);
    let here = Line::new(&around, towards_dark, step).smoothed(0)?;
    locate_in_steps::<T, P, O, FREE>(binary, p, towards_dark, step, here, aside)
}

/// Returns whether the border of the region and all masks are more than `margin` pixels away.
#[inline(always)]
pub(super) fn is_clear<T: Real, P: Pixels, O: Observer<T>>(
    binary: &BinaryPicture<'_, T, P, O>,
    p: Pixel,
    margin: u16,
) -> bool {
    let region = binary.region;
    region.is_inside_by(p.x, p.y, margin) && (!region.has_mask() || binary.clearance(p.x, p.y, margin) == margin)
}

/// Returns whether there is no mask and the line through a pixel in the direction (dx, dy), with a pixel to each side,
/// is in the region up to `margin` pixels away.
#[inline(always)]
fn is_line_clear<T: Real, P: Pixels, O: Observer<T>>(
    binary: &BinaryPicture<'_, T, P, O>,
    p: Pixel,
    (dx, _): (i32, i32),
    margin: u16,
) -> bool {
    // A line needs only one pixel on each side, so that edges along the picture's border keep the fast way.
    let margins = if dx == 0 { [1, margin] } else { [margin, 1] };
    !binary.region.has_mask() && binary.region.is_inside_by_each(p.x, p.y, margins)
}

/// Crossing of the mid-level on a wide edge; `off` is its distance from the border pixel towards the dark, in pixels.
struct WideCrossing<T> {
    off: T,
    fallback: bool,
    clipped: bool,
    /// Whether the lit side did not level off within reach.
    rising: bool,
}

/// Locates the crossing like [`linear`], with steps of `step` pixels. `here` is the smoothed brightness of the border
/// pixel.
#[inline(never)]
fn locate_in_steps<T: Real, P: Pixels, O: Observer<T>, const FREE: bool>(
    binary: &BinaryPicture<'_, T, P, O>,
    p: Pixel,
    (dx, dy): (i32, i32),
    step: i32,
    here: i32,
    aside: &mut Aside,
) -> Option<WideCrossing<T>> {
    let around = Around::<T, P, O, FREE>::new(binary, p);
    let line = Line::new(&around, (dx, dy), step);
    let Crossing { part, mid2, fallback, clipped, rising } =
        line.crossing([line.smoothed(-1)?, here, line.smoothed(1)?], aside)?;
    let coarse = part * T::from_i32(step);
    // The profile is curved within a step. The crossing is therefore interpolated again over half a step around it.
    let half = step / 2;
    if half == 0 {
        return Some(WideCrossing { off: coarse, fallback, clipped, rising });
    }
    let pixels = Line::new(&around, (dx, dy), 1);
    let whole = (coarse + T::from_i32(REACH * WIDEST)).to_i32() - REACH * WIDEST;
    let k = whole - half / 2;
    let (a, b) = (pixels.smoothed(k)?, pixels.smoothed(k + half)?);
    let fine = T::from_i32(k) + T::from_i32(half * (2 * a - mid2)) / T::from_i32((2 * (a - b)).max(1));
    // In noise the short interval may have hardly any slope; its crossing would then lie anywhere.
    let off = if (fine - coarse).abs() <= T::from_i32(half) { fine } else { coarse };
    Some(WideCrossing { off, fallback, clipped, rising })
}
