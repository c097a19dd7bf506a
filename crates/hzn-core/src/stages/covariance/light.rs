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
//!   difference. This moves the edge by half of its width times the difference of the logarithms, but not by more than
//!   its width has room for: clouds change the light along a limb, too, and the profile only scales with it. A limb has
//!   its own width, the same everywhere. The room is what the width differs from it, and what it changes along the
//!   edge.
//!
//! Each error lies between nothing and this much. No residual shows it: a smooth change along the edge is fitted as
//! another cone. With a Sun that is known to be above the horizon of the whole edge there is no such light.

use super::part::{ByNumber, Row};
use crate::base::linalg::M3;
use crate::base::real::Real;
use crate::model::body::Expected;
use crate::model::tone;
use crate::stages::fit::Fit;

/// Width of a limb, and its inverse, over the width for the usual scale height: air of 220 to 290 K has 6.4 to 8.5 km,
/// and 7.5 km is assumed.
const SPREAD: f64 = 1.15;
/// Largest scale height at which a profile is read to its end, in pixels: the longest of its steps. The width of a
/// wider limb is measured too small.
const READ_PX: f64 = 6.0;
/// Width of a step that is blurred by a Gauss curve of 2 px, √(2π) σ: a usual lens with haze and motion has less.
const BLUR_PX: f64 = 5.0;
/// Mean square of a part that is evenly distributed from 0 to 1.
const MEAN_SQUARE: f64 = 1.0 / 3.0;

/// Returns the covariance of (δ₁₂, δc) from light that changes along the edge; `None` where there is no such light.
// A function of its own: its sums must not lie on the stack together with those of the other terms.
#[inline(never)]
pub(super) fn covariance<T: Real>(
    view: &View<T>,
    sums: &ByNumber<T>,
    response: &M3<T>,
    fit: &Fit<T>,
    expected: &Expected<T>,
) -> Option<M3<T>> {
    let parts = fit.profiles.means::<T>().filter(|_| !view.is_in_sunlight)?;
    let scale_px = expected.scale_height_m * expected.cos_per_m() / fit.sums.cos_per_px().max(T::from_f64(1e-20));
    let (scales, spread, blur_px) = (tone::limb_width(fit.tone), T::from_f64(SPREAD), T::from_f64(BLUR_PX));
    let wide_px = scale_px * scales * spread;
    let own_px = (wide_px * wide_px + blur_px * blur_px).sqrt();
    let across = view.across();
    let widths_px: [T; 3] = core::array::from_fn(|i| parts[i].ln_width.exp() * across[i]);
    let wider = widths_px.map(|width_px| (width_px - own_px).max(T::ZERO));
    let contrasts = parts.map(|part| part.ln_contrast);
    let mean = (contrasts[0] + contrasts[1] + contrasts[2]) * T::from_f64(1.0 / 3.0);
    let rooms_px = rooms_px(widths_px, scale_px, scales);
    let moved = core::array::from_fn(|i| {
        let by_half = widths_px[i] * (contrasts[i] - mean) * T::from_f64(0.5);
        by_half.max(-rooms_px[i]).min(rooms_px[i])
    });
    let places = parts.map(|part| part.place);
    let mut p = M3::zeros();
    for values_px in [wider, moved] {
        let error = *response * sums.of_curve(places, values_px);
        p += error * error.transpose() * T::from_f64(MEAN_SQUARE);
    }
    Some(p)
}

/// Returns how far light below the limb can have moved each third of an edge with these widths. A limb is `scales`
/// scale heights wide.
fn rooms_px<T: Real>(widths_px: [T; 3], scale_px: T, scales: T) -> [T; 3] {
    let (limb_px, spread) = (scale_px * scales, T::from_f64(SPREAD));
    let narrow_px = scale_px.min(T::from_f64(READ_PX)) * scales / spread;
    let [first, second, third] = widths_px;
    let (widest_px, narrowest_px) = (first.max(second).max(third), first.min(second).min(third));
    let change_px = (widest_px - narrowest_px * (spread * spread)).max(T::ZERO);
    widths_px.map(|width_px| change_px + (width_px - limb_px).max(narrow_px - width_px).max(T::ZERO))
}

/// How the edge lies in the picture, and in the light of the Sun, where the Sun may be low.
pub(super) struct View<T> {
    /// Pixels across the limb for each pixel along the axis of the profile, summed over the points of each third.
    across: [T; 3],
    counts: [T; 3],
    /// Whether the Sun is known to be above the horizon of all points.
    is_in_sunlight: bool,
}

impl<T: Real> View<T> {
    /// Makes the view of no point. It is `None` where the Sun is known to be high.
    pub(super) fn new(expected: &Expected<T>) -> Option<Self> {
        let is_in_sunlight = expected.sun_seen.is_some();
        let nothing = Self { across: [T::ZERO; 3], counts: [T::ZERO; 3], is_in_sunlight };
        expected.may_have_low_sun().then_some(nothing)
    }

    pub(super) fn add(&mut self, row: &Row<T>, fit: &Fit<T>, expected: &Expected<T>) {
        let third = fit.profiles.ends().iter().filter(|end| row.place >= **end as usize).count();
        self.across[third] += row.across_by_axis();
        self.counts[third] += T::one();
        self.is_in_sunlight &= expected.sun_seen.as_ref().is_some_and(|sun| row.is_in_sunlight(sun, fit));
    }

    /// Returns the means of the thirds. A third without a point of the part is taken as being along the axis.
    fn across(&self) -> [T; 3] {
        let mean = |i: usize| if self.counts[i] > T::ZERO { self.across[i] / self.counts[i] } else { T::one() };
        core::array::from_fn(mean)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clouds_along_a_limb_do_not_move_it() {
        let rooms = |widths_px| rooms_px(widths_px, 4.0, 3.0);
        assert_eq!(rooms([11.0, 12.0, 11.5]), [0.0; 3]);
        assert_eq!(rooms([13.0, 12.0, 14.0]), [1.0, 0.0, 2.0]);
        // An edge that is narrower than a limb is none, and neither is one with a width that changes.
        let narrow = rooms([8.0; 3]);
        assert!(narrow.iter().all(|room| (room - (12.0 / 1.15 - 8.0)).abs() < 1e-12), "{narrow:?}");
        assert!(rooms([11.0, 12.0, 20.0])[0] > 5.0);
        // The width of a wide limb is measured too small, which says nothing.
        assert_eq!(rooms_px([18.0; 3], 12.0, 3.0), [0.0; 3]);
    }
}
