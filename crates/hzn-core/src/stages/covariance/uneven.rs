//! Errors from a limb whose height changes along the edge, in kilometres of height.
//!
//! Near the middle of the arc, a height is A + B sin δ + D (1 − cos δ), with the azimuth δ from the middle. The fit
//! takes all of it for another cone: with u = |∂cos α/∂d|, the axis moves by −u D/sin α towards the middle and by u
//! B/sin α along the arc, and cos α by −u (A + D). No residual shows these errors, so that they follow from what is
//! known of the limb, at a few operations for each picture. They are added after the fusion and change no weight; the
//! free fit, from which a rig and a filter compute these errors themselves, does not have them.

use super::fusion::fixed_half_angle_gain;
use crate::base::linalg::{M3, V3, basis};
use crate::base::real::Real;
use crate::model::body::Expected;
use crate::model::error_budget::Term;
use crate::stages::fit::Fit;

/// Part of the half length of an arc at which its height is taken, on both sides of the middle: a straight line through
/// the two is the one that fits the arc best (√(3/5), the node of Gauss and Legendre).
const NODE: f64 = 0.774_596_669_241_483_4;
/// Mean square of a part that is evenly distributed from 0 to 1.
const MEAN_SQUARE: f64 = 1.0 / 3.0;
/// Sine of the lowest elevation of the Sun at the middle of an arc that is seen, −2°: a limb then has a quarter of its
/// light.
const SEEN: f64 = -0.034_899_496_702_500_97;
/// Azimuths of the Sun from the middle of the arc if only its elevation is known: cosine and sine of 22.5° and 67.5°,
/// and of their mirror images on the far side.
const AZIMUTHS: [[f64; 2]; 4] = {
    const C: f64 = 0.923_879_532_511_286_7;
    const S: f64 = 0.382_683_432_365_089_8;
    [[C, S], [S, C], [-S, C], [-C, S]]
};

/// Calls `add` with each term and its covariance of (δ₁₂, δc). `shown` is the variance of the axis, rad², that the
/// residuals of the picture already add for a tilt and a bend. `light` is the covariance from light that changes along
/// the edge.
pub(super) fn add_terms<T: Real>(
    fit: &Fit<T>,
    expected: &Expected<T>,
    shown: T,
    light: Option<M3<T>>,
    mut add: impl FnMut(Term, &M3<T>),
) {
    add(Term::LimbTilt, &tilt(expected));
    let rise = low_sun(fit, expected, shown);
    if let Some(p) = rise.into_iter().chain(light).reduce(|a, b| a + b) {
        add(Term::LowSun, &p);
    }
}

/// Returns the covariance of (δ₁₂, δc) from a tilt of the limb.
fn tilt<T: Real>(expected: &Expected<T>) -> M3<T> {
    let variance = expected.tilt_rad() * expected.tilt_rad();
    let mut p = M3::zeros();
    (p.m11, p.m22) = (variance, variance);
    p
}

/// Returns the covariance of (δ₁₂, δc) from a Sun that is low over a part of the limb; `None` where it is unknown or
/// high.
///
/// The rise of the edge lies between nothing and that of light which is scattered once. A low Sun that the residuals
/// show counts only once.
fn low_sun<T: Real>(fit: &Fit<T>, expected: &Expected<T>, shown: T) -> Option<M3<T>> {
    // The position of a body has its own term for the light.
    if expected.target().is_some() || !(expected.scale_height_m > T::ZERO) {
        return None;
    }
    let arc = Arc::new(fit, expected);
    let mut p = M3::zeros();
    if let Some(sun) = &expected.sun_seen {
        arc.add(&mut p, [sun.dot(&fit.e), sun.dot(&arc.to), sun.dot(&arc.along)], T::one(), shown);
    } else {
        let (sin, cos) = expected.sun_elevation_rad?.sin_cos();
        // The two sides of the middle are equally likely.
        let sides = || AZIMUTHS.into_iter().flat_map(|[c, s]| [[c, s], [c, -s]]);
        let suns =
            || sides().map(|[c, s]| [-sin, cos * T::from_f64(c), cos * T::from_f64(s)]).filter(|s| arc.is_seen(s));
        let count = suns().count();
        if count == 0 {
            return None;
        }
        suns().for_each(|sun| arc.add(&mut p, sun, T::one() / T::from_i32(count as i32), shown));
    }
    Some(p)
}

