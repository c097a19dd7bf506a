//! The profile of the brightness across an edge, which tells the limb from edges of things: the body below a limb
//! becomes darker inwards or has clouds, space above it is even, and a layer of airglow ends at the limb of the ground.

use super::places::{MAX_PLACES, Place, Places, sum_of_nine};
use crate::base::median::median_of_reals;
use crate::base::real::Real;
use crate::image::Pixels;
use crate::model::observer::Observer;
use crate::stages::contour::BinaryPicture;

/// Step of the depths below the edge at which the body is read, km, and their number; the first one is two steps below.
/// The ground below a layer of airglow ends 85 to 125 km below the edge, within a few km.
const STEP_M: f64 = 10e3;
const DEPTHS: usize = 16;
/// Smallest step that resolves an end, in pixels.
const LEAST_STEP_PX: f64 = 2.0;
/// Indices of the depths from 70 to 130 km, at which a layer may end.
const ENDS: core::ops::RangeInclusive<usize> = 5..=11;
/// Bend that sampling and the slow fall of the light cause, and which is no sign of an end.
const USUAL_BEND: f64 = 0.01;
/// Logarithm of the fall from the peak to 60 km below the edge that is no sign of a layer, and the largest that counts.
/// A thin layer falls with the root of the depth, to a half. The sunlit air of an sRGB picture falls by less.
const USUAL_FALL: f64 = 0.1;
const LARGEST_FALL: f64 = 0.6;
/// Largest logarithm of a bend over the other bends.
const LARGEST_END: f64 = 2.5;
/// Makes the largest fall count 1.5.
const FALLS: f64 = 3.0;
/// Where the body is read for its fall: in scale heights of the air (30 and 100 km for the Earth), at least so many
/// pixels below the edge, so that the blur of the edge does not count.
const NEAR: [f64; 2] = [4.0, 6.0];
const FAR: [f64; 2] = [40.0 / 3.0, 18.0];
/// Smallest scale height, in pixels: the places are then at most 225 km below the edge of the Earth.
const LEAST_SCALE_HEIGHT_PX: f64 = 0.6;
/// Sum of the fall and the unevenness from which on a body is not flat, and the part that noise and vignetting make.
const USUAL_CHANGE: f64 = 0.06;
const FLOOR: f64 = 0.005;
/// Where the sky is read for its unevenness, in scale heights and pixels.
const SKY: [f64; 2] = [8.0, 8.0];
/// Unevenness of space, as a part of the step at the edge: half of it is a floor for noise.
const USUAL_SKY: f64 = 0.02;
/// Fewest places along the edge that must show something.
pub(super) const LEAST: usize = 3;
/// Largest ratio of two brightnesses that is told from a larger one.
const MOST: f64 = 4.0;

/// Values from 0 on, one for each place along the edge.
pub(super) type Values<T> = heapless::Vec<T, MAX_PLACES>;

/// The scale of a limb in the picture, and the brightness beyond it.
pub(super) struct Light<T> {
    /// Height in metres to pixels, multiplied by the derivative of s·e by a pixel.
    pub(super) by_m: T,
    pub(super) scale_height_m: T,
    /// Brightness of the sky without air, in counts.
    pub(super) sky: T,
}

impl<T: Real> Light<T> {
    /// Returns the scale height of the air at a place, in pixels.
    pub(super) fn scale_px(&self, place: &Place<T>) -> T {
        self.scale_height_m * self.by_m / place.by_px
    }

    /// Returns the brightness above the sky at a distance inwards of a place.
    pub(super) fn above_sky<P: Pixels, O: Observer<T>>(
        &self,
        place: &Place<T>,
        inwards_px: T,
        binary: &BinaryPicture<'_, T, P, O>,
    ) -> Option<T> {
        brightness(place, inwards_px, binary).map(|b| b - self.sky)
    }

