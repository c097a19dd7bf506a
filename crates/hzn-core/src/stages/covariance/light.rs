//! Errors from light that changes along the edge and below it.
//!
//! Near the terminator, the light of the ground below the limb rises over many scale heights, and the limb itself may
//! be too dark to be seen. The edge then lies below the limb, by another height at each place. Two signs show it:
//!
//! - **The edge is wider than a limb.** By day the light of a limb is 1 − exp(−e^(−h/H)). Its step is 2.9 H
//!   wide, the whole step over the slope at half of it, and wider in the counts of a photograph. The limb lies within
//!   the rest of the width, above the edge.
//! - **The contrast changes along the edge.** The lit plateau may then belong to light below the limb. If its light
//!   differs from that of the limb as much as the light differs along the edge, half of the step is off by half of the
//!   difference. This moves the edge by half of its width times the difference of the logarithms.
//!
//! Each error lies between nothing and this much. No residual shows it: a smooth change along the edge is fitted as
//! another cone. With a Sun that is known to be above the horizon of the whole edge there is no such light.

use super::common::part;
use super::sandwich::response;
use crate::base::linalg::{M3, V3};
use crate::base::real::Real;
use crate::geometry::block::Block;
use crate::model::body::Expected;
use crate::model::tone;
use crate::stages::fit::Fit;

/// Width of a step that is blurred by a Gauss curve of 2 px, √(2π) σ: a usual lens with haze and motion has less.
const BLUR_PX: f64 = 5.0;
/// Mean square of a part that is evenly distributed from 0 to 1.
const MEAN_SQUARE: f64 = 1.0 / 3.0;

/// Returns the covariance of (δ₁₂, δc) from light that changes along the edge; `None` where there is no such light.
// A function of its own: its sums must not lie on the stack together with those of the other terms.
#[inline(never)]
pub(super) fn covariance<T: Real>(blocks: &[Block<T>], fit: &Fit<T>, expected: &Expected<T>) -> Option<M3<T>> {
    if !expected.may_have_low_sun() {
        return None;
    }
    let parts = fit.profiles.means::<T>()?;
    let sums = Sums::new(blocks, fit, expected);
    if sums.is_in_sunlight {
        return None;
    }
    let response = response(&fit.sums.with_normal(sums.normal), fit.mean, fit.free)?;
    let scale_px = expected.scale_height_m * expected.cos_per_m() / fit.sums.cos_per_px().max(T::from_f64(1e-20));
    let (limb_px, blur_px) = (scale_px * tone::limb_width(fit.tone), T::from_f64(BLUR_PX));
    let own_px = (limb_px * limb_px + blur_px * blur_px).sqrt();
    let widths_px: [T; 3] = core::array::from_fn(|i| parts[i].ln_width.exp() * sums.across[i]);
    let contrasts = parts.map(|part| part.ln_contrast);
    let mean = (contrasts[0] + contrasts[1] + contrasts[2]) * T::from_f64(1.0 / 3.0);
    let wider = widths_px.map(|width_px| (width_px - own_px).max(T::ZERO));
    let half = T::from_f64(0.5);
    let moved = core::array::from_fn(|i| widths_px[i] * (contrasts[i] - mean) * half);
    let places = parts.map(|part| part.place);
    let mut p = M3::zeros();
    for values_px in [wider, moved] {
        let error = response * sums.of_curve(places, values_px);
        p += error * error.transpose() * T::from_f64(MEAN_SQUARE);
    }
    Some(p)
}

/// Sums over a part of the points.
struct Sums<T> {
    normal: [T; 6],
    /// Σ w h g iⁿ for n = 0, 1, 2, with the number i of the point.
    by_number: [V3<T>; 3],
    /// Pixels across the limb for each pixel along the axis of the profile, in each third of the edge.
    across: [T; 3],
    /// Whether the Sun is known to be above the horizon at all points.
    is_in_sunlight: bool,
}

impl<T: Real> Sums<T> {
    fn new(blocks: &[Block<T>], fit: &Fit<T>, expected: &Expected<T>) -> Self {
        let mut normal = [T::ZERO; 6];
        let mut by_number = [V3::zeros(); 3];
        let (mut across, mut counts) = ([T::ZERO; 3], [T::ZERO; 3]);
        let mut is_in_sunlight = expected.sun_seen.is_some();
        let thirds = fit.profiles.ends();
        part(blocks, fit).for_each(|row| {
            row.add_to(&mut normal);
            let i = T::from_i32(row.place() as i32);
            let shift = row.shift();
            by_number[0] += shift;
            by_number[1] += shift * i;
            by_number[2] += shift * (i * i);
            let third = thirds.iter().filter(|end| row.place() >= **end as usize).count();
            across[third] += row.across_by_axis();
            counts[third] += T::one();
            is_in_sunlight &= expected.sun_seen.as_ref().is_some_and(|sun| row.is_in_sunlight(sun, fit));
        });
        for (sum, count) in across.iter_mut().zip(counts) {
            // A third without a point of the part is taken as being along the axis.
            *sum = if count > T::ZERO { *sum / count } else { T::one() };
        }
        Self { normal, by_number, across, is_in_sunlight }
    }

    /// Returns the sum Σ w h g y for the parabola y(i) through three values.
    fn of_curve(&self, [i0, i1, i2]: [T; 3], [y0, y1, y2]: [T; 3]) -> V3<T> {
        let per = |from: T, to: T| (to - from).max(T::one());
        let (first, second) = ((y1 - y0) / per(i0, i1), (y2 - y1) / per(i1, i2));
        let curve = (second - first) / per(i0, i2);
        // y = y₀ + first (i − i₀) + curve (i − i₀)(i − i₁)
        let constant = y0 - first * i0 + curve * i0 * i1;
        let slope = first - curve * (i0 + i1);
        self.by_number[0] * constant + self.by_number[1] * slope + self.by_number[2] * curve
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parabola_goes_through_its_values() {
        let points = [0.0, 1.0, 2.0, 5.0, 9.0_f64];
        let y = |i: f64| 0.3 - 0.2 * i + 0.07 * i * i;
        let sum = |f: &dyn Fn(f64) -> f64| points.iter().map(|i| V3::new(1.0, *i, 2.0) * f(*i)).sum::<V3<f64>>();
        let sums = Sums {
            normal: [0.0; 6],
            by_number: [sum(&|_| 1.0), sum(&|i| i), sum(&|i| i * i)],
            across: [1.0; 3],
            is_in_sunlight: false,
        };
        let found = sums.of_curve([1.0, 4.0, 8.5], [1.0, 4.0, 8.5].map(y));
        assert!((found - sum(&y)).norm() < 1e-12, "{found} {}", sum(&y));
    }
}
