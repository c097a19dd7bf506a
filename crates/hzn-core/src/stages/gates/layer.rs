//! Gate: the edge of the airglow is that of a layer. Below it the light becomes less again, down to the ground, whose
//! own edge may be seen in moonlight. The ground itself, clouds and the lights of most cities have no such trough.
//!
//! A line of cities along a coast has one. But nothing stands above the layer, so that its light is seen along the
//! whole limb, and a line of sight runs through 700 km of it, so that its light changes little along a picture. A line
//! of cities ends, has gaps, or has lights of every brightness. And the layer is seen below its edge, too: every line
//! of sight crosses it. Behind a line of cities the ground is as dark as before it.
//!
//! The gate `glow` asks for no light beyond the edge. Where the picture ends next to the edge, the layer may be outside
//! of it, and the edge that of the ground; so the sky beyond the edge must be in view.

use super::case::{Case, refuse_if};
use super::places::{MAX_PLACES, Place, Places, mean_brightness, sum_about};
use super::sky::Sky;
use crate::base::linalg::basis;
use crate::base::median;
use crate::base::real::Real;
use crate::geometry::frames::UnitVec3;
use crate::image::Pixels;
use crate::model::observer::Observer;
use crate::model::verdict::Verdict;
use crate::stages::contour::BinaryPicture;

/// Step of the places below the edge, metres, and their number.
const STEP_M: f64 = 10e3;
const PLACES: usize = 13;
/// Smallest step that resolves the layer, in pixels.
const LEAST_STEP_PX: f64 = 1.0;
/// Number of places in which the layer is brightest. Its largest light is at most 2.6 thicknesses of 12 km below the
/// edge.
const BRIGHTEST: usize = 4;
/// Largest light of the trough, as a part of the largest light of the layer.
// A layer 12 km thick with its peak at 105 km leaves 0.5 of its light at a height of 50 km, which is 0.76 of the counts
// in sRGB. Blur and the light of the ground add to it.
const TROUGH: f64 = 0.85;
/// Last place that may be the trough: the highest edge is 128 km above the ground.
const LAST_TROUGH: usize = 11;
/// Last place below which the ground cannot be: the lowest edge is 88 km above it.
const LAST_DARK: usize = 8;
/// Largest light of the trough at one place, which has more noise than the profile, and the smallest part of the places
/// that show it. The layer is as bright everywhere along a picture; ground and clouds are not.
const TROUGH_OF_PLACE: f64 = 0.92;
const EVERYWHERE: f64 = 0.9;
/// Number of places around the limb at which the light of the layer is compared, the smallest light of a place as a
/// part of their median, and the smallest part of the places in view that have it.
// Waves change the light of a layer by some tens of percent, so that half of the median is left nearly everywhere.
const AROUND: usize = 256;
const EVEN: f64 = 0.5;
const MOST_EVEN: f64 = 0.95;
/// First place at which the light may rise again to half of the depth of the trough. The edge of a layer is at least
/// 85 km above the ground, and the air above the ground shines in moonlight up to 28 km.
const FIRST_RISE: usize = 6;
/// Smallest depth of the trough in units of the spread of the sky's pixels.
// A median of twelve means of nine pixels has a tenth of that spread.
const LEAST_DEPTH: f64 = 0.5;
/// Number of steps above the edge at which sky must be in view: the layer is at most 128 km above the ground, and its
/// light is gone 60 km above its edge, where the gate `glow` looks.
const SKY_STEPS: f64 = 6.0;
/// Smallest light at the first place below the edge, as a part of the largest light; it falls with the square root of
/// the depth.
// A line of sight that passes D below a thin layer crosses it twice, each time over √(R/2D) of its thickness. The
// thinnest layer, with a full width of 3 km at half of its emission, leaves 0.353 at 10 km. Thicker layers, sRGB,
// overexposure and blur leave more.
const BELOW: f64 = 0.35;
/// Last place down to which the layer is seen twice. Below it the far side may be behind dense air or the ground.
// At 60 km below the lowest edge the line of sight stays 26 km above the ground, where the air is clear.
const LAST_TWICE: i32 = 6;
/// Fewest places along the edge that must show a depth.
const LEAST: usize = 3;

