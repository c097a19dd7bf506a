//! Coordinate frames as types. A direction, a covariance and a rotation carry the frame in which they are written, so
//! that a wrong product does not compile.
//!
//! ```text
//!   Cam            Fixed                        Vehicle
//!   x right        rotates with the body:       the vehicle's own,
//!   y down         for the Earth it is ECEF,    tied to Cam by [mount]
//!   z forward      z to the north pole
//! ```
//!
//! All frames are right-handed. The types do not protect against a wrong *time* (an attitude of another instant)
//! or against rays of another camera.

use core::marker::PhantomData;

use crate::base::linalg::M3;
use crate::base::linalg::V3;
use crate::base::packed::{Packed, Packer, Unpacker};
use crate::base::real::Real;

/// Camera frame: x right, y down, z along the optical axis, out of the camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
// The frames are types without values, so that they cost nothing at run time.
pub enum Cam {}
/// The frame that is fixed in the body: its origin is the body's centre, z points to the north pole, and x to the prime
/// meridian on the equator. For the Earth it is ECEF with the ellipsoid of WGS-84.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fixed {}
/// The frame of the vehicle; the mounting rotation ties it to the camera frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Vehicle {}
/// A frame that does not turn against the stars: the ICRF, with z to the pole of J2000 and x to its equinox.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Inertial {}

/// A direction: three numbers of unit length in frame `F`.
///
/// ```
/// use hzn_core::frames::{Cam, UnitVec3};
///
/// let forward = UnitVec3::<Cam, f64>::try_new([0.0, 0.0, 2.0]).expect("not of length zero");
/// let down = UnitVec3::<Cam, f64>::try_new([0.0, 1.0, 0.0]).expect("not of length zero");
/// assert_eq!(forward.xyz(), [0.0, 0.0, 1.0]);
/// assert_eq!(forward.angle_rad(&down).to_degrees(), 90.0);
/// ```
#[derive(Debug)]
pub struct UnitVec3<F, T> {
    v: V3<T>,
    frame: PhantomData<F>,
}

// The traits are written by hand, because a derive would demand them of the frame `F` in every generic function.
impl<F, T: Clone> Clone for UnitVec3<F, T> {
    fn clone(&self) -> Self {
        Self { v: self.v.clone(), frame: PhantomData }
    }
}
impl<F, T: Copy> Copy for UnitVec3<F, T> {}
impl<F, T: PartialEq> PartialEq for UnitVec3<F, T> {
    fn eq(&self, other: &Self) -> bool {
        self.v == other.v
    }
}

impl<F, T: Real> UnitVec3<F, T> {
    /// Normalises `xyz`; `None` when it is too short or not finite.
    pub fn try_new(xyz: [T; 3]) -> Option<Self> {
        let v = V3::from(xyz);
        let n2 = v.dot(&v);
        (n2 > T::from_f64(1e-30) && n2.is_finite()).then(|| Self::assume_unit(v * (T::one() / n2.sqrt())))
    }
    /// Takes components of unit length as they are, for example those of a packet. `None` if the length differs from
    /// one by more than the rounding of single precision.
    pub fn from_unit(xyz: [T; 3]) -> Option<Self> {
        let v = V3::from(xyz);
        ((v.dot(&v) - T::one()).abs() < T::from_f64(1e-6)).then(|| Self::assume_unit(v))
    }
    /// Wraps `v` without a check: the caller guarantees that it has unit length.
    pub(crate) fn assume_unit(v: V3<T>) -> Self {
        Self { v, frame: PhantomData }
    }
    pub(crate) fn v(&self) -> &V3<T> {
        &self.v
    }
    /// Returns the three components.
    pub fn xyz(&self) -> [T; 3] {
        [self.v.x, self.v.y, self.v.z]
    }
    /// Converts the direction to double precision. The components keep their values, so the length of a direction in
    /// single precision differs from one by up to 1e-7.
    pub fn to_f64(&self) -> UnitVec3<F, f64> {
        UnitVec3::assume_unit(self.v.map(Real::to_f64))
    }
    /// Returns the cosine of the angle between two directions of the same frame.
    pub fn dot(&self, other: &Self) -> T {
        self.v.dot(&other.v)
    }
    /// Returns the angle between two directions of the same frame in radians; it is accurate for small angles too.
    pub fn angle_rad(&self, other: &Self) -> T {
        let c = self.v.cross(&other.v);
        // The arc cosine would lose half of the digits of a small angle.
        c.dot(&c).sqrt().atan2(self.v.dot(&other.v))
    }
}

