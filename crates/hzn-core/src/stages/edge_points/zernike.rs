//! Zernike moments of 7×7 pixels: the edge as a step across a disc (Ghosal & Mehrotra 1993; Wang et al. 2022, 2.1).
//!
//! For a step of height k at distance l from the centre of the unit disc, the moments in the direction of the edge are
//! A₁₁ = (2k/3)(1 − l²)^(3/2) and A₂₀ = l A₁₁. The edge is therefore at l = A₂₀/A₁₁ along the direction of A₁₁. A real
//! limb is a ramp and not a step, which pulls the point towards the centre of the patch. As in Wang et al., the centre
//! of the patch is the pixel with the largest Sobel gradient, so that the distance l and the bias are small.
//!
//! A blurred edge is a mixture of steps at the distances l + t, where t is normally distributed, and moments are
//! linear: A₁₁ and A₂₀ are the means of those of the steps, and their quotient is a known function of l and of the
//! width. With `edge_points.blur_px` this function is inverted.

use super::config::Config;
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
    config: &Config,
    p: Pixel,
) -> Option<(ImagePoint<T>, [T; 2])> {
    let (x, y) = steepest(binary, i32::from(p.x), i32::from(p.y))?;
    let (quotient, direction) = edge(&Patch::read(binary, x, y)?)?;
    let offset = distance(quotient, T::from_f64(config.blur_px)) * T::from_f64(RADIUS_PX);
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

/// Abscissas and weights of the Gauss-Hermite quadrature with seven points, for a normal distribution of variance 1.
const NORMAL: [(f64, f64); 7] = [
    (-3.750_439_717_725_742, 5.482_688_559_722_18e-4),
    (-2.366_759_410_734_541, 3.075_712_396_758_65e-2),
    (-1.154_405_394_739_968, 2.401_231_786_050_13e-1),
    (0.0, 4.571_428_571_428_57e-1),
    (1.154_405_394_739_968, 2.401_231_786_050_13e-1),
    (2.366_759_410_734_541, 3.075_712_396_758_65e-2),
    (3.750_439_717_725_742, 5.482_688_559_722_18e-4),
];
/// Variance that two squares of one pixel add to the blur, px²: the pixel averages the light, and the masks take the
/// brightness of a pixel for constant.
const PIXEL_VARIANCE_PX2: f64 = 2.0 / 12.0;
/// Largest distance of an edge from the centre, in radii of the disc. Nearer to the rim the disc shows hardly any of
/// one side, and the quotient would be noise.
const REACH: f64 = 0.9;
/// Number of Newton steps that invert the quotient. Three are enough within half a radius.
const STEPS: usize = 5;

/// Returns the distance of a blurred edge from the centre in radii, where A₂₀/A₁₁ is `quotient`: the quotient itself
/// for an ideal step.
fn distance<T: Real>(quotient: T, blur_px: T) -> T {
    if !(blur_px > T::ZERO) {
        return quotient;
    }
    let width = (blur_px * blur_px + T::from_f64(PIXEL_VARIANCE_PX2)).sqrt() / T::from_f64(RADIUS_PX);
    let (reach, three) = (T::from_f64(REACH), T::from_f64(3.0));
    let mut l = quotient;
    for _ in 0..STEPS {
        let [mut a11, mut a20, mut a11_by_l, mut a20_by_l] = [T::ZERO; 4];
        for (at, weight) in NORMAL {
            let (x, weight) = (l + width * T::from_f64(at), T::from_f64(weight));
            let root = (T::one() - x * x).max(T::ZERO).sqrt();
            let cube = root * root * root;
            a11 += weight * cube;
            a20 += weight * x * cube;
            a11_by_l -= weight * three * x * root;
            a20_by_l += weight * (cube - three * x * x * root);
        }
        let slope = a20_by_l * a11 - a20 * a11_by_l;
        if !(slope > T::ZERO) {
            break;
        }
        l = (l + (quotient * a11 - a20) * a11 / slope).max(-reach).min(reach);
    }
    l
}

/// Returns A₂₀/A₁₁, and the unit direction towards the light.
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
    (l.abs() < T::from_f64(REACH)).then(|| (l, [re / a11, im / a11]))
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

    /// The steps of a blurred edge, integrated in steps of a thousandth, give the quotient that is inverted.
    #[test]
    fn the_distance_of_a_blurred_edge_is_found_again() {
        for blur_px in [0.3, 1.0, 1.5] {
            let width = f64::sqrt(blur_px * blur_px + PIXEL_VARIANCE_PX2) / RADIUS_PX;
            for l in [-0.3, -0.1, 0.0, 0.2] {
                let (mut a11, mut a20) = (0.0, 0.0);
                for i in -5000..=5000 {
                    let t = f64::from(i) * 1e-3;
                    let x = l + t * width;
                    let moment = libm::exp(-0.5 * t * t) * (1.0 - x * x).max(0.0).powf(1.5);
                    (a11, a20) = (a11 + moment, a20 + x * moment);
                }
                let found = distance(a20 / a11, blur_px);
                // The quadrature has seven points, and the rim of the disc is no polynomial: 0.03 px.
                assert!((found - l).abs() * RADIUS_PX < 0.03, "blur {blur_px} px at {l}: {found}");
                let short = distance((a20 / a11) as f32, blur_px as f32);
                assert!((f64::from(short) - found).abs() < 1e-5, "{short} {found}");
            }
        }
        assert_eq!(distance(0.3, 0.0), 0.3);
    }

    #[test]
    fn the_steepest_pixel_is_that_of_three_rows() {
        use crate::image::{Grey, Layout, region::Region};
        use crate::model::observer::Unobserved;

        // The outer rows have the edge between the columns 3 and 4, and the middle row alone has it a column later.
        let rows = [[0u8, 0, 0, 0, 90, 90, 90, 90], [0, 0, 0, 0, 20, 60, 100, 100], [0, 0, 0, 0, 90, 90, 90, 90]];
        let data = rows.concat();
        let region = Region::<f64>::whole(8, 3);
        let picture = Grey::try_new(&data[..], Layout::packed(8, 3, 1, 8)).unwrap();
        let binary = BinaryPicture::new(&picture, &region, 45, &Unobserved);
        assert_eq!(steepest(&binary, 4, 1), Some((4, 1)));
        assert_eq!(steepest(&binary, 3, 1), Some((4, 1)));
        // The same picture on its side.
        let turned: std::vec::Vec<u8> = (0..24).map(|i| rows[i % 3][i / 3]).collect();
        let region = Region::<f64>::whole(3, 8);
        let picture = Grey::try_new(&turned[..], Layout::packed(3, 8, 1, 8)).unwrap();
        let binary = BinaryPicture::new(&picture, &region, 45, &Unobserved);
        assert_eq!(steepest(&binary, 1, 4), Some((1, 4)));
        assert_eq!(steepest(&binary, 1, 3), Some((1, 4)));
    }

    #[test]
    fn a_flat_window_has_no_edge() {
        let flat = Patch { rows: [[77.0f32; SIDE]; SIDE] };
        assert!(edge(&flat).is_none());
    }
}