/// Refuses an edge that is not the outer edge of a layer.
///
/// The profile is the median over the places along the edge at each depth, so that what only some of them show, such as
/// a city, does not count. Of a picture that came row by row, only lit and dark pixels are left, so it shows no layer.
pub(super) fn refuse<T: Real, P: Pixels, O: Observer<T>>(
    case: &Case<'_, T>,
    binary: &BinaryPicture<'_, T, P, O>,
    places: &Places<T>,
    sky: &Sky<T>,
) -> Result<(), Verdict> {
    let step_px = |place: &Place<T>| step(case) / place.by_px;
    let is_sky_shown =
        |place: &&Place<T>| mean_brightness(place, -step_px(place) * T::from_f64(SKY_STEPS), binary).is_some();
    let is_layer = !P::STREAMED
        && places.iter().filter(is_sky_shown).count() >= LEAST
        && profile(case, binary, places)
            .is_some_and(|light| is_a_layers(&light, sky) && is_everywhere(&light, case, binary, places, sky));
    refuse_if(!is_layer, Verdict::Layer)
}

type Profile<T> = heapless::Vec<T, PLACES>;

/// Returns the step of the places, in units of the derivative of s·e by a pixel.
fn step<T: Real>(case: &Case<'_, T>) -> T {
    let (c, expected) = (case.fused.c, case.expected);
    // An angle is a height divided by the distance (R + d) cot α of the limb; that of s·e = cos ρ is sin ρ dρ.
    let by_m = (T::one() - c * c).max(T::ZERO)
        / (c.max(T::from_f64(1e-6)) * (expected.radius_m + expected.limb_m).max(T::one()));
    T::from_f64(STEP_M) * by_m
}

/// Returns the brightness below the edge, one value for each step; it ends where the picture does. `None` if the
/// picture does not resolve the steps.
fn profile<T: Real, P: Pixels, O: Observer<T>>(
    case: &Case<'_, T>,
    binary: &BinaryPicture<'_, T, P, O>,
    places: &Places<T>,
) -> Option<Profile<T>> {
    let step = step(case);
    let is_resolved = places.iter().all(|place| step >= place.by_px * T::from_f64(LEAST_STEP_PX));
    let mut profile = Profile::new();
    for k in 1..=PLACES {
        let mut seen = heapless::Vec::<u16, MAX_PLACES>::new();
        for place in places.iter().filter(|_| is_resolved) {
            let inwards_px = step / place.by_px * T::from_i32(k as i32);
            let _ = mean_brightness(place, inwards_px, binary).map(|b| seen.push(b));
        }
        if seen.len() < LEAST {
            break;
        }
        let _ = profile.push(T::from_i32(median::median_of_counts(&seen).into()));
    }
    (!profile.is_empty()).then_some(profile)
}

/// Returns whether nearly every place shows the trough at the depth at which the profile has it.
fn is_everywhere<T: Real, P: Pixels, O: Observer<T>>(
    profile: &Profile<T>,
    case: &Case<'_, T>,
    binary: &BinaryPicture<'_, T, P, O>,
    places: &Places<T>,
    sky: &Sky<T>,
) -> bool {
    let (mut most, mut least) = ((1, T::ZERO), (1, T::from_f64(f64::from(u16::MAX))));
    for (k, brightness) in (1..).zip(profile).take(LAST_DARK) {
        if k <= BRIGHTEST as i32 && *brightness > most.1 {
            most = (k, *brightness);
        }
        if k >= most.0 && *brightness < least.1 {
            least = (k, *brightness);
        }
    }
    let step = step(case);
    let (mut looks, mut dark) = (0, 0);
    for place in places {
        let light = |k: i32| mean_brightness(place, step / place.by_px * T::from_i32(k), binary);
        let (Some(bright), Some(trough)) = (light(most.0), light(least.0)) else { continue };
        let [bright, trough] = [bright, trough].map(|b| T::from_i32(b.into()) - sky.median);
        looks += 1;
        dark += i32::from(trough < bright * T::from_f64(TROUGH_OF_PLACE));
    }
    looks >= LEAST as i32
        && T::from_i32(dark) >= T::from_i32(looks) * T::from_f64(EVERYWHERE)
        && is_even(most.0, case, binary, sky)
}

