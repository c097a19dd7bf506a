//! Each head against the solution of the others.

use super::head::{Head, MOST_HEADS};
use super::joint::{Cone, Joint, NoJoint, axis_sigma, chosen, invert, without_cosine};
use crate::base::error::{ConfigError, Limit};
use crate::base::linalg::M3;
use crate::base::real::Real;
use crate::geometry::frames::{Cov3, UnitVec3};

/// Smallest and largest probability of the configuration.
const LEAST: f64 = 1e-12;
const MOST: f64 = 0.5;

/// Probabilities of the check.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Config {
    /// Probability of a false alarm: good heads that the check takes as contradicting, for each epoch.
    pub false_alarm: f64,
    /// Probability that the error exceeds the protection level, if one head is wrong.
    pub misleading: f64,
}

impl Config {
    /// The default probabilities.
    pub const DEFAULT: Self = Self { false_alarm: 1e-3, misleading: 1e-4 };
}

impl Default for Config {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// One to four heads that are one sensor.
#[derive(Debug, Clone, Copy)]
pub struct Rig<T> {
    /// Limit of χ² with three degrees of freedom for 2, 3 and 4 heads, in this order.
    limits: [T; MOST_HEADS - 1],
    /// The same with two degrees of freedom, for a head that sees another limb than all others.
    limits_of_axis: [T; MOST_HEADS - 1],
    /// Sigmas of a Gaussian direction (two dimensions, its worse one) that are exceeded with the probability.
    sigmas: T,
}

impl<T: Real> Rig<T> {
    /// Checks the probabilities: both lie between 1e-12 and 0.5.
    pub fn new(config: &Config) -> Result<Self, ConfigError> {
        for (name, value) in [("rig.false_alarm", config.false_alarm), ("rig.misleading", config.misleading)] {
            // A smaller probability needs more of the distribution's tail than anybody has measured.
            if !(LEAST..=MOST).contains(&value) {
                return Err(ConfigError { field: name, value, limit: Limit::Between(LEAST, MOST), body: None });
            }
        }
        let limits = |survival: fn(f64) -> f64| {
            [2.0, 3.0, 4.0].map(|heads| T::from_f64(quantile(config.false_alarm / heads, survival)))
        };
        Ok(Self {
            limits: limits(survival_of_three),
            limits_of_axis: limits(survival_of_two),
            sigmas: T::from_f64(quantile(config.misleading, survival_of_two).sqrt()),
        })
    }

    /// Joins the cones of the heads, at most four, `None` for a head without an answer.
    ///
    /// `tilt_rad` is the 1-sigma of a tilt of the limb that all heads share: the axis then has this error, and nothing
    /// shows it. With one cone the answer is that of the head.
    pub fn join(&self, heads: &[Option<Head<T>>], tilt_rad: T) -> Result<Joint<T>, NoJoint> {
        let heads = &heads[..heads.len().min(MOST_HEADS)];
        let all = heads.iter().enumerate().fold(0, |set, (k, head)| set | u8::from(head.is_some()) << k);
        if all == 0 {
            return Err(NoJoint::NoHead);
        }
        let (set, cone) = self.consistent_set(heads, all)?;
        let separated = self.separate(heads, set, &cone);
        let var_tilt = tilt_rad * tilt_rad;
        let p = &cone.covariance();
        let excluded = all & !set;
        // A tilt of the limb is common, as a whole.
        let of_axis =
            |p: &M3<T>| Cov3::from_tangent(&cone.b[0], &cone.b[1], [p.m11 + var_tilt, p.m12, p.m22 + var_tilt]);
        Ok(Joint {
            axis: UnitVec3::assume_unit(cone.e),
            covariance: of_axis(p),
            common: cone.common(heads, set).as_ref().map(of_axis),
            cos: (cone.cos(), p.m33.max(T::ZERO).sqrt()),
            heads_used: set,
            heads_excluded: excluded,
            separation_rad: separated.as_ref().map(|s| s.worst),
            protection_rad: separated.map(|s| s.protection(self.sigmas, axis_sigma(p), var_tilt)),
        })
    }

    /// Returns the heads that agree, with their cone: all, or all but the only one whose exclusion makes them agree.
    fn consistent_set(&self, heads: &[Option<Head<T>>], all: u8) -> Result<(u8, Cone<T>), NoJoint> {
        let cone = Cone::fit(heads, all).ok_or(NoJoint::Undetermined)?;
        if self.separate(heads, all, &cone).is_none_or(|s| s.agrees) {
            return Ok((all, cone));
        }
        let mut found = None;
        if all.count_ones() > 2 {
            for (k, _) in chosen(heads, all) {
                let set = all & !(1 << k);
                let Some(cone) = Cone::fit(heads, set) else { continue };
                if self.separate(heads, set, &cone).is_some_and(|s| s.agrees) {
                    if found.is_some() {
                        return Err(NoJoint::Inconsistent);
                    }
                    found = Some((set, cone));
                }
            }
        }
        found.ok_or(NoJoint::Inconsistent)
    }

