//! The coarse direction to the body, from what all heads see of body and sky where no limb is found.
//!
//! Every direction on a sphere of directions is asked which places of the pictures it would make lit and dark. A
//! direction whose places contradict the pictures is improbable. With the parts w_k of the places of head k that
//! contradict it, its weight is
//!
//! ```text
//! exp(−Σ w_k / w̄)
//! ```
//!
//! Of all distributions of a positive number with the mean w̄, the exponential one assumes least. The answer is the
//! mean of the directions, and its sigma is the RMS of their angles to it: where only a region is known, this is its
//! size.
//!
//! A body in visible light may be dark: then a dark place says nothing. Without the direction to the Sun, day and night
//! are equally probable, and the same for all heads. With it, each place of the body is lit, dark, or in twilight.

use core::f64::consts::{FRAC_PI_2, TAU};

use super::glimpse::{Glimpse, PLACES};
use super::head::MOST_HEADS;
use super::mount::Mount;
use crate::base::linalg::{V3, unit};
use crate::base::real::Real;
use crate::geometry::camera::Camera;
use crate::geometry::frames::{UnitVec3, Vehicle};

/// Number of directions. They are 6 degrees from each other, and the part of the sigma that this adds is 3 degrees.
const DIRECTIONS: i32 = 1000;

/// Number of half-angles between their limits.
const HALF_ANGLES: i32 = 9;

/// Mean part of a picture that contradicts the true direction: clouds as dark as the sky, the Sun and its glare, parts
/// of the vehicle, and places at the limb itself. A twentieth is a disc of 17 degrees in a picture of 60 by 45.
const CONTRADICTING: f64 = 0.05;

/// Sine of the lowest elevation of the Sun at which a place is surely lit, 6 degrees. A lower Sun gives the ground less
/// than a tenth of the light of a high one.
pub(super) const SURELY_LIT: f64 = 0.1;

/// Half-angles of a body of unknown distance: a body that is smaller is no help, and nothing is nearer than its
/// surface.
const ANY_HALF_ANGLE_DEG: [f64; 2] = [5.0, 85.0];

/// A head, as the coarse direction takes it.
#[derive(Debug, Clone, Copy)]
pub struct GlimpsedHead<'a, T> {
    /// What it sees.
    pub glimpse: &'a Glimpse,
    /// Brightness at which a place is lit, counts.
    pub level: u16,
    /// The camera.
    pub camera: &'a Camera<T>,
    /// Its attitude on the vehicle.
    pub mount: &'a Mount<T>,
}

/// The light in which a body is seen.
#[derive(Debug, Clone, Copy)]
pub enum Light<T> {
    /// The body emits it: every part of the body is lit.
    Own,
    /// That of the Sun, in this direction from the vehicle, if it is known.
    Sun(Option<UnitVec3<Vehicle, T>>),
}

/// The coarse direction to a body.
#[derive(Debug, Clone, Copy)]
pub struct Coarse<T> {
    /// The direction in the axes of the vehicle.
    pub axis: UnitVec3<Vehicle, T>,
    /// RMS of the angles to the directions that fit what the heads see, radians.
    pub sigma_rad: T,
}

/// Returns the coarse direction to a body, from at most four heads.
///
/// `half_angle_rad` has the limits of its half-angle; `None` is a body of unknown distance. `None` is returned if the
/// heads do not even tell on which side of the vehicle the body is: the sigma would be 90 degrees or more.
pub fn coarse<'a, T: Real>(
    heads: impl IntoIterator<Item = GlimpsedHead<'a, T>>,
    half_angle_rad: Option<[T; 2]>,
    light: &Light<T>,
) -> Option<Coarse<T>> {
    let mut seen = heapless::Vec::<Seen<T>, MOST_HEADS>::new();
    for head in heads {
        // Further heads than four are no part of a rig.
        let _ = Seen::new(&head).map(|head| seen.push(head));
    }
    if seen.is_empty() {
        return None;
    }
    let [low, high] = half_angle_rad.unwrap_or(ANY_HALF_ANGLE_DEG.map(|deg| T::from_f64(deg.to_radians())));
    let mut sum = V3::zeros();
    // A second round finds the angles to the mean, so that no list of a thousand weights is needed.
    let mut total = T::ZERO;
    each(&seen, [low, high], light, |e, weight| {
        sum += e * weight;
        total += weight;
    });
    let axis = unit(&sum)?;
    let mut square = T::ZERO;
    each(&seen, [low, high], light, |e, weight| {
        let across = axis.cross(&e);
        let angle = across.dot(&across).sqrt().atan2(axis.dot(&e));
        square += angle * angle * weight;
    });
    // Each direction stands for an area of 4π/n, whose mean square distance from its middle is area/2π for a disc.
    let own = T::from_f64(2.0 / f64::from(DIRECTIONS));
    let sigma_rad = (square / total + own).sqrt();
    (sigma_rad < T::from_f64(FRAC_PI_2)).then(|| Coarse { axis: UnitVec3::assume_unit(axis), sigma_rad })
}

