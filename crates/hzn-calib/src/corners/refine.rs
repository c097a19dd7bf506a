//! Sub-pixel places of corners, in two steps.
//!
//! The first step needs no good start. At the corner q, the gradient g of the brightness at any point p is
//! perpendicular to p − q: on the two edges because the edge runs through q, elsewhere because g vanishes. So q solves
//! Σ w g gᵀ (p − q) = 0 (Förstner & Gülch 1987). The weights w follow the corner and fall to zero smoothly, so that
//! noise has no preferred direction.
//!
//! The second step fits a model of the brightness ([`super::surface`]), which makes better use of the pixels. On
//! rendered boards with 1 % noise its errors are a third of those of the first step.

use super::grey::Grey;
use super::surface;

/// Half-width of the window as a part of the distance to the nearest corner: the edges of the neighbours stay outside.
const WINDOW: f32 = 0.45;
/// Smallest and largest half-width in pixels. A smaller window has too few pixels; in a larger one the edges of a bent
/// picture are no longer straight.
const MIN_PX: f32 = 3.0;
const MAX_PX: f32 = 8.0;
/// Largest half-width of the window for the model of the brightness, in pixels; bent edges are part of the model.
const MAX_SURFACE_PX: f32 = 14.0;
/// Largest way from the first step to the second, in pixels. A longer way means that the model does not fit.
const MAX_CHANGE_PX: f32 = 1.0;
/// Pixels between the window and the border of the picture: one for the gradient, one for the way of the corner.
const BORDER_PX: f32 = 2.0;
/// Maximum number of iterations, and the step in pixels at which they end.
const ITERATIONS: usize = 30;
const END_PX: f32 = 1e-3;

/// A corner with its sub-pixel place.
#[derive(Debug, Clone, Copy)]
pub(super) struct Refined {
    /// Place in the picture, px.
    pub(super) at_px: [f64; 2],
    /// RMS difference between the pixels and the model of the second step, in units of the brightness; `None` if that
    /// step has failed.
    pub(super) misfit: Option<f32>,
}

/// Returns the place of a corner near `start`; `None` if it does not converge, or moves by more than `reach_px`. `axes`
/// are the directions of the two edges, and `spacing_px` is the distance to the nearest other corner.
pub(super) fn refine(
    picture: &Grey,
    start: [f32; 2],
    axes: [[f32; 2]; 2],
    spacing_px: f32,
    reach_px: f32,
) -> Option<Refined> {
    let radius = |at: [f32; 2], max_px: f32| {
        // Near the border of the picture the window is smaller.
        let [u, v] = at;
        let border_px = u.min(v).min(picture.width() as f32 - 1.0 - u).min(picture.height() as f32 - 1.0 - v);
        (WINDOW * spacing_px).clamp(MIN_PX, max_px).min(border_px - BORDER_PX).max(MIN_PX)
    };
    let at = by_gradients(picture, start, radius(start, MAX_PX), reach_px)?;
    let fitted = surface::fit(picture, at, axes, radius(at, MAX_SURFACE_PX), MAX_CHANGE_PX);
    Some(Refined { at_px: fitted.map_or(at, |f| f.at).map(f64::from), misfit: fitted.map(|f| f.misfit) })
}

fn by_gradients(picture: &Grey, start: [f32; 2], radius: f32, reach_px: f32) -> Option<[f32; 2]> {
    let mut at = start;
    for _ in 0..ITERATIONS {
        let next = step(picture, at, radius)?;
        let moved = (next[0] - at[0]).hypot(next[1] - at[1]);
        at = next;
        if !((at[0] - start[0]).hypot(at[1] - start[1]) <= reach_px) {
            return None;
        }
        if moved < END_PX {
            return Some(at);
        }
    }
    None
}

/// Returns the solution for weights about `at`; `None` at the border of the picture and where there are no two edges.
fn step(picture: &Grey, at: [f32; 2], radius: f32) -> Option<[f32; 2]> {
    let [left, top] = at.map(|x| (x - radius).ceil());
    let [right, bottom] = at.map(|x| (x + radius).floor());
    if left < 1.0 || top < 1.0 || right > picture.width() as f32 - 2.0 || bottom > picture.height() as f32 - 2.0 {
        return None;
    }
    let (mut xx, mut xy, mut yy, mut bx, mut by) = (0.0f32, 0.0f32, 0.0f32, 0.0f32, 0.0f32);
    for y in top as usize..=bottom as usize {
        let (above, here, below) = (picture.row(y - 1), picture.row(y), picture.row(y + 1));
        for x in left as usize..=right as usize {
            let (dx, dy) = (x as f32 - at[0], y as f32 - at[1]);
            let inside = 1.0 - (dx * dx + dy * dy) / (radius * radius);
            if inside <= 0.0 {
                continue;
            }
            let (gx, gy) = (here[x + 1] - here[x - 1], below[x] - above[x]);
            let weight = inside * inside;
            xx += weight * gx * gx;
            xy += weight * gx * gy;
            yy += weight * gy * gy;
            // The place is relative to `at`, so that no precision is lost.
            let along = weight * (gx * dx + gy * dy);
            bx += along * gx;
            by += along * gy;
        }
    }
    let det = xx * yy - xy * xy;
    // Two edges at 10° to each other have a determinant of sin² 10°/4 of the squared trace.
    if !(det > 0.0075 * (xx + yy) * (xx + yy)) {
        return None;
    }
    Some([at[0] + (yy * bx - xy * by) / det, at[1] + (xx * by - xy * bx) / det])
}