impl<T: Real> UnitVec3<Cam, T> {
    /// Returns the unit vector (right, down) in the picture from the principal point towards the body's centre. This is
    /// HORACE's two-dimensional direction (Barf 2014, (2.37)). `None` straight ahead and straight behind.
    pub fn to_picture_direction(&self) -> Option<[T; 2]> {
        let flat = (self.v.x * self.v.x + self.v.y * self.v.y).sqrt();
        (flat > T::from_f64(1e-12)).then(|| [self.v.x / flat, self.v.y / flat])
    }
    /// Returns the angles in radians by which the camera must turn to look in this direction (Barf 2014, 2.2.4). The
    /// first turn is about the camera's y axis (positive: to the right, −π to π), the second about the turned x axis
    /// (positive: up, −π/2 to π/2). One direction does not determine the rotation about itself.
    pub fn euler_yx_rad(&self) -> [T; 2] {
        let level = (self.v.x * self.v.x + self.v.z * self.v.z).sqrt();
        [self.v.x.atan2(self.v.z), (-self.v.y).atan2(level)]
    }
}

/// Covariance of a direction in frame `F`, rad²: symmetric 3×3 of rank 2; its null space is the direction.
///
/// ```
/// use hzn_core::frames::{Cam, Cov3, UnitVec3};
///
/// // 2 mrad about the y axis and 1 mrad about the x axis, of a direction along z.
/// let covariance = Cov3::<Cam, f64>::from_upper([4e-6, 0.0, 0.0, 1e-6, 0.0, 0.0]);
/// let x = UnitVec3::try_new([1.0, 0.0, 0.0]).expect("not of length zero");
/// assert_eq!(covariance.variance_along(&x), 4e-6);
/// assert!((covariance.sigma_max_rad() - 2e-3).abs() < 1e-12);
/// ```
#[derive(Debug)]
pub struct Cov3<F, T> {
    /// The upper triangle: xx, xy, xz, yy, yz, zz, in rad².
    pub upper_rad2: [T; 6],
    frame: PhantomData<F>,
}
impl<F, T: Clone> Clone for Cov3<F, T> {
    fn clone(&self) -> Self {
        Self { upper_rad2: self.upper_rad2.clone(), frame: PhantomData }
    }
}
impl<F, T: Copy> Copy for Cov3<F, T> {}
impl<F, T: PartialEq> PartialEq for Cov3<F, T> {
    fn eq(&self, other: &Self) -> bool {
        self.upper_rad2 == other.upper_rad2
    }
}

