//! The turn of a direction from one picture of a sequence to a later one.

use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::geometry::frames::{Cam, Fixed, Rotation, UnitVec3};
use crate::model::body::Prior;

/// Fastest turn of the direction to a body in an orbit, rad/s: √(μ/R³) of the Earth, whose density is the largest of
/// all planets and moons. It bounds what the rates do not say: the direction to the body turns in an orbit.
const ORBIT_RAD_S: f64 = 1.24e-3;
/// 1σ of the mean of two rates, as a part of their difference: 1/√12, as the change may come at any time between them.
const RATE_SHARE: f64 = 0.288_675;
/// 1σ of a prior attitude that has none, degrees; the value of `Prior::attitude_sigma_rad`.
const ATTITUDE_SIGMA_DEG: f64 = 5.0;

/// What is known about the motion from one picture to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step<T> {
    /// Time since the picture before, seconds; `None` if it is not known. The time may also be zero or negative.
    pub after_s: Option<T>,
    /// Rate of rotation of the camera in this picture, in its own axes, rad/s.
    pub rate_rad_s: Option<[T; 3]>,
    /// Attitude in this picture, from the camera to the fixed frame, and its 1-sigma in radians.
    pub attitude: Option<(Rotation<Cam, Fixed, T>, T)>,
}

impl<T: Real> Step<T> {
    /// Returns the step with the rate and the attitude of a picture's prior.
    pub fn from_prior(prior: &Prior<T>, after_s: Option<T>) -> Self {
        let sigma = prior.attitude_sigma_rad.unwrap_or(T::from_f64(ATTITUDE_SIGMA_DEG.to_radians()));
        let attitude = prior.fixed_from_camera.map(|rotation| (rotation, sigma));
        Self { after_s, rate_rad_s: prior.rate_rad_s, attitude }
    }
}

/// An earlier answer, moved on to the newest picture.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Reference<T> {
    pub(super) axis: UnitVec3<Cam, T>,
    pub(super) noise_rad: T,
    pub(super) age_s: T,
    /// Its direction in the camera of the newest picture, by the rates.
    by_rates: Option<UnitVec3<Cam, T>>,
    /// 1-sigma of the turn by the rates, without that of the orbit.
    rates_sigma_rad: T,
    /// Its direction in the fixed frame, by the attitude of its picture, and the 1-sigma of that attitude.
    fixed: Option<(UnitVec3<Fixed, T>, T)>,
}

impl<T: Real> Reference<T> {
    pub(super) fn new(axis: UnitVec3<Cam, T>, noise_rad: T, step: &Step<T>) -> Self {
        let fixed = step.attitude.map(|(rotation, sigma)| (rotation.apply(&axis), sigma));
        let by_rates = step.rate_rad_s.map(|_| axis);
        Self { axis, noise_rad, age_s: T::zero(), by_rates, rates_sigma_rad: T::zero(), fixed }
    }

    /// Moves the reference on by the turn from one picture to the next.
    pub(super) fn advance(&mut self, after_s: T, before: Option<[T; 3]>, now: Option<[T; 3]>) {
        self.age_s += after_s.abs();
        let (Some(before), Some(now), Some(axis)) = (before, now, self.by_rates) else {
            self.by_rates = None;
            return;
        };
        let (before, now) = (V3::from(before), V3::from(now));
        let change = now - before;
        self.rates_sigma_rad += change.dot(&change).sqrt() * after_s.abs() * T::from_f64(RATE_SHARE);
        // The camera turns by this, so that a direction at rest turns back in its axes.
        let turn = (before + now) * (-after_s * T::from_f64(0.5));
        self.by_rates = Some(turn_by(&axis, &turn));
    }

    /// Returns where the direction is in the newest picture, with the 1-sigma of the turn: by the rates or by the
    /// attitudes, whichever is more certain.
    pub(super) fn expected(&self, step: &Step<T>) -> Option<(UnitVec3<Cam, T>, T)> {
        let orbit = T::from_f64(ORBIT_RAD_S) * self.age_s;
        let by_rates = self.by_rates.map(|axis| (axis, self.rates_sigma_rad + orbit));
        let by_attitude = self.fixed.zip(step.attitude).map(|((direction, before), (rotation, now))| {
            (rotation.inverse().apply(&direction), (before * before + now * now).sqrt() + orbit)
        });
        match (by_rates, by_attitude) {
            (Some(rates), Some(attitude)) => Some(if attitude.1 < rates.1 { attitude } else { rates }),
            (rates, attitude) => rates.or(attitude),
        }
    }
}

/// Returns a direction after a rotation by a vector, radians.
pub(super) fn turn_by<T: Real>(axis: &UnitVec3<Cam, T>, turn: &V3<T>) -> UnitVec3<Cam, T> {
    let angle = turn.dot(turn).sqrt();
    if !(angle > T::zero() && angle.is_finite()) {
        return *axis;
    }
    let (sin, cos) = angle.sin_cos();
    let (about, v) = (turn * (T::one() / angle), axis.v());
    let turned = v * cos + about.cross(v) * sin + about * (about.dot(v) * (T::one() - cos));
    // Made a unit vector again, because the rounding of thousands of pictures adds up.
    UnitVec3::try_new([turned.x, turned.y, turned.z]).unwrap_or(*axis)
}
