//! What one head saw.

use crate::base::linalg::{M3, V3, basis, invert_spd3};
use crate::base::real::Real;
use crate::geometry::frames::{Cam, Rotation, UnitVec3, Vehicle};
use crate::model::report::Free;

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
}

impl<T: Real> Head<T> {
    /// Turns the cone of a head into the axes of the vehicle.
    ///
    /// `mount_rad2` is the upper triangle (xx, xy, xz, yy, yz, zz) of the covariance of the mount: a small rotation of
    /// the camera about the axes of the vehicle, rad². `own_sigma_cos` is the 1-sigma of the part of the cosine that
    /// this head does not share with the others, such as the weather of its part of the limb. `None` if the cone came
    /// by telemetry, without its correlation, or if its covariance is not positive definite.
    pub fn new(
        free: &Free<T>,
        vehicle_from_camera: &Rotation<Cam, Vehicle, T>,
        mount_rad2: &[T; 6],
        own_sigma_cos: T,
    ) -> Option<Self> {
        let turn = |v: V3<T>| vehicle_from_camera.to_matrix() * v;
        let (c1, c2) = basis(free.axis.v());
        let with_cos = V3::from(free.axis_with_cos?);
        let form = |a: &V3<T>, p: &M3<T>, b: &V3<T>| a.dot(&(p * b));
        let axis = symmetric(&free.covariance.upper_rad2);
        let e = *vehicle_from_camera.apply(&free.axis).v();
        let b = [turn(c1), turn(c2)];
        // A rotation θ of the mount moves the axis by θ × e, so that the components are (e × b)·θ.
        let mount = symmetric(mount_rad2);
        let lever = b.map(|b| e.cross(&b));
        let p11 = form(&c1, &axis, &c1) + form(&lever[0], &mount, &lever[0]);
        let p12 = form(&c1, &axis, &c2) + form(&lever[0], &mount, &lever[1]);
        let p22 = form(&c2, &axis, &c2) + form(&lever[1], &mount, &lever[1]);
        let (p13, p23) = (c1.dot(&with_cos), c2.dot(&with_cos));
        let p33 = free.var_cos + own_sigma_cos * own_sigma_cos;
        Some(Self {
            e,
            c: free.cos,
            b,
            covariance: M3::new(p11, p12, p13, p12, p22, p23, p13, p23, p33),
            information: invert_spd3(&[p11, p12, p13, p22, p23, p33])?,
        })
    }

    /// Returns the axis of the head's cone in the axes of the vehicle.
    pub fn axis(&self) -> UnitVec3<Vehicle, T> {
        UnitVec3::assume_unit(self.e)
    }
}

pub(super) fn symmetric<T: Real>([xx, xy, xz, yy, yz, zz]: &[T; 6]) -> M3<T> {
    M3::new(*xx, *xy, *xz, *xy, *yy, *yz, *xz, *yz, *zz)
}