impl<F, T: Real> Cov3<F, T> {
    /// Makes a covariance from the upper triangle xx, xy, xz, yy, yz, zz in rad².
    pub fn from_upper(upper_rad2: [T; 6]) -> Self {
        Self { upper_rad2, frame: PhantomData }
    }
    /// Makes a covariance from a 2×2 covariance (xx, xy, yy) on the tangent plane spanned by `b1`, `b2`.
    pub(crate) fn from_tangent(b1: &V3<T>, b2: &V3<T>, [p11, p12, p22]: [T; 3]) -> Self {
        let at = |i: usize, j: usize| b1[i] * b1[j] * p11 + (b1[i] * b2[j] + b2[i] * b1[j]) * p12 + b2[i] * b2[j] * p22;
        Self::from_upper([at(0, 0), at(0, 1), at(0, 2), at(1, 1), at(1, 2), at(2, 2)])
    }
    /// Returns the rows of the full matrix in rad².
    pub fn rows(&self) -> [[T; 3]; 3] {
        let [xx, xy, xz, yy, yz, zz] = self.upper_rad2;
        [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
    }
    /// Returns the variance along the direction `d`, rad².
    pub fn variance_along(&self, d: &UnitVec3<F, T>) -> T {
        let rows = self.rows();
        let d = d.xyz();
        let mut sum = T::zero();
        for i in 0..3 {
            for j in 0..3 {
                sum += d[i] * rows[i][j] * d[j];
            }
        }
        sum
    }
    /// Returns the larger of the two standard deviations in radians.
    ///
    /// The two eigenvalues of a rank-2 matrix follow from the trace and the sum of the principal minors.
    pub fn sigma_max_rad(&self) -> T {
        let [xx, xy, xz, yy, yz, zz] = self.upper_rad2;
        let half = (xx + yy + zz) * T::from_f64(0.5);
        let minors = (xx * yy - xy * xy) + (xx * zz - xz * xz) + (yy * zz - yz * yz);
        // Rounding can make the radicand slightly negative when both deviations are equal.
        (half + (half * half - minors).max(T::zero()).sqrt()).max(T::zero()).sqrt()
    }
}

/// A rotation that converts coordinates from frame `A` to frame `B`.
///
/// ```
/// use hzn_core::frames::{Cam, Rotation, UnitVec3, Vehicle};
///
/// // The camera looks along the vehicle's x axis: camera z is x, camera x is y, camera y is z.
/// let mount = Rotation::<Cam, Vehicle, f64>::assume_from_quaternion([0.5, 0.5, 0.5, 0.5]).expect("a rotation");
/// let boresight = UnitVec3::<Cam, f64>::try_new([0.0, 0.0, 1.0]).expect("not of length zero");
/// let [x, y, z] = mount.apply(&boresight).xyz();
/// assert!((x - 1.0).abs() < 1e-15 && y.abs() < 1e-15 && z.abs() < 1e-15);
/// let back = mount.inverse().apply(&mount.apply(&boresight));
/// assert!(back.angle_rad(&boresight) < 1e-12);
/// ```
#[derive(Debug)]
pub struct Rotation<A, B, T> {
    rows: [V3<T>; 3],
    frames: PhantomData<(A, B)>,
}
impl<A, B, T: PartialEq> PartialEq for Rotation<A, B, T> {
    fn eq(&self, other: &Self) -> bool {
        self.rows == other.rows
    }
}
impl<A, B, T: Clone> Clone for Rotation<A, B, T> {
    fn clone(&self) -> Self {
        Self { rows: self.rows.clone(), frames: PhantomData }
    }
}
impl<A, B, T: Copy> Copy for Rotation<A, B, T> {}

impl<A, B, T: Real> Packed for Rotation<A, B, T> {
    fn pack(&self, to: &mut Packer<'_>) {
        self.rows.iter().flat_map(|row| row.iter()).for_each(|x| x.pack(to));
    }
    fn unpack(from: &mut Unpacker<'_>) -> Self {
        Self { rows: <[[T; 3]; 3]>::unpack(from).map(V3::from), frames: PhantomData }
    }
}

impl<A, B, T: Real> Rotation<A, B, T> {
    /// Makes a rotation from a quaternion, scalar first, that converts coordinates **from A to B**; the caller
    /// guarantees this direction. The quaternion is normalised; `None` when its length is about 0 or not finite.
    pub fn assume_from_quaternion([w, x, y, z]: [T; 4]) -> Option<Self> {
        let n2 = w * w + x * x + y * y + z * z;
        if !(n2 > T::from_f64(1e-12) && n2.is_finite()) {
            return None;
        }
        // Division by the squared length normalises the quaternion without a root.
        let s = T::from_f64(2.0) / n2;
        let one = T::one();
        Some(Self {
            rows: [
                V3::new(one - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)),
                V3::new(s * (x * y + w * z), one - s * (x * x + z * z), s * (y * z - w * x)),
                V3::new(s * (x * z - w * y), s * (y * z + w * x), one - s * (x * x + y * y)),
            ],
            frames: PhantomData,
        })
    }
    /// Converts a direction to the new frame.
    pub fn apply(&self, d: &UnitVec3<A, T>) -> UnitVec3<B, T> {
        let [a, b, c] = &self.rows;
        UnitVec3::assume_unit(V3::new(a.dot(&d.v), b.dot(&d.v), c.dot(&d.v)))
    }
    /// Returns the rotation as a matrix. Its columns are the axes of `A` in the frame `B`.
    pub(crate) fn to_matrix(self) -> M3<T> {
        M3::from_rows(&self.rows.map(|row| row.transpose()))
    }
    /// Returns the inverse rotation.
    pub fn inverse(&self) -> Rotation<B, A, T> {
        let [a, b, c] = &self.rows;
        Rotation { rows: [V3::new(a.x, b.x, c.x), V3::new(a.y, b.y, c.y), V3::new(a.z, b.z, c.z)], frames: PhantomData }
    }
}