/// Calls `take` with each direction and its weight.
fn each<T: Real>(heads: &[Seen<T>], [low, high]: [T; 2], light: &Light<T>, mut take: impl FnMut(V3<T>, T)) {
    let count = if high > low { HALF_ANGLES } else { 1 };
    let step = (high - low) / T::from_i32(count);
    for i in 0..DIRECTIONS {
        let e = direction(i);
        let mut weight = T::ZERO;
        for k in 0..count {
            let half_angle = low + step * (T::from_i32(k) + T::from_f64(0.5));
            weight += likelihood(heads, &e, half_angle.sin_cos(), light);
        }
        take(e, weight);
    }
}

/// Returns a direction of a spiral around the sphere, whose directions are equally dense everywhere.
fn direction<T: Real>(i: i32) -> V3<T> {
    // The golden angle.
    const TURN: f64 = 0.381_966_011_250_105_1 * TAU;
    let z = T::one() - T::from_i32(2 * i + 1) / T::from_i32(DIRECTIONS);
    let across = (T::one() - z * z).max(T::ZERO).sqrt();
    let (s, c) = (T::from_i32(i) * T::from_f64(TURN)).sin_cos();
    V3::new(across * c, across * s, z)
}

/// Returns the likelihood of what the heads see, if the body is in the direction `e` and has this sine and cosine of
/// its half-angle.
fn likelihood<T: Real>(heads: &[Seen<T>], e: &V3<T>, (sin, cos): (T, T), light: &Light<T>) -> T {
    // The parts of the places that contradict: in any light, and only by day.
    let (mut always, mut by_day) = (T::ZERO, T::ZERO);
    for head in heads {
        let (mut wrong, mut dark) = (0, 0);
        for &(ray, is_lit) in &head.places {
            let along = ray.dot(e);
            if along <= cos {
                wrong += i32::from(is_lit);
                continue;
            }
            match light {
                Light::Own => wrong += i32::from(!is_lit),
                Light::Sun(None) => dark += i32::from(!is_lit),
                Light::Sun(Some(sun)) => {
                    let sine = sun_elevation_sine(&ray, e, along, sin, sun.v());
                    let is_wrong = if is_lit { sine < T::from_f64(DARKEST) } else { sine > T::from_f64(SURELY_LIT) };
                    wrong += i32::from(is_wrong);
                }
            }
        }
        let all = T::from_i32(head.places.len() as i32);
        always += T::from_i32(wrong) / all;
        by_day += T::from_i32(dark) / all;
    }
    let mean = T::from_f64(CONTRADICTING);
    let half = T::from_f64(0.5);
    let day = if matches!(light, Light::Sun(None)) { half + half * (-by_day / mean).exp() } else { T::one() };
    (-always / mean).exp() * day
}

/// Sine of the elevation of the Sun at the end of twilight, −18 degrees.
const DARKEST: f64 = -0.309_016_994_374_947_45;

/// Returns the sine of the Sun's elevation where a ray meets the body. The radius of the body is 1 here, so that its
/// centre is at the distance 1/sin α.
fn sun_elevation_sine<T: Real>(ray: &V3<T>, e: &V3<T>, along: T, sin: T, sun: &V3<T>) -> T {
    let distance = T::one() / sin;
    let middle = distance * along;
    let chord = (T::one() - (distance * distance - middle * middle)).max(T::ZERO).sqrt();
    (ray * (middle - chord) - e * distance).dot(sun)
}

/// The places of a head as rays in the axes of the vehicle, and whether each is lit.
struct Seen<T> {
    places: heapless::Vec<(V3<T>, bool), PLACES>,
}

impl<T: Real> Seen<T> {
    fn new(head: &GlimpsedHead<'_, T>) -> Option<Self> {
        let turn = head.mount.after(T::ZERO, None)?;
        let ray = |(point, counts)| Some((*turn.apply(&head.camera.unproject(point)?).v(), counts >= head.level));
        let places: heapless::Vec<_, PLACES> = head.glimpse.seen().filter_map(ray).collect();
        (!places.is_empty()).then_some(Self { places })
    }
}

#[cfg(test)]
mod tests;