/// Returns whether the layer is about as bright along the whole limb in view, at the depth at which the profile is
/// brightest. The threshold may have left out a part of the edge, so that the places are those of the fitted limb.
fn is_even<T: Real, P: Pixels, O: Observer<T>>(
    depth: i32,
    case: &Case<'_, T>,
    binary: &BinaryPicture<'_, T, P, O>,
    sky: &Sky<T>,
) -> bool {
    let (b1, b2) = basis(&case.fused.e);
    let cos = (case.fused.c + step(case) * T::from_i32(depth)).min(T::one());
    let sin = (T::one() - cos * cos).max(T::ZERO).sqrt();
    let mut lights = heapless::Vec::<u16, AROUND>::new();
    for k in 0..AROUND {
        let (s, c) = T::from_f64(k as f64 * core::f64::consts::TAU / AROUND as f64).sin_cos();
        let direction = case.fused.e * cos + (b1 * c + b2 * s) * sin;
        let _ = case
            .camera
            .project(&UnitVec3::assume_unit(direction))
            .and_then(|at| u16::try_from(sum_about([at.u, at.v], binary)? / 9).ok())
            .map(|light| lights.push(light));
    }
    let above_sky = |light: u16| (T::from_i32(light.into()) - sky.median).max(T::ZERO);
    let least = above_sky(median::median_of_counts(&lights)) * T::from_f64(EVEN);
    let even = lights.iter().filter(|&&light| above_sky(light) >= least).count();
    T::from_i32(even as i32) >= T::from_i32(lights.len() as i32) * T::from_f64(MOST_EVEN)
}

/// Returns whether the light below the edge may be that of a layer.
fn is_a_layers<T: Real>(profile: &Profile<T>, sky: &Sky<T>) -> bool {
    has_trough(profile, sky) && is_left_below(profile, sky)
}

/// Returns whether as much light is left below the edge as the thinnest layer leaves.
fn is_left_below<T: Real>(profile: &Profile<T>, sky: &Sky<T>) -> bool {
    let most = profile.iter().take(BRIGHTEST).fold(T::ZERO, |most, &light| most.max(light - sky.median));
    // A mean of nine pixels loses up to one count.
    let noise = sky.spread * T::from_f64(LEAST_DEPTH) + T::one();
    let seen = |k: i32| T::from_f64(if k > LAST_TWICE { 0.5 * BELOW } else { BELOW });
    (1..).zip(profile).all(|(k, &light)| light - sky.median + noise >= most * seen(k) / T::from_i32(k).sqrt())
}

