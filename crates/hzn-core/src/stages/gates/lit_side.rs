//! Gate: the picture shows from which side the Sun lights a body, and a given Sun must agree.
//!
//! With a wrong direction to the Sun, the points of the terminator count as limb, and those of the limb do not. The
//! fitted circle is then near the body, and its points have small residuals, but its lit side is the dark one.
//!
//! At each place of a ring within the fitted limb, the given Sun predicts a brightness. The law of Lommel and Seeliger,
//! μ₀/(μ₀ + μ), holds for bodies without air; a body with clouds has more contrast between day and night. A place and
//! its mirror image about the limb's centre line have the same μ, so that their difference comes from the Sun alone,
//! and darkening towards the limb does not matter. The differences of the picture are compared with the predicted ones,
//! and also with those of a Sun whose azimuth is a right angle away.
//!
//! A Sun behind the body predicts a night side instead, which must be dark. A direction with the wrong sign turns a
//! body that is nearly full into such a crescent.

use super::case::{Case, refuse_if};
use crate::base::linalg::{V3, unit};
use crate::base::real::Real;
use crate::geometry::frames::UnitVec3;
use crate::image::Pixels;
use crate::model::observer::Observer;
use crate::model::verdict::Verdict;
use crate::stages::contour::BinaryPicture;

/// Number of places on a ring, a multiple of four, so that each place has its mirror image and its place a right angle
/// away.
const PLACES: usize = 16;
/// cos and sin of the azimuths of the first quarter of a ring. The first place is half a step from the Sun's azimuth.
const QUARTER: [[f64; 2]; PLACES / 4] = [
    [0.980_785_280_403_230_4, 0.195_090_322_016_128_26],
    [0.831_469_612_302_545_2, 0.555_570_233_019_602_2],
    [0.555_570_233_019_602_2, 0.831_469_612_302_545_2],
    [0.195_090_322_016_128_26, 0.980_785_280_403_230_4],
];
/// Radii of the rings, as parts of the limb's.
const RINGS: [f64; 2] = [0.5, 0.8];
/// Smallest predicted difference (RMS) between a place and its mirror image, as a part of the mean brightness.
///
/// A difference of 0.4 of the mean is a ratio of 1.5 between both sides. So much, dark and bright ground can differ
/// from hemisphere to hemisphere. A body at a phase angle below 25° is lit more evenly; its terminator is then within
/// 9 % of the radius from the limb.
const LEAST_CONTRAST: f64 = 0.4;
/// Number of standard deviations by which the picture must contradict the given Sun.
const SIGMAS: f64 = 3.0;
/// Sine of the Sun's elevation below which a place is dark, 6° below the horizon: air scatters light beyond the
/// terminator.
const NIGHT: f64 = -0.104_528_463_267_653_47;
/// Fewest places of the night side, and fewest pairs, that count: a quarter of all, and half of all.
const LEAST: i32 = 8;
/// Factor from the sigma of independent places to that of neighbouring ones: bright ground is as large as four pairs
/// of places.
const CORRELATED: f64 = 2.0;

/// Refuses a limb within which the picture contradicts the given Sun. Either the light comes from an azimuth more than
/// 45° away, or most places that the Sun does not light are bright.
///
/// Of a picture that came row by row, only lit and dark pixels are left, which show no differences of brightness.
pub(super) fn refuse<T: Real, P: Pixels, O: Observer<T>>(
    case: &Case<'_, T>,
    binary: &BinaryPicture<'_, T, P, O>,
) -> Result<(), Verdict> {
    let Some(sun) = case.expected.sun_seen.as_ref().filter(|_| !P::STREAMED && case.config.max_unlit < 1.0) else {
        return Ok(());
    };
    refuse_if(look_within(case, sun, binary).is_some_and(|light| light.contradicts()), Verdict::Sun)
}

/// Sums over the places within a limb.
struct Light<T> {
    /// Number of places that the Sun does not light, and how many of them are bright.
    night: i32,
    bright: i32,
    /// Number of pairs of a place and its mirror image. The sums below are over them.
    pairs: i32,
    /// Sum of the predicted brightness, and of the squared predicted difference.
    brightness: T,
    predicted2: T,
    /// Sum of the predicted difference times that of the picture, for the given Sun and for one a right angle away.
    along: T,
    across: T,
    /// Sum of the squared differences of the picture, for both.
    seen2: T,
}

impl<T: Real> Light<T> {
    fn contradicts(&self) -> bool {
        (self.night >= LEAST && self.bright * 2 > self.night) || (self.pairs >= LEAST && self.comes_from_aside())
    }

