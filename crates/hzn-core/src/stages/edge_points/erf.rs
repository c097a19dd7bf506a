//! The most accurate method: fits a blurred step to 7×7 pixels.
//!
//! A straight edge through optics with a round blur has the brightness dim + (bright − dim) Φ((x·n − ρ)/σ), where Φ is
//! the normal distribution. Gauss-Newton fits the offset ρ and the angle of the normal n to the 49 pixels and reaches
//! the Cramér-Rao bound of the patch. The levels are means over the plateaus on both sides. The width σ is fitted, too.
//! This costs no accuracy, because the derivative by σ is odd about the edge and the derivative by the offset is even.

use super::patch::{HALF, Patch, light};
use crate::base::linalg::{V3, invert_spd3};
use crate::base::real::Real;
use crate::geometry::pixel::{ImagePoint, Pixel};
use crate::image::Pixels;
use crate::model::observer::Observer;
use crate::stages::contour::BinaryPicture;

/// Largest number of Gauss-Newton steps in one patch.
const STEPS: usize = 6;
/// Largest number of fits; each one uses a patch about the edge of the fit before.
const WINDOWS: usize = 6;
/// Distance from the edge at which a plateau begins: in units of σ, and the smallest and the largest value in pixels.
// At 2.7 σ the step has reached 99.7 % of its height. The limits are for widths that the fit has not found yet.
const BEGINS: (f64, f64, f64) = (2.7, 2.0, 9.0);
/// Extent of a plateau across the edge (`DEEP`), and to each side along it (`ALONG`), in pixels.
const DEEP: i32 = 5;
const ALONG: i32 = 4;

/// A blurred step in a patch.
#[derive(Clone, Copy)]
pub(super) struct Edge<T> {
    /// Distance from the centre of the patch along the normal, in pixels.
    pub(super) offset: T,
    /// Unit normal towards the light, in image coordinates (u, v).
    pub(super) n: [T; 2],
    /// Width of the edge: standard deviation of the blur, in pixels.
    pub(super) sigma: T,
}

impl<T: Real> Edge<T> {
    /// Returns the point of the edge nearest to the centre (x, y) of the patch.
    pub(super) fn point(&self, x: i32, y: i32) -> ImagePoint<T> {
        ImagePoint { u: T::from_i32(x) + self.offset * self.n[0], v: T::from_i32(y) + self.offset * self.n[1] }
    }
}

/// Brightness of the dark side and of the lit side, in counts.
pub(super) struct Levels<T> {
    pub(super) dim: T,
    pub(super) bright: T,
}

/// Locates the edge next to a border pixel, and the unit direction (du, dv) of its gradient. The result is `None` if
/// there is no clear edge within reach.
pub(super) fn locate<T: Real, P: Pixels, O: Observer<T>>(
    binary: &BinaryPicture<'_, T, P, O>,
    p: Pixel,
) -> Option<(ImagePoint<T>, [T; 2])> {
    let (mut x, mut y) = (i32::from(p.x), i32::from(p.y));
    let mut edge = start(binary, x, y)?;
    for last in (0..WINDOWS).rev() {
        let patch = Patch::read(binary, x, y)?;
        let levels = levels(binary, x, y, &edge)?;
        let before = edge;
        edge = fit(&patch, edge, &levels)?;
        let (dx, dy) = towards(edge.offset, edge.n);
        // The fit has settled if the levels were measured at this edge and the patch holds all of it. In the last round
        // the edge may still move back and forth with the noise.
        let moved = (edge.offset - before.offset).abs() + (edge.sigma - before.sigma).abs() * T::from_f64(0.2);
        let settled = dx == 0 && dy == 0 && moved < T::from_f64(0.05);
        if settled || (last == 0 && edge.offset.abs() < T::from_f64(1.5)) {
            return Some((edge.point(x, y), edge.n));
        }
        (x, y) = (x + dx, y + dy);
        edge.offset -= T::from_i32(dx) * edge.n[0] + T::from_i32(dy) * edge.n[1];
    }
    None
}

/// Makes an edge through (x, y), perpendicular to the gradient, with a width of one pixel.
pub(super) fn start<T: Real, P: Pixels, O: Observer<T>>(
    binary: &BinaryPicture<'_, T, P, O>,
    x: i32,
    y: i32,
) -> Option<Edge<T>> {
    Some(Edge { offset: T::ZERO, n: direction(&Patch::read(binary, x, y)?)?, sigma: T::one() })
}

/// Returns the unit direction towards the light, from the first moments over the disc of the patch.
fn direction<T: Real>(patch: &Patch<T>) -> Option<[T; 2]> {
    let (mut gx, mut gy) = (T::ZERO, T::ZERO);
    each(patch, |x, y, value| {
        if x * x + y * y < T::from_f64(10.5) {
            gx += x * value;
            gy += y * value;
        }
    });
    let norm = (gx * gx + gy * gy).sqrt();
    (norm > T::ZERO).then(|| [gx / norm, gy / norm])
}