/// The arc that was fitted.
struct Arc<'a, T> {
    expected: &'a Expected<T>,
    /// Tangents at the axis, towards the middle of the arc and along it, and the basis of δ₁₂.
    to: V3<T>,
    along: V3<T>,
    turn: [T; 2],
    /// Sine and cosine of the azimuth from the middle at which the height is taken.
    node: (T, T),
    /// Change of the axis for δc = 1 if the half-angle was not fitted.
    fixed: Option<[T; 2]>,
}

impl<'a, T: Real> Arc<'a, T> {
    fn new(fit: &Fit<T>, expected: &'a Expected<T>) -> Self {
        let (b1, b2) = basis(&fit.e);
        let [x, y] = fit.mean;
        let length = (x * x + y * y).sqrt();
        // The middle of a whole ring may be anywhere.
        let turn = if length > T::from_f64(1e-6) { [x / length, y / length] } else { [T::one(), T::ZERO] };
        // The mean of an arc of the half length ζ is sin ζ/ζ of the radius from the centre; this is ζ within 4 %.
        let missing = (T::one() - length / expected.sin.max(T::from_f64(1e-6))).max(T::ZERO);
        let half_length = (missing * T::from_f64(6.0)).sqrt() * (T::one() + missing * T::from_f64(0.28));
        // An arc shorter than two degrees has the slope of one that is.
        let node = (half_length.max(T::from_f64(0.0175)) * T::from_f64(NODE)).sin_cos();
        Self {
            expected,
            to: b1 * turn[0] + b2 * turn[1],
            along: b2 * turn[0] - b1 * turn[1],
            turn,
            node,
            fixed: fixed_half_angle_gain(fit).filter(|_| !fit.free),
        }
    }

    /// Returns the sine of the Sun's elevation at the azimuth with this cosine and sine from the middle. The Sun is in
    /// the direction with these components on the axis, towards the middle and along the arc.
    fn elevation(&self, [down, to, along]: [T; 3], (c, s): (T, T)) -> T {
        (to * c + along * s) * self.expected.cos - down * self.expected.sin
    }

    /// Returns whether the middle of the arc has enough light to be seen.
    fn is_seen(&self, sun: &[T; 3]) -> bool {
        self.elevation(*sun, (T::one(), T::ZERO)) > T::from_f64(SEEN)
    }

    /// Adds the covariance for a Sun in this direction.
    fn add(&self, p: &mut M3<T>, sun: [T; 3], part: T, shown: T) {
        let sin = self.expected.sin;
        let (s, c) = self.node;
        let height = |c: T, s: T| self.expected.raised_by_low_sun_m(self.elevation(sun, (c, s)));
        let [here, left, right] = [height(T::one(), T::ZERO), height(c, -s), height(c, s)];
        let half = T::from_f64(0.5);
        let slope = (right - left) * half / s;
        let bend = ((right + left) * half - here) / (T::one() - c);
        let by_height = self.expected.cos_per_m();
        let by_angle = by_height / sin.max(T::from_f64(1e-6));
        let mean_square = T::from_f64(MEAN_SQUARE);
        // What the residuals do not show of the slope and of the bend.
        let variance = (slope * slope + bend * bend) * by_angle * by_angle * mean_square;
        let rest = if variance > shown { (T::one() - shown / variance).sqrt() } else { T::ZERO };
        let (slope, bend) = (slope * rest, bend * rest);
        let mut v = V3::new(
            (-bend * self.turn[0] - slope * self.turn[1]) * by_angle,
            (-bend * self.turn[1] + slope * self.turn[0]) * by_angle,
            -(here + bend) * by_height,
        );
        if let Some([k1, k2]) = self.fixed {
            v = V3::new(v.x - k1 * v.z, v.y - k2 * v.z, T::ZERO);
        }
        *p += v * v.transpose() * (mean_square * part);
    }
}