/// Returns whether the light becomes less below the edge, and does not rise again too early.
fn has_trough<T: Real>(profile: &Profile<T>, sky: &Sky<T>) -> bool {
    let (mut most, mut least, mut is_in_trough) = (T::ZERO, T::ZERO, false);
    let noise = sky.spread * T::from_f64(LEAST_DEPTH);
    for (k, brightness) in (1..).zip(profile) {
        let light = (*brightness - sky.median).max(T::ZERO);
        if !is_in_trough {
            if k <= BRIGHTEST {
                most = most.max(light);
            }
            is_in_trough = light <= most * T::from_f64(TROUGH) && most - light > noise;
            least = light;
            if !is_in_trough && k >= LAST_TROUGH {
                return false;
            }
            continue;
        }
        least = least.min(light);
        if light - least > (most - least) * T::from_f64(0.5) {
            return k >= FIRST_RISE;
        }
    }
    is_in_trough
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_layer(profile: &[f64]) -> bool {
        let sky = Sky { lit: 0.0, median: 10.0, spread: 1.0 };
        is_a_layers(&profile.iter().map(|light| light + 10.0).collect(), &sky)
    }

    #[test]
    fn a_layer_has_a_trough_below_it() {
        // The thickest layer in sRGB, with dark and with moonlit ground; a thin one, whose ground is not in view.
        let thick = [80.0, 97.0, 100.0, 96.0, 85.0, 80.0, 77.0, 74.0, 72.0, 70.0];
        assert!(is_layer(&[&thick[..], &[50.0, 48.0, 47.0]].concat()));
        assert!(is_layer(&[&thick[..], &[150.0, 200.0, 210.0]].concat()));
        assert!(is_layer(&[100.0, 40.0, 30.0, 25.0]));
        // The limb by day, flat ground in moonlight, and one that becomes darker only far from its edge.
        assert!(!is_layer(&[80.0, 90.0, 95.0, 100.0, 110.0, 120.0, 130.0, 130.0, 120.0, 130.0, 130.0, 130.0, 130.0]));
        assert!(!is_layer(&[50.0; 13]));
        assert!(!is_layer(&[60.0, 60.0, 60.0, 60.0, 60.0, 60.0, 60.0, 60.0, 60.0, 60.0, 60.0, 60.0, 20.0]));
        // A street, behind which the light rises again after 40 km, and a trough that is noise.
        assert!(!is_layer(&[100.0, 20.0, 20.0, 90.0, 100.0, 100.0]));
        assert!(!is_layer(&[0.4, 0.0, 0.0, 0.0]));
        assert!(!is_layer(&[]));
    }

    #[test]
    fn a_trough_is_deeper_than_the_noise_and_may_go_on() {
        let sky = Sky { lit: 0.0, median: 10.0, spread: 10.0 };
        let has = |lights: &[f64]| has_trough(&lights.iter().map(|light| light + 10.0).collect::<Profile<f64>>(), &sky);
        // Half of the spread is 5 counts.
        assert_eq!((has(&[20.0, 14.0, 14.0]), has(&[20.0, 16.0, 16.0])), (true, false));
        // Its light may stay as it is, also near the edge; it must not rise there by half of its depth.
        assert_eq!((has(&[100.0, 60.0, 60.0, 60.0]), has(&[100.0, 60.0, 60.0, 81.0])), (true, false));
    }

    /// Returns the light of a Chapman layer at these depths below its edge, where half of its light is left, km.
    fn light_below(thick_km: f64, depths_km: impl Iterator<Item = f64>) -> Profile<f64> {
        let light = |above_peak_km: f64| -> f64 {
            (0..8000).fold(0.0, |sum, i| {
                let height_km = (6461.0 + above_peak_km).hypot((f64::from(i) + 0.5) * 0.25) - 6461.0;
                let z = height_km / thick_km;
                sum + (1.0 - z - (-z).exp()).exp()
            })
        };
        let at = |i: i32| f64::from(i) * 0.05 * thick_km;
        let most = (-40..20).map(|i| light(at(i))).fold(0.0, f64::max);
        let edge = at((0..200).find(|&i| light(at(i)) < 0.5 * most).unwrap());
        depths_km.map(|depth| 100.0 * light(edge - depth) / most).collect()
    }

    #[test]
    fn a_layer_is_seen_below_its_edge() {
        for thick_km in [3.0 / 2.446, 3.0, 7.5, 12.0] {
            let profile = light_below(thick_km, (1..=8).map(|k| f64::from(k) * STEP_M * 1e-3));
            assert!(is_layer(&profile), "{thick_km} km: {profile:.1?}");
        }
        // Lines of cities, narrow and wide, behind which the ground is as dark as before them.
        assert!(!is_layer(&[100.0, 60.0, 20.0, 5.0, 2.0, 2.0, 2.0, 2.0]));
        assert!(!is_layer(&[90.0, 100.0, 95.0, 90.0, 80.0, 50.0, 20.0, 3.0, 0.0, 0.0]));
    }
}