    /// Returns the same, at least one count; `None` if the place is clipped at full scale.
    fn unclipped<P: Pixels, O: Observer<T>>(
        &self,
        place: &Place<T>,
        inwards_px: T,
        binary: &BinaryPicture<'_, T, P, O>,
    ) -> Option<T> {
        let full = T::from_i32(binary.picture.full_scale().into());
        let here = brightness(place, inwards_px, binary).filter(|b| *b < full * T::from_f64(127.0 / 128.0))?;
        Some((here - self.sky).max(T::one()))
    }

    /// Returns how much the light falls below the edge, multiplied by the logarithm of its largest bend between 70 and
    /// 130 km below the edge over its usual bend and unevenness. `None` if the picture does not resolve the depths.
    ///
    /// The bend is the second difference of ln b, and the median of its amount along the edge: cities and moonlight
    /// make the ground brighter than the layer at some places, and darker at others. A layer of airglow has no clouds.
    pub(super) fn second_edge<P: Pixels, O: Observer<T>>(
        &self,
        binary: &BinaryPicture<'_, T, P, O>,
        places: &Places<T>,
    ) -> Option<T> {
        // Two of three places are enough.
        let read = places.iter().enumerate().filter(|(i, _)| i % 3 != 2).filter_map(|(_, place)| {
            let step_px = T::from_f64(STEP_M) * self.by_m / place.by_px;
            (step_px >= T::from_f64(LEAST_STEP_PX)).then_some((place, step_px))
        });
        let at = |place: &Place<T>, step_px: T, k: usize| {
            self.unclipped(place, step_px * T::from_i32(k as i32 + 2), binary).unwrap_or(T::ZERO)
        };
        let falls = read.clone().map(|(place, px)| [at(place, px, 0).max(at(place, px, 1)), at(place, px, 4)]);
        let fall = -middle(&ratios(falls))?.max(T::from_f64(1e-3)).ln();
        let steep = (fall.min(T::from_f64(LARGEST_FALL)) - T::from_f64(USUAL_FALL)) * T::from_f64(FALLS);
        if !(steep > T::ZERO) {
            return Some(T::ZERO);
        }
        let profiles: heapless::Vec<[T; DEPTHS], MAX_PLACES> =
            gather(read.map(|(place, px)| core::array::from_fn(|k| at(place, px, k))));
        let bend = |k: usize| {
            let all = profiles.iter().filter_map(|p| match p.get(k - 1..=k + 1)? {
                // ln b₁ − 2 ln b₂ + ln b₃ is ln(b₁ b₃/b₂²), nearly its argument less 1.
                &[before, here, after] if before > T::ZERO && here > T::ZERO && after > T::ZERO => {
                    Some((before * after / (here * here) - T::one()).abs().min(T::from_f64(MOST)))
                }
                _ => None,
            });
            middle(&gather::<_, MAX_PLACES>(all))
        };
        let bends: [Option<T>; DEPTHS] =
            core::array::from_fn(|k| if (2..DEPTHS - 1).contains(&k) { bend(k) } else { None });
        let (end, most) = (ENDS.filter_map(|k| Some((k, (*bends.get(k)?)?))))
            .reduce(|most, next| if next.1 > most.1 { next } else { most })?;
        let others = bends.iter().enumerate().filter(|(k, _)| k.abs_diff(end) > 1).filter_map(|(_, bend)| *bend);
        let others = middle(&gather::<_, DEPTHS>(others)).unwrap_or(T::ZERO);
        let uneven =
            (2..=4).filter_map(|k| unevenness(&ratios(profiles.iter().filter_map(|p| Some([*p.get(1)?, *p.get(k)?])))));
        let uneven = middle(&gather::<_, MAX_PLACES>(uneven)).unwrap_or(T::ZERO);
        let usual = T::from_f64(USUAL_BEND);
        let sharp = ((most + usual) / (others + uneven + usual)).ln();
        Some(sharp.max(T::ZERO).min(T::from_f64(LARGEST_END)) * steep)
    }

