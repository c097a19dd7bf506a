//! One cone through the cones of all heads.

use core::fmt;

use super::head::{Head, MOST_HEADS};
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
    /// Cosine of the common half-angle, and its 1-sigma. With several limb groups it is that of the first used head.
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

/// The common direction of some heads, with the cosine of each group's half-angle and their normal equations.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cone<T> {
    pub(super) e: V3<T>,
    pub(super) b: [V3<T>; 2],
    /// Cosine of the half-angle of each limb group.
    c: [T; MOST_HEADS],
    /// A of the module's equations for the axis and the cosine of each group, and its inverse.
    groups: [Option<(M3<T>, M3<T>)>; MOST_HEADS],
    /// Group of the first head, which stands for the others where only the axis counts.
    first: usize,
}

impl<T: Real> Cone<T> {
    /// Fits the common cone of the heads in `used`. `None` if they do not determine it.
    pub(super) fn fit(heads: &[Option<Head<T>>], used: u8) -> Option<Self> {
        let first = chosen(heads, used).next()?.1;
        let (mut e, mut c) = (first.e, [first.c; MOST_HEADS]);
        for (group, c) in c.iter_mut().enumerate() {
            *c = chosen(heads, used).find(|(_, head)| head.group == group).map_or(*c, |(_, head)| head.c);
        }
        for _ in 1..STEPS {
            let (b1, b2) = basis(&e);
            let equations = Equations::new(heads, used, &e, &c, &[b1, b2]);
            let mut axis = V3::zeros();
            for (group, c) in c.iter_mut().enumerate() {
                let Some((normal, right)) = equations.of(group) else { continue };
                let step = invert(&normal)? * right;
                *c += step.z;
                // All groups give the same step of the axis.
                axis = if group == first.group { step } else { axis };
            }
            e = unit(&(e + b1 * axis.x + b2 * axis.y))?;
        }
        let (b1, b2) = basis(&e);
        let equations = Equations::new(heads, used, &e, &c, &[b1, b2]);
        let mut groups = [None; MOST_HEADS];
        for (group, place) in groups.iter_mut().enumerate() {
            if let Some((normal, _)) = equations.of(group) {
                *place = Some((normal, invert(&normal)?));
            }
        }
        Some(Self { e, b: [b1, b2], c, groups, first: first.group })
    }

    /// Returns the cosine of the first head's group.
    pub(super) fn cos(&self) -> T {
        self.c.get(self.first).copied().unwrap_or(T::ZERO)
    }

    /// Returns the covariance of the axis and of the cosine of the first head's group.
    pub(super) fn covariance(&self) -> M3<T> {
        self.group(self.first).map_or_else(M3::zeros, |(_, covariance)| covariance)
    }

    /// Returns A and its inverse for the axis and a group's cosine.
    pub(super) fn group(&self, group: usize) -> Option<(M3<T>, M3<T>)> {
        *self.groups.get(group)?
    }

    /// Returns the part of the covariance of the heads in `used` that the next epoch shares; `None` if it is not known
    /// of a head.
    ///
    /// An error x_k of head k moves the cone by A⁻¹ J_kᵀ C_k⁻¹ x_k. While the geometry stays, this gain is the same in
    /// the next epoch. Of the sum only the part of the axis has a meaning if there are several groups.
    pub(super) fn common(&self, heads: &[Option<Head<T>>], used: u8) -> Option<M3<T>> {
        let mut sum = M3::zeros();
        for (_, head) in chosen(heads, used) {
            let (j, _) = self.seen_by(head);
            let gain = self.group(head.group)?.1 * j.transpose() * head.information;
            sum += gain * head.common? * gain.transpose();
        }
        Some(sum)
    }

    /// Returns the derivative J of what the head sees by (δ₁, δ₂, δc), and the residual r.
    pub(super) fn seen_by(&self, head: &Head<T>) -> (M3<T>, V3<T>) {
        seen(head, &self.e, &self.c, &self.b)
    }
}

/// The normal equations of each limb group alone: A and the right side for the axis and the group's cosine.
struct Equations<T>([Option<(M3<T>, V3<T>)>; MOST_HEADS]);

impl<T: Real> Equations<T> {
    fn new(heads: &[Option<Head<T>>], used: u8, e: &V3<T>, c: &[T; MOST_HEADS], b: &[V3<T>; 2]) -> Self {
        let mut groups = [None; MOST_HEADS];
        for (_, head) in chosen(heads, used) {
            let (j, r) = seen(head, e, c, b);
            let weighted = j.transpose() * head.information;
            if let Some(place) = groups.get_mut(head.group) {
                let (normal, right) = place.get_or_insert((M3::zeros(), V3::zeros()));
                *normal += weighted * j;
                *right += weighted * r;
            }
        }
        Self(groups)
    }

    /// Returns the equations of the axis and of one group's cosine. The cosines of the other groups are eliminated, so
    /// that these groups say only something of the axis. `None` if no head is of this group.
    fn of(&self, group: usize) -> Option<(M3<T>, V3<T>)> {
        let mut sum = (*self.0.get(group)?)?;
        for (other, equations) in self.0.iter().enumerate() {
            if let Some((normal, right)) = equations.filter(|_| other != group) {
                let (normal, right) = without_cosine(&normal, &right);
                sum = (sum.0 + normal, sum.1 + right);
            }
        }
        Some(sum)
    }
}

/// Eliminates the cosine from normal equations (Schur complement). Its row and its column are then zero.
pub(super) fn without_cosine<T: Real>(normal: &M3<T>, right: &V3<T>) -> (M3<T>, V3<T>) {
    let column = V3::new(normal.m13, normal.m23, normal.m33);
    let (mut normal, mut right) = (*normal, *right);
    if column.z > T::ZERO {
        normal -= column * column.transpose() / column.z;
        right -= column * (right.z / column.z);
    }
    // The differences are zero but for rounding.
    (normal.m13, normal.m23, normal.m31, normal.m32, normal.m33) = (T::ZERO, T::ZERO, T::ZERO, T::ZERO, T::ZERO);
    right.z = T::ZERO;
    (normal, right)
}

/// Returns the heads of a set with their numbers.
pub(super) fn chosen<T>(heads: &[Option<Head<T>>], used: u8) -> impl Iterator<Item = (usize, &Head<T>)> {
    let is_used = move |k: usize| used >> k & 1 == 1;
    heads.iter().enumerate().filter_map(move |(k, head)| head.as_ref().filter(|_| is_used(k)).map(|head| (k, head)))
}

fn seen<T: Real>(head: &Head<T>, e: &V3<T>, c: &[T; MOST_HEADS], b: &[V3<T>; 2]) -> (M3<T>, V3<T>) {
    let [h1, h2] = &head.b;
    let (zero, one) = (T::ZERO, T::one());
    let c = c.get(head.group).copied().unwrap_or(head.c);
    let j = M3::new(h1.dot(&b[0]), h1.dot(&b[1]), zero, h2.dot(&b[0]), h2.dot(&b[1]), zero, zero, zero, one);
    (j, V3::new(-h1.dot(e), -h2.dot(e), head.c - c))
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