    /// Returns whether the light comes from another side than the given Sun, with certainty.
    ///
    /// Let d = a t + b t′ + noise be a difference of the picture, with the predicted differences t of the given Sun and
    /// t′ of the one a right angle away. The least squares are a = Σ t d/Σ t² and b. The noise of the residuals, mostly
    /// dark and bright ground, gives their sigma.
    fn comes_from_aside(&self) -> bool {
        let n = T::from_i32(self.pairs.max(1));
        let least = self.brightness / (n + n) * T::from_f64(LEAST_CONTRAST);
        if !(self.predicted2 > least * least * n) {
            return false;
        }
        let (a, b) = (self.along / self.predicted2, self.across / self.predicted2);
        let unexplained = (self.seen2 - (a * a + b * b) * self.predicted2).max(T::ZERO);
        let sigma = (unexplained / ((n + n) * self.predicted2)).sqrt() * T::from_f64(CORRELATED);
        b.abs() - a > sigma * T::from_f64(SIGMAS)
    }
}

/// Compares the picture with the given Sun at the places that are in the picture; `None` if the Sun is in line with the
/// body.
fn look_within<T: Real, P: Pixels, O: Observer<T>>(
    case: &Case<'_, T>,
    sun: &V3<T>,
    binary: &BinaryPicture<'_, T, P, O>,
) -> Option<Light<T>> {
    let (e, c) = (&case.fused.e, case.fused.c);
    let sin = (T::one() - c * c).max(T::EPSILON).sqrt();
    let towards_sun = unit(&(sun - e * e.dot(sun)))?;
    let beside = e.cross(&towards_sun);
    let (night, zero) = (T::from_f64(NIGHT), T::ZERO);
    let mut light = Light {
        night: 0,
        bright: 0,
        pairs: 0,
        brightness: zero,
        predicted2: zero,
        along: zero,
        across: zero,
        seen2: zero,
    };
    for ring in RINGS.map(T::from_f64) {
        let mut seen = [None; PLACES];
        let mut predicted = [zero; PLACES];
        // The body has the radius 1 and its centre at e/sin α. Its visible cap ends where the normal is 90° − α from
        // −e.
        let out = ring * c;
        let up = (T::one() - out * out).sqrt();
        for (i, (seen, predicted)) in seen.iter_mut().zip(&mut predicted).enumerate() {
            let [cos_azimuth, sin_azimuth] = azimuth(i).map(T::from_f64);
            let normal = (towards_sun * cos_azimuth + beside * sin_azimuth) * out - e * up;
            let ray = unit(&(e + normal * sin))?;
            let (mu, mu0) = (-normal.dot(&ray), normal.dot(sun));
            if mu0 > zero {
                *predicted = mu0 / (mu0 + mu);
            }
            let Some(here) = brightness(&ray, case, binary) else { continue };
            *seen = Some(T::from_i32(here.into()));
            if mu0 < night {
                light.night += 1;
                light.bright += i32::from(here >= binary.level);
            }
        }
        light.add_pairs(&seen, &predicted);
    }
    Some(light)
}

impl<T: Real> Light<T> {
    /// Adds the pairs of a ring of which every place is in the picture.
    fn add_pairs(&mut self, seen: &[Option<T>; PLACES], predicted: &[T; PLACES]) {
        let seen_at = |i: usize| seen.get(i % PLACES).copied().flatten();
        let predicted_at = |i: usize| predicted.get(i % PLACES).copied().unwrap_or(T::ZERO);
        let quarter = PLACES / 4;
        // The half of the ring on the Sun's side: the quarters before and after its azimuth.
        for i in (0..quarter).chain(PLACES - quarter..PLACES) {
            // The mirror image of the azimuth φ about the line across is π − φ.
            let mirror = PLACES + PLACES / 2 - 1 - i;
            let places = [i, mirror, i + quarter, mirror + quarter].map(seen_at);
            let [Some(here), Some(there), Some(here_across), Some(there_across)] = places else { continue };
            let (sunny, shady) = (predicted_at(i), predicted_at(mirror));
            let (t, along, across) = (sunny - shady, here - there, here_across - there_across);
            self.pairs += 1;
            self.brightness += sunny + shady;
            self.predicted2 += t * t;
            self.along += t * along;
            self.across += t * across;
            self.seen2 += along * along + across * across;
        }
    }
}

/// Returns cos and sin of the azimuth of a place on a ring.
fn azimuth(place: usize) -> [f64; 2] {
    let [cos, sin] = QUARTER.get(place % QUARTER.len()).copied().unwrap_or_default();
    match place / QUARTER.len() {
        0 => [cos, sin],
        1 => [-sin, cos],
        2 => [-cos, -sin],
        _ => [sin, -cos],
    }
}

/// Returns the brightness of the picture in a direction; `None` where the picture shows nothing.
fn brightness<T: Real, P: Pixels, O: Observer<T>>(
    ray: &V3<T>,
    case: &Case<'_, T>,
    binary: &BinaryPicture<'_, T, P, O>,
) -> Option<u16> {
    let at = case.camera.project(&UnitVec3::assume_unit(*ray))?;
    let half = T::from_f64(0.5);
    let (x, y) = (u16::try_from((at.u + half).to_i32()).ok()?, u16::try_from((at.v + half).to_i32()).ok()?);
    let is_seen = binary.region.contains(x, y) && !binary.masked(x, y);
    is_seen.then(|| binary.brightness(x, y))
}

