//! One cone through the cones of all heads.

use core::fmt;

use super::head::Head;
use crate::base::linalg::{M3, V3, basis, invert_spd3, unit};
use crate::base::real::Real;
use crate::geometry::frames::{Cov3, UnitVec3, Vehicle};

/// Number of Gauss-Newton steps. The cones of heads on one body lie within degrees of each other, and the error of a
/// step is of the second order in this angle.
const STEPS: usize = 3;

/// The answer of several heads.
#[derive(Debug, Clone, Copy)]
pub struct Joint<T> {
    /// Direction to the body in the axes of the vehicle.
    pub axis: UnitVec3<Vehicle, T>,
    /// Covariance of `axis`, rad², rank 2.
    pub covariance: Cov3<Vehicle, T>,
    /// The part of `covariance` whose error is the same in the next epoch while the geometry stays, rad², rank 2.
    /// `None` if it is not known of a head.
    pub common: Option<Cov3<Vehicle, T>>,
    /// Cosine of the common half-angle, and its 1-sigma.
    pub cos: (T, T),
    /// The heads whose cones are in the answer: bit k for head k.
    pub heads_used: u8,
    /// The heads that the check excluded.
    pub heads_excluded: u8,
    /// The angle by which the axis moves without the head that agrees least, and the largest angle that its covariance
    /// allows, in radians. `None` with one head.
    pub separation_rad: Option<(T, T)>,
    /// The angle that the error of `axis` exceeds with the probability of the configuration, if at most one head is
    /// wrong. `None` with one head, which nothing checks.
    pub protection_rad: Option<T>,
}

/// Why several heads have no answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoJoint {
    /// No head has a cone.
    NoHead,
    /// The cones do not determine axis and half-angle together.
    Undetermined,
    /// The heads contradict each other, and the check cannot say which of them is wrong.
    Inconsistent,
}

impl fmt::Display for NoJoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoHead => "no head has found the limb",
            Self::Undetermined => "the parts of the limb that the heads see do not determine the direction",
            Self::Inconsistent => "the heads contradict each other, and no single head explains it",
        })
    }
}

impl core::error::Error for NoJoint {}

/// The common cone of some heads, with its normal equations.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cone<T> {
    pub(super) e: V3<T>,
    pub(super) c: T,
    pub(super) b: [V3<T>; 2],
    /// A of the module's equations, and its inverse.
    pub(super) normal: M3<T>,
    pub(super) covariance: M3<T>,
}

impl<T: Real> Cone<T> {
    /// Fits the common cone of the heads in `used`. `None` if they do not determine it.
    pub(super) fn fit(heads: &[Option<Head<T>>], used: u8) -> Option<Self> {
        let first = chosen(heads, used).next()?.1;
        let (mut e, mut c) = (first.e, first.c);
        for _ in 1..STEPS {
            let (b1, b2) = basis(&e);
            let (normal, right) = equations(heads, used, &e, c, &[b1, b2]);
            let step = invert(&normal)? * right;
            e = unit(&(e + b1 * step.x + b2 * step.y))?;
            c += step.z;
        }
        let (b1, b2) = basis(&e);
        let (normal, _) = equations(heads, used, &e, c, &[b1, b2]);
        Some(Self { e, c, b: [b1, b2], normal, covariance: invert(&normal)? })
    }

    /// Returns the part of the covariance of the heads in `used` that the next epoch shares; `None` if it is not known
    /// of a head.
    ///
    /// An error x_k of head k moves the cone by A⁻¹ J_kᵀ C_k⁻¹ x_k. While the geometry stays, this gain is the same in
    /// the next epoch.
    pub(super) fn common(&self, heads: &[Option<Head<T>>], used: u8) -> Option<M3<T>> {
        let mut sum = M3::zeros();
        for (_, head) in chosen(heads, used) {
            let (j, _) = self.seen_by(head);
            let gain = self.covariance * j.transpose() * head.information;
            sum += gain * head.common? * gain.transpose();
        }
        Some(sum)
    }

    /// Returns the derivative J of what the head sees by (δ₁, δ₂, δc), and the residual r.
    pub(super) fn seen_by(&self, head: &Head<T>) -> (M3<T>, V3<T>) {
        seen(head, &self.e, self.c, &self.b)
    }
}

/// Returns the heads of a set with their numbers.
pub(super) fn chosen<T>(heads: &[Option<Head<T>>], used: u8) -> impl Iterator<Item = (usize, &Head<T>)> {
    let is_used = move |k: usize| used >> k & 1 == 1;
    heads.iter().enumerate().filter_map(move |(k, head)| head.as_ref().filter(|_| is_used(k)).map(|head| (k, head)))
}

fn seen<T: Real>(head: &Head<T>, e: &V3<T>, c: T, b: &[V3<T>; 2]) -> (M3<T>, V3<T>) {
    let [h1, h2] = &head.b;
    let (zero, one) = (T::ZERO, T::one());
    let j = M3::new(h1.dot(&b[0]), h1.dot(&b[1]), zero, h2.dot(&b[0]), h2.dot(&b[1]), zero, zero, zero, one);
    (j, V3::new(-h1.dot(e), -h2.dot(e), head.c - c))
}

fn equations<T: Real>(heads: &[Option<Head<T>>], used: u8, e: &V3<T>, c: T, b: &[V3<T>; 2]) -> (M3<T>, V3<T>) {
    let (mut normal, mut right) = (M3::zeros(), V3::zeros());
    for (_, head) in chosen(heads, used) {
        let (j, r) = seen(head, e, c, b);
        let weighted = j.transpose() * head.information;
        normal += weighted * j;
        right += weighted * r;
    }
    (normal, right)
}

/// Inverts a symmetric matrix.
pub(super) fn invert<T: Real>(m: &M3<T>) -> Option<M3<T>> {
    invert_spd3(&[m.m11, m.m12, m.m13, m.m22, m.m23, m.m33])
}

/// Returns the largest standard deviation of the axis in the covariance of (δ₁, δ₂, δc).
pub(super) fn axis_sigma<T: Real>(p: &M3<T>) -> T {
    let half = (p.m11 + p.m22) * T::from_f64(0.5);
    let minor = p.m11 * p.m22 - p.m12 * p.m12;
    (half + (half * half - minor).max(T::ZERO).sqrt()).max(T::ZERO).sqrt()
}
