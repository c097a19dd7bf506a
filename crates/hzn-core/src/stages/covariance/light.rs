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

use super::common::{ByNumber, Row};
use crate::base::linalg::M3;
use crate::base::real::Real;
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
pub(super) fn covariance<T: Real>(
    view: &View<T>,
    sums: &ByNumber<T>,
    response: &M3<T>,
    fit: &Fit<T>,
    expected: &Expected<T>,
) -> Option<M3<T>> {
    let parts = fit.profiles.means::<T>().filter(|_| !view.is_in_sunlight)?;
    let scale_px = expected.scale_height_m * expected.cos_per_m() / fit.sums.cos_per_px().max(T::from_f64(1e-20));
    let (limb_px, blur_px) = (scale_px * tone::limb_width(fit.tone), T::from_f64(BLUR_PX));
    let own_px = (limb_px * limb_px + blur_px * blur_px).sqrt();
    let across = view.across();
    let widths_px: [T; 3] = core::array::from_fn(|i| parts[i].ln_width.exp() * across[i]);
    let contrasts = parts.map(|part| part.ln_contrast);
    let mean = (contrasts[0] + contrasts[1] + contrasts[2]) * T::from_f64(1.0 / 3.0);
    let wider = widths_px.map(|width_px| (width_px - own_px).max(T::ZERO));
    let half = T::from_f64(0.5);
    let moved = core::array::from_fn(|i| widths_px[i] * (contrasts[i] - mean) * half);
    let places = parts.map(|part| part.place);
    let mut p = M3::zeros();
    for values_px in [wider, moved] {
        let error = *response * sums.of_curve(places, values_px);
        p += error * error.transpose() * T::from_f64(MEAN_SQUARE);
    }
    Some(p)
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
        let third = fit.profiles.ends().iter().filter(|end| row.place() >= **end as usize).count();
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