    /// Returns the logarithm of the fall of the brightness inwards and of its unevenness along the edge, together; 0
    /// where they are usual. `None` if too few places show it.
    pub(super) fn flatness<P: Pixels, O: Observer<T>>(
        &self,
        binary: &BinaryPicture<'_, T, P, O>,
        places: &Places<T>,
    ) -> Option<T> {
        let all = places.iter().filter_map(|place| {
            let scale_px = self.scale_px(place);
            let off = |[heights, px]: [f64; 2]| (scale_px * T::from_f64(heights)).max(T::from_f64(px));
            let is_near = scale_px >= T::from_f64(LEAST_SCALE_HEIGHT_PX);
            let near = is_near.then(|| self.unclipped(place, off(NEAR), binary)).flatten()?;
            Some([near, self.unclipped(place, off(FAR), binary)?])
        });
        let all = ratios(all);
        let fall = -middle(&all)?.max(T::from_f64(1e-3)).ln();
        let change = fall.max(T::ZERO) + unevenness(&all)? + T::from_f64(FLOOR);
        Some((change / T::from_f64(USUAL_CHANGE)).ln().min(T::ZERO))
    }

    /// Returns the logarithm of the unevenness of the sky along the edge, 0 where it is usual. `step` is the brightness
    /// of the body above the sky. `None` if too few places show the sky.
    pub(super) fn mottled_sky<P: Pixels, O: Observer<T>>(
        &self,
        step: T,
        binary: &BinaryPicture<'_, T, P, O>,
        places: &Places<T>,
    ) -> Option<T> {
        let step = step.max(T::one());
        let all = places.iter().filter_map(|place| {
            let off = (self.scale_px(place) * T::from_f64(SKY[0])).max(T::from_f64(SKY[1]));
            Some((brightness(place, -off, binary)? / step).min(T::from_f64(MOST)))
        });
        let spread = spread(&gather(all))?.min(T::one());
        let usual = T::from_f64(USUAL_SKY);
        Some(((spread + usual * T::from_f64(0.5)) / usual).ln().max(T::ZERO))
    }
}

/// Returns the mean brightness of nine pixels.
fn brightness<T: Real, P: Pixels, O: Observer<T>>(
    place: &Place<T>,
    inwards_px: T,
    binary: &BinaryPicture<'_, T, P, O>,
) -> Option<T> {
    sum_of_nine(place, inwards_px, binary).map(|sum| T::from_i32(sum as i32) / T::from_i32(9))
}

/// Returns the second brightness of each place over its first one, where both are there.
fn ratios<T: Real>(all: impl Iterator<Item = [T; 2]>) -> Values<T> {
    let is_seen = |[first, second]: &[T; 2]| *first > T::ZERO && *second > T::ZERO;
    gather(all.filter(is_seen).map(|[first, second]| (second / first).min(T::from_f64(MOST))))
}

/// Returns the values as a list. `collect` would have a panic for a list that is too short.
fn gather<V, const N: usize>(values: impl Iterator<Item = V>) -> heapless::Vec<V, N> {
    let mut all = heapless::Vec::new();
    values.for_each(|value| {
        let _ = all.push(value);
    });
    all
}

/// Returns the median; `None` of too few values.
fn middle<T: Real>(values: &[T]) -> Option<T> {
    (values.len() >= LEAST).then(|| median_of_reals(values, T::from_f64(MOST)))
}

/// Returns the median distance from the median.
fn spread<T: Real>(values: &Values<T>) -> Option<T> {
    let middle_of_all = middle(values)?;
    middle(&gather::<_, MAX_PLACES>(values.iter().map(|x| (*x - middle_of_all).abs())))
}

/// Returns the median distance from the median, as a part of the median.
fn unevenness<T: Real>(values: &Values<T>) -> Option<T> {
    let most = T::from_f64(MOST);
    Some((spread(values)? / middle(values)?.max(T::from_f64(1e-3))).min(most))
}
