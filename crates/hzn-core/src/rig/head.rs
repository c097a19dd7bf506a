//! What one head saw.

use crate::base::linalg::{M3, V3, basis, invert_spd3};
use crate::base::real::Real;
use crate::geometry::frames::{Cam, Cov3, Rotation, UnitVec3, Vehicle};
use crate::model::report::Free;

/// Largest number of heads.
pub const MOST_HEADS: usize = 4;

/// The freely fitted cone of one head in the axes of the vehicle, with its information. It is made from the answer of
/// the head's sensor ([`Free`]) and the head's mount.
#[derive(Debug, Clone, Copy)]
pub struct Head<T> {
    pub(super) e: V3<T>,
    pub(super) c: T,
    /// Tangent basis at `e`.
    pub(super) b: [V3<T>; 2],
    /// Covariance of (δ₁, δ₂, δc) and its inverse.
    pub(super) covariance: M3<T>,
    pub(super) information: M3<T>,
    /// The part of the covariance that the next epoch shares; `None` if it is not known.
    pub(super) common: Option<M3<T>>,
    /// Heads of one group see the same limb.
    pub(super) group: usize,
}

impl<T: Real> Head<T> {
    /// Turns the cone of a head into the axes of the vehicle.
    ///
    /// `mount_rad2` is the upper triangle (xx, xy, xz, yy, yz, zz) of the covariance of the mount: a small rotation of
    /// the camera about the axes of the vehicle, rad². `own_sigma_cos` is the 1-sigma of the part of the cosine that
    /// this head does not share with the others, such as the weather of its part of the limb. `None` if the cone came
    /// by telemetry, without its correlation, or if its covariance is not positive definite.
    ///
    /// The errors of the mount and of that cosine are the same in the next epoch. They belong to the common part of the
    /// head as a whole.
    pub fn new(
        free: &Free<T>,
        vehicle_from_camera: &Rotation<Cam, Vehicle, T>,
        mount_rad2: &[T; 6],
        own_sigma_cos: T,
    ) -> Option<Self> {
        let turn = |v: V3<T>| vehicle_from_camera.to_matrix() * v;
        let (c1, c2) = basis(free.axis.v());
        let with_cos = V3::from(free.axis_with_cos?);
        let e = *vehicle_from_camera.apply(&free.axis).v();
        let b = [turn(c1), turn(c2)];
        // A rotation θ of the mount moves the axis by θ × e, so that the components are (e × b)·θ.
        let mount = symmetric(mount_rad2);
        let lever = b.map(|b| e.cross(&b));
        let added = on_basis(&lever, &mount, &V3::zeros(), own_sigma_cos * own_sigma_cos);
        let seen = |axis: &Cov3<Cam, T>, with_cos: V3<T>, var_cos: T| {
            on_basis(&[c1, c2], &symmetric(&axis.upper_rad2), &with_cos, var_cos) + added
        };
        let covariance = seen(&free.covariance, with_cos, free.var_cos);
        Some(Self {
            e,
            c: free.cos,
            b,
            covariance,
            information: invert_spd3(&upper(&covariance))?,
            common: free.common.map(|p| seen(&p.covariance, p.axis_with_cos.into(), p.var_cos)),
            group: 0,
        })
    }

    /// Puts the head into a limb group, of the numbers 0 to 3; larger ones count as 3. New heads are in group 0.
    ///
    /// The heads of a group see one limb, so their half-angles are equal. An infrared and a visible head see limbs of
    /// different heights: in groups of their own they share only the direction.
    pub fn in_limb_group(self, group: u8) -> Self {
        Self { group: usize::from(group).min(MOST_HEADS - 1), ..self }
    }

    /// Returns the axis of the head's cone in the axes of the vehicle.
    pub fn axis(&self) -> UnitVec3<Vehicle, T> {
        UnitVec3::assume_unit(self.e)
    }
}

/// Returns the covariance of two components of a vector and of a scalar, from the covariance of the vector, its
/// covariance with the scalar, and the variance of the scalar.
fn on_basis<T: Real>([a, b]: &[V3<T>; 2], p: &M3<T>, with_scalar: &V3<T>, var_scalar: T) -> M3<T> {
    let (pa, pb) = (p * a, p * b);
    let (p11, p12, p22) = (a.dot(&pa), a.dot(&pb), b.dot(&pb));
    let (p13, p23) = (a.dot(with_scalar), b.dot(with_scalar));
    M3::new(p11, p12, p13, p12, p22, p23, p13, p23, var_scalar)
}

pub(super) fn symmetric<T: Real>([xx, xy, xz, yy, yz, zz]: &[T; 6]) -> M3<T> {
    M3::new(*xx, *xy, *xz, *xy, *yy, *yz, *xz, *yz, *zz)
}

/// Returns the upper triangle of a symmetric matrix.
pub(super) fn upper<T: Real>(m: &M3<T>) -> [T; 6] {
    [m.m11, m.m12, m.m13, m.m22, m.m23, m.m33]
}