/// Returns the means over the plateaus on both sides of an edge; `None` if their contrast is too small.
fn levels<T: Real, P: Pixels, O: Observer<T>>(
    binary: &BinaryPicture<'_, T, P, O>,
    x: i32,
    y: i32,
    edge: &Edge<T>,
) -> Option<Levels<T>> {
    let (widths, least, most) = BEGINS;
    let begins = (edge.sigma * T::from_f64(widths)).max(T::from_f64(least)).min(T::from_f64(most));
    let half = T::from_f64(0.5);
    let mean = |sign: T| -> Option<T> {
        let (mut sum, mut count) = (T::ZERO, 0);
        for k in 0..DEEP {
            let across = edge.offset + sign * (begins + T::from_i32(k));
            for j in -ALONG..=ALONG {
                let along = T::from_i32(j);
                let dx = (across * edge.n[0] - along * edge.n[1] + half).floor().to_i32();
                let dy = (across * edge.n[1] + along * edge.n[0] + half).floor().to_i32();
                if let Some(value) = light(binary, x + dx, y + dy) {
                    sum += value;
                    count += 1;
                }
            }
        }
        // With fewer than five pixels the mean would have too much noise.
        (count > ALONG).then(|| sum / T::from_i32(count))
    };
    let (bright, dim) = (mean(T::one())?, mean(-T::one())?);
    let least = (i32::from(binary.picture.full_scale()) / 64).max(2);
    (bright - dim >= T::from_i32(least)).then_some(Levels { dim, bright })
}

/// Fits the edge, beginning at `start`; `None` if it leaves the patch.
pub(super) fn fit<T: Real>(patch: &Patch<T>, start: Edge<T>, levels: &Levels<T>) -> Option<Edge<T>> {
    let contrast = levels.bright - levels.dim;
    let Edge { mut offset, mut n, mut sigma } = start;
    for _ in 0..STEPS {
        // Unknowns: offset, angle, ln σ.
        let (mut m, mut g) = ([T::ZERO; 6], [T::ZERO; 3]);
        each(patch, |x, y, value| {
            let (d, along) = (x * n[0] + y * n[1], y * n[0] - x * n[1]);
            let z = (d - offset) / sigma;
            let density = (z * z * T::from_f64(-0.5)).exp() * T::from_f64(0.398_942_280_401_432_7);
            let share = (T::one() + (z * T::from_f64(core::f64::consts::FRAC_1_SQRT_2)).erf()) * T::from_f64(0.5);
            let r = (value - levels.dim) / contrast - share;
            let row = [-density / sigma, density / sigma * along, -density * z];
            let mut at = 0;
            for i in 0..3 {
                for j in i..3 {
                    m[at] += row[i] * row[j];
                    at += 1;
                }
                g[i] += row[i] * r;
            }
        });
        // The width is damped, because noise can make it much too large if the patch shows little of the edge.
        m[5] += T::from_f64(0.02);
        let step = invert_spd3(&m)? * V3::new(g[0], g[1], g[2]);
        // Steps of angle and width are limited, because far from the solution the linear step can turn the edge over.
        let turn = step.y.max(T::from_f64(-0.5)).min(T::from_f64(0.5));
        let (s, c) = turn.sin_cos();
        n = [c * n[0] - s * n[1], c * n[1] + s * n[0]];
        offset += step.x;
        sigma = (sigma * step.z.max(T::from_f64(-0.5)).min(T::from_f64(0.5)).exp())
            // A pixel alone blurs by 1/√12 = 0.29 px, therefore no edge in a picture is narrower.
            .max(T::from_f64(0.3))
            .min(T::from_f64(4.0));
        // Beyond 4 px the edge lies outside the patch, which then says nothing about it.
        if !(offset.abs() < T::from_f64(4.0)) {
            return None;
        }
        if step.x.abs() + turn.abs() < T::from_f64(1e-4) {
            break;
        }
    }
    Some(Edge { offset, n, sigma })
}

/// Returns the step in whole pixels from the centre of a patch to the edge at `offset` along the unit normal. The step
/// is along the axis of the larger component, so that the edge is then less than half a pixel away.
fn towards<T: Real>(offset: T, [x, y]: [T; 2]) -> (i32, i32) {
    let whole = |v: T| (v + T::from_f64(0.5)).floor().to_i32();
    if x.abs() >= y.abs() { (whole(offset / x), 0) } else { (0, whole(offset / y)) }
}

/// Calls `visit` with the position of each pixel relative to the centre, and its brightness.
#[inline(always)]
fn each<T: Real>(patch: &Patch<T>, mut visit: impl FnMut(T, T, T)) {
    for (row, dy) in patch.rows.iter().zip(-HALF..) {
        for (value, dx) in row.iter().zip(-HALF..) {
            visit(T::from_i32(dx), T::from_i32(dy), *value);
        }
    }
}
