//! The comparison of answers with the turn of the vehicle: an edge that stays in the picture while the vehicle turns is
//! no limb.
//!
//! An earlier answer a₀ is kept, the reference. The turn says where its direction is in a later picture, a₀'. The
//! answer to that picture, a₁, is compared with both:
//!
//! ```text
//!   limb   χ²_limb  = |a₁ − a₀'|² / (σ₀² + σ₁² + σ_turn²)
//!   fixed  χ²_fixed = |a₁ − a₀|²  / (σ₀² + σ₁²)
//! ```
//!
//! σ₀ and σ₁ are the larger standard deviations of the errors that pictures do not share. With the whole covariance, a
//! turn of many degrees would not be noticed: nearly all of it is the same error in both pictures, and cancels. The
//! edge is fixed if χ²_limb − χ²_fixed > k² and χ²_fixed ≤ k². For a limb, the difference is distributed as N(−Δ², 4Δ²)
//! with the turn Δ in standard deviations. It is above k² with a probability of at most Φ(−k), which it reaches at Δ =
//! k.

use super::reference::{Reference, Step};
use crate::base::real::Real;
use crate::geometry::frames::{Cam, UnitVec3};
use crate::model::report::Report;
use crate::model::verdict::Verdict;
use crate::stages::gates::{Config, FixedEdge};

/// A reference is kept until the turn is this many times k standard deviations.
// A slow vehicle shows its turn over several pictures. At twice k, an edge that is fixed is noticed with a probability
// of 98 %, and a younger reference has a turn that is known better.
const ENOUGH: f64 = 2.0;

/// Compares the answers of one body in a sequence of pictures with the turn of the vehicle, see
/// [`gates.fixed_edge`](Config::fixed_edge).
///
/// Every picture of the sequence must be shown, in order, also one without an answer.
///
/// ```
/// use hzn_core::{Sequence, Step, frames::UnitVec3, gates};
///
/// let mut sequence = Sequence::<f64>::default();
/// let config = gates::Config::default();
/// let step = Step { after_s: Some(1.0), rate_rad_s: Some([0.1, 0.0, 0.0]), attitude: None };
/// let axis = UnitVec3::try_new([0.0, 0.5, 0.8]).expect("not of length zero");
/// assert!(!sequence.see(&step, Some((axis, 1e-3)), &config));
/// // After a turn of 5.7 degrees the edge is still in the same place.
/// assert!(sequence.see(&step, Some((axis, 1e-3)), &config));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Sequence<T> {
    reference: Option<Reference<T>>,
    /// The rate in the picture before.
    rate_rad_s: Option<[T; 3]>,
}

impl<T> Default for Sequence<T> {
    fn default() -> Self {
        Self { reference: None, rate_rad_s: None }
    }
}

impl<T: Real> Sequence<T> {
    /// Takes the next picture: its step, and its answer with the larger standard deviation of the errors that pictures
    /// do not share, in radians ([`Solution::noise_rad`](crate::Solution::noise_rad)). Returns whether the edge is
    /// fixed in the picture.
    pub fn see(&mut self, step: &Step<T>, answer: Option<(UnitVec3<Cam, T>, T)>, config: &Config) -> bool {
        let before = self.rate_rad_s;
        self.rate_rad_s = step.rate_rad_s;
        match (step.after_s, &mut self.reference) {
            (Some(after_s), Some(reference)) => reference.advance(after_s, before, step.rate_rad_s),
            // Without a time nothing is known about the turn.
            (None, _) => self.reference = None,
            (Some(_), None) => {}
        }
        let Some((axis, noise_rad)) = answer else { return false };
        let compared = self.reference.as_ref().map(|reference| compare(reference, step, &axis, noise_rad, config));
        let compared = compared.unwrap_or(Compared::Replace);
        if compared == Compared::Replace {
            self.reference = Some(Reference::new(axis, noise_rad, step));
        }
        compared == Compared::Fixed
    }

    /// Takes the next picture with its report. If the edge of the answer is fixed in the picture, the report gets the
    /// verdict [`Verdict::Fixed`] and loses the answer, or is marked as suspect. Returns whether the edge is fixed.
    pub fn judge(&mut self, step: &Step<T>, report: &mut Report<T>, config: &Config) -> bool {
        if config.fixed_edge == FixedEdge::Off {
            return false;
        }
        let answer = report.solution.as_ref().map(|solution| (solution.axis, solution.noise_rad()));
        let is_fixed = self.see(step, answer, config);
        if is_fixed {
            doubt(report, config);
        }
        is_fixed
    }