/// Mixing frames does not compile:
///
/// ```compile_fail
/// use hzn_core::frames::{Cam, Fixed, UnitVec3};
/// let a = UnitVec3::<Cam, f64>::try_new([0.0, 0.0, 1.0]).unwrap();
/// let b = UnitVec3::<Fixed, f64>::try_new([0.0, 0.0, 1.0]).unwrap();
/// let _ = a.dot(&b);
/// ```
#[allow(dead_code, reason = "carries the compile-fail example above")]
struct MixedFrames;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quaternion_turns_from_a_to_b_and_back() {
        let half = core::f64::consts::FRAC_1_SQRT_2;
        // A turn of +90° about z converts x to y.
        let r = Rotation::<Cam, Vehicle, f64>::assume_from_quaternion([half, 0.0, 0.0, half]).unwrap();
        let x = UnitVec3::try_new([1.0, 0.0, 0.0]).unwrap();
        let y = r.apply(&x);
        assert!((y.xyz()[1] - 1.0).abs() < 1e-15);
        assert!(r.inverse().apply(&y).angle_rad(&x) < 1e-15);
        assert!(Rotation::<Cam, Vehicle, f64>::assume_from_quaternion([0.0; 4]).is_none());
    }

    #[test]
    fn euler_angles_turn_the_camera_to_the_direction() {
        for v in [[0.3, -0.5, 0.8], [-0.9, 0.1, -0.3], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] {
            let d = UnitVec3::<Cam, f64>::try_new(v).unwrap();
            let [y, x] = d.euler_yx_rad();
            // The camera's z axis after a turn about y and then about the new x.
            let ((sy, cy), (sx, cx)) = (libm::sincos(y), libm::sincos(x));
            let z = UnitVec3::<Cam, f64>::try_new([sy * cx, -sx, cy * cx]).unwrap();
            assert!(z.angle_rad(&d) < 1e-15, "{v:?}");
            if let Some([a, b]) = d.to_picture_direction() {
                assert!((a * d.xyz()[1] - b * d.xyz()[0]).abs() < 1e-15 && (a * a + b * b - 1.0).abs() < 1e-15);
            }
        }
        assert!(UnitVec3::<Cam, f64>::try_new([0.0, 0.0, 1.0]).unwrap().to_picture_direction().is_none());
    }

    #[test]
    fn largest_sigma_of_a_tangent_covariance() {
        let c = Cov3::<Cam, f64>::from_tangent(&V3::x(), &V3::y(), [4.0, 0.0, 9.0]);
        assert!((c.sigma_max_rad() - 3.0).abs() < 1e-15);
        let e = UnitVec3::try_new([0.0, 0.0, 1.0]).unwrap();
        assert_eq!(c.variance_along(&e), 0.0);
    }
}
