//! Zernike moments of 7×7 pixels: the edge as a step across a disc (Ghosal & Mehrotra 1993; Wang et al. 2022, 2.1).
//!
//! For a step of height k at distance l from the centre of the unit disc, the moments in the direction of the edge are
//! A₁₁ = (2k/3)(1 − l²)^(3/2) and A₂₀ = l A₁₁. The edge is therefore at l = A₂₀/A₁₁ along the direction of A₁₁. A real
//! limb is a ramp and not a step, which pulls the point towards the centre of the patch. As in Wang et al., the centre
//! of the patch is the pixel with the largest Sobel gradient, so that the distance l and the bias are small. With a
//! blur of more than about 1.5 px, `linear` is better.

use super::patch::{Patch, SIDE, brightness};
use crate::base::real::Real;
use crate::geometry::pixel::{ImagePoint, Pixel};
use crate::image::Pixels;
use crate::model::observer::Observer;
use crate::stages::contour::BinaryPicture;

/// Radius of the disc in pixels.
const RADIUS_PX: f64 = 3.5;

/// Integral ∬ x over the part of each pixel in the disc, in units of the radius: right half, rows from the middle down.
// A quarter of the disc is enough, because the integrals of the other pixels follow by symmetry.
const X: [[f64; 4]; 4] = [
    [0.0, 0.023_323_615, 0.046_647_230, 0.068_999_037],
    [0.0, 0.023_323_615, 0.046_647_230, 0.057_337_221],
    [0.0, 0.023_323_615, 0.046_573_851, 0.022_425_177],
    [0.0, 0.019_019_963, 0.015_045_882, 0.0],
];
/// Integral ∬ 2(x² + y²) − 1, for the same pixels.
const BOWL: [[f64; 4]; 4] = [
    [-0.079_411_356, -0.066_083_576, -0.026_100_236, 0.039_551_926],
    [-0.066_083_576, -0.052_755_796, -0.012_772_456, 0.039_373_472],
    [-0.026_100_236, -0.012_772_456, 0.027_106_056, 0.022_466_219],
    [0.039_551_926, 0.039_373_472, 0.022_466_219, 0.0],
];

/// Locates the edge next to a border pixel, and the unit direction (du, dv) of its gradient; `None` without an edge
/// within reach.
pub(super) fn locate<T: Real, P: Pixels, O: Observer<T>>(
    binary: &BinaryPicture<'_, T, P, O>,
    p: Pixel,
) -> Option<(ImagePoint<T>, [T; 2])> {
    let (x, y) = steepest(binary, i32::from(p.x), i32::from(p.y))?;
    let (offset, direction) = edge(&Patch::read(binary, x, y)?)?;
    let (u, v) = (T::from_i32(x) + offset * direction[0], T::from_i32(y) + offset * direction[1]);
    Some((ImagePoint { u, v }, direction))
}

/// Returns the pixel with the largest Sobel gradient, at most one pixel from the border pixel, along the axis on which
/// the gradient is larger. This pixel is the edge pixel of a gradient picture that is thinned to its maxima.
fn steepest<T: Real, P: Pixels, O: Observer<T>>(
    binary: &BinaryPicture<'_, T, P, O>,
    x: i32,
    y: i32,
) -> Option<(i32, i32)> {
    let at = |x: i32, y: i32| brightness(binary, x, y);
    // Eight times the brightness change per pixel along (dx, dy).
    let slope = |x: i32, y: i32, dx: i32, dy: i32| -> Option<i32> {
        let line = |k: i32| -> Option<i32> {
            let (x, y) = (x + k * dx, y + k * dy);
            Some(at(x - dy, y - dx)? + 2 * at(x, y)? + at(x + dy, y + dx)?)
        };
        Some((line(1)? - line(-1)?).abs())
    };
    let (across, down) = (slope(x, y, 1, 0)?, slope(x, y, 0, 1)?);
    let (dx, dy) = if across >= down { (1, 0) } else { (0, 1) };
    let mut best = (across.max(down), x, y);
    for k in [-1, 1] {
        let (x, y) = (x + k * dx, y + k * dy);
        if let Some(g) = slope(x, y, dx, dy)
            && g > best.0
        {
            best = (g, x, y);
        }
    }
    Some((best.1, best.2))
}

/// Returns the distance of the edge from the centre in pixels, and the unit direction towards the light.
fn edge<T: Real>(patch: &Patch<T>) -> Option<(T, [T; 2])> {
    let (mut re, mut im, mut a20, mut largest) = (T::ZERO, T::ZERO, T::ZERO, T::ZERO);
    // The brightness of the middle is subtracted: then the moments depend on the contrast alone, and single precision
    // suffices.
    let middle = patch.rows[SIDE / 2][SIDE / 2];
    for j in 0..SIDE {
        for i in 0..SIDE {
            let value = patch.rows[j][i] - middle;
            let (a, b) = (i.abs_diff(3), j.abs_diff(3));
            let x = T::from_f64(X[b & 3][a & 3]);
            let y = T::from_f64(X[a & 3][b & 3]);
            re += value * if i < 3 { -x } else { x };
            im += value * if j < 3 { -y } else { y };
            a20 += value * T::from_f64(BOWL[b & 3][a & 3]);
            largest = largest.max(value.abs());
        }
    }
    let a11 = (re * re + im * im).sqrt();
    // A step through the centre has an A₁₁ of 2/3 of its height.
    if !(a11 > largest * T::from_f64(0.05)) {
        return None;
    }
    let l = a20 / a11;
    // Nearer to the rim the disc shows hardly any of one side, and the quotient would be noise.
    (l.abs() < T::from_f64(0.9)).then(|| (l * T::from_f64(RADIUS_PX), [re / a11, im / a11]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn masks_are_the_integrals_over_pixel_and_disc() {
        const N: i32 = 400;
        for b in 0..4 {
            for a in 0..4 {
                let (mut x_sum, mut bowl) = (0.0, 0.0);
                for i in 0..N * N {
                    let at = |k: i32, n: usize| (n as f64 - 0.5 + (f64::from(k) + 0.5) / f64::from(N)) / RADIUS_PX;
                    let (x, y) = (at(i % N, a), at(i / N, b));
                    let r2 = x * x + y * y;
                    if r2 <= 1.0 {
                        x_sum += x;
                        bowl += 2.0 * r2 - 1.0;
                    }
                }
                let area = (f64::from(N) * RADIUS_PX).powi(-2);
                // The middle column is on both sides of 0, so that its integral cancels.
                let x_sum = if a == 0 { 0.0 } else { x_sum * area };
                assert!((X[b][a] - x_sum).abs() < 2e-5, "X {b} {a}: {x_sum}");
                assert!((BOWL[b][a] - bowl * area).abs() < 2e-5, "BOWL {b} {a}: {}", bowl * area);
            }
        }
    }

    #[test]
    fn a_flat_window_has_no_edge() {
        let flat = Patch { rows: [[77.0f32; SIDE]; SIDE] };
        assert!(edge(&flat).is_none());
    }
}