    /// Judges the answer to a picture that is an earlier one to the last bit although its time is another: the camera
    /// or its recorder stands still, and the edge of the time before is in the picture, whether the vehicle turns or
    /// not. It has the same effect as an edge that is fixed.
    pub fn judge_repeat(&self, report: &mut Report<T>, config: &Config) {
        if config.fixed_edge != FixedEdge::Off && report.solution.is_some() {
            doubt(report, config);
        }
    }
}

/// Refuses an answer whose edge is fixed, or marks it as suspect.
fn doubt<T: Real>(report: &mut Report<T>, config: &Config) {
    match config.fixed_edge {
        FixedEdge::Refuse => report.reject(Verdict::Fixed),
        FixedEdge::Warn | FixedEdge::Off => report.is_suspect = true,
    }
}

/// The comparison of an answer with the reference.
#[derive(PartialEq)]
enum Compared {
    /// The edge is fixed in the picture. The reference stays, so that the next picture is compared with it, too.
    Fixed,
    /// The turn is still too small to tell, and the reference stays.
    Keep,
    /// The answer becomes the reference.
    Replace,
}

fn compare<T: Real>(
    reference: &Reference<T>,
    step: &Step<T>,
    axis: &UnitVec3<Cam, T>,
    noise_rad: T,
    config: &Config,
) -> Compared {
    let Some((expected, turn_sigma)) = reference.expected(step) else { return Compared::Replace };
    let square = |x: T| x * x;
    let noise = square(reference.noise_rad) + square(noise_rad);
    let all = noise + square(turn_sigma);
    let limit = square(T::from_f64(config.fixed_edge_sigma));
    // Each comparison is without a division, because a noise of zero is possible.
    let from_limb = square(expected.angle_rad(axis)) * noise;
    let from_fixed = square(reference.axis.angle_rad(axis)) * all;
    if from_fixed <= limit * noise * all && from_limb - from_fixed > limit * noise * all {
        return Compared::Fixed;
    }
    let turned = square(expected.angle_rad(&reference.axis));
    let is_enough = turned > square(T::from_f64(ENOUGH)) * limit * all;
    let contradicts = from_limb > limit * noise * all;
    // An uncertain turn does not become more certain with further pictures.
    let is_uncertain = square(turn_sigma) > noise;
    if is_enough || contradicts || is_uncertain { Compared::Replace } else { Compared::Keep }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::super::reference::turn_by;
    use super::*;
    use crate::base::linalg::V3;
    use crate::geometry::frames::Rotation;

    const NOISE: f64 = 1e-3;

    fn direction<T: Real>(v: [f64; 3]) -> UnitVec3<Cam, T> {
        UnitVec3::try_new(v.map(T::from_f64)).unwrap()
    }

    fn step<T: Real>(rate: [f64; 3]) -> Step<T> {
        Step { after_s: Some(T::one()), rate_rad_s: Some(rate.map(T::from_f64)), attitude: None }
    }

    /// Returns which of ten answers are fixed, each after a second at this rate. The answers turn with the vehicle by
    /// this part of its turn: 1 for a limb, 0 for an edge of the window.
    fn fixed_of<T: Real>(rate_rad_s: f64, part: f64) -> Vec<bool> {
        let (mut sequence, config) = (Sequence::<T>::default(), Config::default());
        let see = |i: i32| {
            // The camera turns about its x axis, and a direction at rest turns the other way: from z to y.
            let (sin, cos) = libm::sincos(0.6 + part * rate_rad_s * f64::from(i));
            let answer = Some((direction([0.0, sin, cos]), T::from_f64(NOISE)));
            sequence.see(&step([rate_rad_s, 0.0, 0.0]), answer, &config)
        };
        (0..10).map(see).collect()
    }

    #[test]
    fn an_edge_of_the_window_is_fixed_and_a_limb_is_not() {
        for rate in [0.02, -0.02, 0.3] {
            assert_eq!(fixed_of::<f64>(rate, 1.0), [false; 10], "limb at {rate}");
            assert_eq!(fixed_of::<f32>(rate, 1.0), [false; 10], "limb at {rate}");
            let after_the_first: Vec<bool> = (0..10).map(|i| i > 0).collect();
            assert_eq!(fixed_of::<f64>(rate, 0.0), after_the_first, "window at {rate}");
            assert_eq!(fixed_of::<f32>(rate, 0.0), after_the_first, "window at {rate}");
        }
        // A satellite that keeps its face to the Earth turns with its orbit, and the limb stays in the picture.
        assert_eq!(fixed_of::<f64>(1.15e-3, 0.0), [false; 10]);
        // A rate of the wrong sign moves the limb twice as far, and not at all to the same place.
        assert_eq!(fixed_of::<f64>(0.02, -1.0), [false; 10]);
    }

    #[test]
    fn a_slow_turn_shows_over_several_pictures() {
        let (mut sequence, config) = (Sequence::<f64>::default(), Config::default());
        // 30 pictures a second: a picture turns by 0.6 standard deviations of the two answers.
        let step = Step { after_s: Some(1.0 / 30.0), ..step([0.026, 0.0, 0.0]) };
        let fixed: Vec<bool> =
            (0..12).map(|_| sequence.see(&step, Some((direction([0.0, 0.5, 0.8]), NOISE)), &config)).collect();
        assert_eq!(fixed.iter().position(|is_fixed| *is_fixed), Some(5), "{fixed:?}");
        assert!(fixed[5..].iter().all(|is_fixed| *is_fixed), "{fixed:?}");
    }

    #[test]
    fn an_attitude_gives_the_turn_and_its_error_counts() {
        let turned = |angle: f64, sigma_rad: f64| {
            let q = [libm::cos(angle / 2.0), libm::sin(angle / 2.0), 0.0, 0.0];
            let attitude = Rotation::assume_from_quaternion(q).map(|rotation| (rotation, sigma_rad));
            Step { after_s: Some(1.0), rate_rad_s: None, attitude }
        };
        let (config, axis) = (Config::default(), direction([0.0, 0.5, 0.8]));
        for (sigma_rad, is_fixed) in [(1e-3, true), (0.05, false)] {
            let mut sequence = Sequence::default();
            assert!(!sequence.see(&turned(0.0, sigma_rad), Some((axis, NOISE)), &config));
            assert_eq!(sequence.see(&turned(0.1, sigma_rad), Some((axis, NOISE)), &config), is_fixed, "{sigma_rad}");
        }
        // A limb turns with the attitude: the camera turns to positive x, so the limb turns back.
        let mut sequence = Sequence::default();
        assert!(!sequence.see(&turned(0.0, 1e-3), Some((axis, NOISE)), &config));
        let limb = turn_by(&axis, &V3::new(-0.1, 0.0, 0.0));
        assert!(!sequence.see(&turned(0.1, 1e-3), Some((limb, NOISE)), &config));
        let reference = sequence.reference.unwrap();
        assert!(reference.axis == limb && reference.age_s == 0.0);
    }

    #[test]
    fn false_alarms_are_as_rare_as_the_sigma_says() {
        // The worst turn is that of as many standard deviations as the limit has.
        let (config, pairs) = (Config::default(), 40_000);
        let mut state = 1u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let mut normal = || {
            let (radius, (sin, _)) =
                (libm::sqrt(-2.0 * libm::log(1.0 - uniform())), libm::sincos(core::f64::consts::TAU * uniform()));
            radius * sin
        };
        let mut alarms = 0;
        for _ in 0..pairs {
            let mut sequence = Sequence::default();
            // The orbit's share would only make alarms rarer, so that the pictures are close in time.
            let rate = 3.0 * NOISE * core::f64::consts::SQRT_2 / 1e-3;
            let step = Step { after_s: Some(1e-3), ..step([rate, 0.0, 0.0]) };
            for i in 0..2 {
                let limb = turn_by(&direction([0.0, 0.0, 1.0]), &V3::new(-rate * 1e-3 * f64::from(i), 0.0, 0.0));
                let [x, y, z] = limb.xyz();
                let measured = direction([x + NOISE * normal(), y + NOISE * normal(), z]);
                alarms += i32::from(sequence.see(&step, Some((measured, NOISE)), &config));
            }
        }
        // Phi(-3) of 40 000 is 54.
        assert!((30..=80).contains(&alarms), "{alarms} of {pairs}");
    }

    #[test]
    fn without_a_turn_or_a_time_nothing_is_said() {
        let (config, axis) = (Config::default(), direction([0.0, 0.5, 0.8]));
        let unknown = [Step { after_s: None, ..step([0.3, 0.0, 0.0]) }, Step { rate_rad_s: None, ..step([0.0; 3]) }];
        for unknown in unknown {
            let mut sequence = Sequence::default();
            assert!(!sequence.see(&step([0.3, 0.0, 0.0]), Some((axis, NOISE)), &config));
            assert!(!sequence.see(&unknown, Some((axis, NOISE)), &config));
            // The next picture begins anew.
            assert!(!sequence.see(&unknown, Some((axis, NOISE)), &config));
        }
        // A picture without an answer in between changes nothing.
        let mut sequence = Sequence::default();
        assert!(!sequence.see(&step([0.02, 0.0, 0.0]), Some((axis, NOISE)), &config));
        assert!(!sequence.see(&step([0.02, 0.0, 0.0]), None, &config));
        assert!(sequence.see(&step([0.02, 0.0, 0.0]), Some((axis, NOISE)), &config));
    }
}
