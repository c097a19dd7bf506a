//! The brightness of the sky beyond a fitted limb.

use super::case::Case;
use super::places::{MAX_PLACES, Places};
use crate::base::median;
use crate::base::real::Real;
use crate::image::Pixels;
use crate::model::observer::Observer;
use crate::stages::contour::BinaryPicture;

/// Distance from the limb to the nearest place beyond it that is read, in pixels; each further place is twice as far.
const NEAREST_PX: f64 = 16.0;
/// Number of places that are read outwards from each inlier; the first place is the inlier itself.
const OUTWARDS: usize = 11;

/// The sky beyond a limb.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sky<T> {
    /// Part of the sky that is lit, 0 to 1. Air that fades outwards from the limb is sky, even if it begins bright.
    pub(super) lit: T,
    /// Median of the brightness of the sky. `spread` is the median distance from it. Both are in counts.
    pub(super) median: T,
    pub(super) spread: T,
}

/// Reads the brightness from the limb outwards to the border of the region. Sky counts as lit from the threshold on. If
/// no half-angle is expected (a Sun or Moon, or a position without a known range), it counts from `gates.dark_sky` of
/// the threshold on: any size is right then, and a bright cloud within a disc would pass for a smaller disc far away.
pub(super) fn measure_sky<T: Real, P: Pixels, O: Observer<T>>(
    case: &Case<'_, T>,
    binary: &BinaryPicture<'_, T, P, O>,
    places: &Places<T>,
) -> Sky<T> {
    let lit_from = if case.expected.free || case.expected.has_any_size() {
        (T::from_i32(binary.level.into()) * T::from_f64(case.config.dark_sky)).to_i32().max(1) as u16
    } else {
        binary.level
    };
    let (mut looks, mut lit) = (0, 0);
    let mut seen = heapless::Vec::<u16, { MAX_PLACES * OUTWARDS }>::new();
    for place in places {
        let mut distance = T::ZERO;
        let mut fading = Some(u16::MAX);
        for _ in 0..OUTWARDS {
            let [x, y] = place.inwards_by(-distance).map(Real::to_i32);
            let (Ok(x), Ok(y)) = (u16::try_from(x), u16::try_from(y)) else { break };
            if !binary.region.contains(x, y) {
                break;
            }
            if !binary.masked(x, y) {
                let brightness = binary.brightness(x, y);
                fading = fading.filter(|&before| brightness < before).map(|_| brightness);
                if distance > T::ZERO {
                    looks += 1;
                    lit += i32::from(fading.is_none() && brightness >= lit_from);
                    let _ = seen.push(brightness);
                }
            }
            distance = (distance + distance).max(T::from_f64(NEAREST_PX));
        }
    }
    let middle = median::median_of_counts(&seen);
    for b in &mut seen {
        *b = b.abs_diff(middle);
    }
    let spread = median::median_of_counts(&seen);
    Sky {
        lit: T::from_i32(lit) / T::from_i32(looks.max(1)),
        median: T::from_i32(middle.into()),
        spread: T::from_i32(spread.max(1).into()),
    }
}