#[cfg(test)]
mod tests {
    use super::*;

    const NONE: Light<f64> =
        Light { night: 0, bright: 0, pairs: 0, brightness: 0.0, predicted2: 0.0, along: 0.0, across: 0.0, seen2: 0.0 };

    /// Returns the azimuths of the places of a ring from that of the Sun.
    fn turn(place: usize) -> f64 {
        (place as f64 + 0.5) * core::f64::consts::TAU / PLACES as f64
    }

    #[test]
    fn places_are_evenly_around_the_ring() {
        for place in 0..PLACES {
            let (sin, cos) = libm::sincos(turn(place));
            let [x, y] = azimuth(place);
            assert!((x - cos).abs() < 1e-15 && (y - sin).abs() < 1e-15, "{place}");
        }
    }

    /// A ring lit from an angle off the told Sun, and one that the told Sun lights.
    fn ring(off: f64, contrast: f64) -> Light<f64> {
        let light = |place: usize, off: f64| 1.0 + contrast * libm::cos(turn(place) - off);
        let predicted: [f64; PLACES] = core::array::from_fn(|place| light(place, 0.0));
        let seen: [Option<f64>; PLACES] = core::array::from_fn(|place| Some(100.0 * light(place, off)));
        let mut sums = NONE;
        sums.add_pairs(&seen, &predicted);
        sums
    }

    /// The differences of mirror images are 2 k cos φ. Over the eight pairs of a half ring, Σ cos² φ is 4.
    #[test]
    fn sums_are_those_of_mirror_images() {
        for off in [0.0, 0.3, -1.2, 2.0, 3.1] {
            let sums = ring(off, 0.9);
            let near = |found: f64, want: f64| assert!((found - want).abs() < 1e-9, "{off}: {found} {want}");
            assert_eq!(sums.pairs, 8);
            near(sums.brightness, 16.0);
            near(sums.predicted2, 16.0 * 0.81);
            near(sums.along, 1600.0 * 0.81 * libm::cos(off));
            near(sums.across, 1600.0 * 0.81 * libm::sin(off));
            near(sums.seen2, 160_000.0 * 0.81);
        }
    }

    #[test]
    fn light_from_more_than_a_right_angle_half_aside_contradicts() {
        let aside = |deg: f64| ring(deg.to_radians(), 0.9).contradicts();
        for deg in [0.0, 20.0, 44.0, -44.0] {
            assert!(!aside(deg), "{deg}");
        }
        for deg in [46.0, -46.0, 90.0, 120.0, 180.0, -100.0] {
            assert!(aside(deg), "{deg}");
        }
        // A ring that is lit evenly says nothing: its contrast is the RMS of 2 k cos φ over the mean brightness.
        let least = 0.2 * core::f64::consts::SQRT_2;
        let even = |contrast: f64| ring(2.0, contrast).contradicts();
        assert!(!even(least * 0.99) && even(least * 1.01));
    }

    /// Of places that are not seen, the pairs do not count: each place is in two pairs, and in two of the other Sun.
    #[test]
    fn pairs_with_a_hidden_place_are_left_out() {
        for hidden in 0..PLACES {
            let mut seen = [Some(1.0); PLACES];
            seen[hidden] = None;
            let mut sums = NONE;
            sums.add_pairs(&seen, &[0.5; PLACES]);
            assert_eq!((sums.pairs, sums.brightness), (6, 6.0), "{hidden}");
        }
    }

    /// The noise of the residuals counts: three sigmas, each twice that of independent places.
    #[test]
    fn noise_makes_a_contradiction_uncertain() {
        // a = 0 and b = 1, and residuals with the sum of squares r: σ² = r/(2 n t²) with n t² = 8 · 16.
        let with = |residuals: f64| Light {
            pairs: 8,
            brightness: 16.0,
            predicted2: 16.0,
            along: 0.0,
            across: 16.0,
            seen2: 16.0 + residuals,
            ..NONE
        };
        let most = 256.0 / 36.0;
        assert!(with(most * 0.99).contradicts() && !with(most * 1.01).contradicts());
        // Fewer than eight pairs are no evidence.
        assert!(!Light { pairs: 7, ..with(0.0) }.contradicts());
    }

    #[test]
    fn most_places_of_the_night_must_be_dark() {
        let night = |night: i32, bright: i32| Light { night, bright, ..NONE }.contradicts();
        assert!(night(8, 5) && !night(8, 4) && !night(7, 7) && night(20, 11) && !night(20, 10));
    }
}