    /// Compares each head of a set with the solution of the others. `None` with one head, or if the others of a head do
    /// not determine a cone.
    fn separate(&self, heads: &[Option<Head<T>>], set: u8, cone: &Cone<T>) -> Option<Separation<T>> {
        let place = (set.count_ones() as usize).checked_sub(2)?;
        let (limit, limit_of_axis) = (*self.limits.get(place)?, *self.limits_of_axis.get(place)?);
        let mut out = Separation { agrees: true, worst: (T::ZERO, T::ZERO), bound: [(T::ZERO, T::ZERO); MOST_HEADS] };
        let mut largest = -T::one();
        for (k, head) in chosen(heads, set) {
            let is_alone = chosen(heads, set).all(|(other, h)| other == k || h.group != head.group);
            let against = against_others(head, cone, is_alone)?;
            let limit = if is_alone { limit_of_axis } else { limit };
            let allowed = limit.sqrt() * axis_sigma(&(against.others - cone.covariance()));
            // A head alone in its group has another limit, so its distance counts in parts of it.
            let q = against.q / limit;
            if q > largest {
                largest = q;
                out.worst = (against.moved_rad, allowed);
            }
            out.agrees &= against.q <= limit;
            if let Some(bound) = out.bound.get_mut(k) {
                *bound = (allowed, axis_sigma(&against.others));
            }
        }
        Some(out)
    }
}

/// A head against the solution of the others.
struct Against<T> {
    /// χ² of the head.
    q: T,
    /// The angle by which the axis moves without the head, in radians.
    moved_rad: T,
    /// Covariance of the others' solution.
    others: M3<T>,
}

/// Compares a head with the solution of the others. The others of a head that is alone in its limb group know nothing
/// of its half-angle, so only the directions are compared. `None` if the others do not determine a cone.
fn against_others<T: Real>(head: &Head<T>, cone: &Cone<T>, is_alone: bool) -> Option<Against<T>> {
    let (j, mut r) = cone.seen_by(head);
    let weighted = j.transpose() * head.information;
    let (mut normal, _) = cone.group(head.group)?;
    let (mut own, mut right, mut covariance) = (weighted * j, weighted * r, head.covariance);
    if is_alone {
        (own, right) = without_cosine(&own, &right);
        (normal, _) = without_cosine(&normal, &right);
        // The cosine stays as an unknown that nothing moves.
        normal.m33 = T::one();
        r.z = T::ZERO;
        (covariance.m13, covariance.m31, covariance.m23, covariance.m32) = (T::ZERO, T::ZERO, T::ZERO, T::ZERO);
    }
    let others = invert(&(normal - own))?;
    // The solution of the others relative to that of all: the gradient of the sum is zero at the cone of all.
    let moved = -(others * right);
    let innovation = r - j * moved;
    let spread = covariance + j * others * j.transpose();
    let q = innovation.dot(&(invert(&spread)? * innovation));
    Some(Against { q, moved_rad: (moved.x * moved.x + moved.y * moved.y).sqrt(), others })
}

/// What the comparison of a set's heads says.
struct Separation<T> {
    /// Whether every head lies within the limit.
    agrees: bool,
    /// Angle and allowed angle of the head that agrees least, in radians.
    worst: (T, T),
    /// For each head: the angle by which its fault can move the axis unnoticed, and sigma without the head, in radians.
    bound: [(T, T); MOST_HEADS],
}

impl<T: Real> Separation<T> {
    /// Returns the maximum over the hypotheses "no head is wrong" and "head k is wrong".
    fn protection(&self, sigmas: T, sigma: T, var_tilt: T) -> T {
        let with_tilt = |sigma: T| sigmas * (sigma * sigma + var_tilt).sqrt();
        let good = with_tilt(sigma);
        self.bound.iter().fold(good, |most, &(allowed, sigma)| most.max(allowed + with_tilt(sigma)))
    }
}

/// Probability that χ² with two degrees of freedom exceeds x.
fn survival_of_two(x: f64) -> f64 {
    libm::exp(-0.5 * x)
}

/// Probability that χ² with three degrees of freedom exceeds x.
fn survival_of_three(x: f64) -> f64 {
    libm::erfc(libm::sqrt(0.5 * x)) + libm::sqrt(x * core::f64::consts::FRAC_2_PI) * libm::exp(-0.5 * x)
}

/// Returns the value that is exceeded with a probability.
fn quantile(probability: f64, survival: fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, 1500.0);
    // Each step halves the interval; after 60 of them it is as narrow as the rounding.
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if survival(middle) > probability {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}
