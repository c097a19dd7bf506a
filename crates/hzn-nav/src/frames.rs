//! Coordinate frames as types: a vector, a rotation and a covariance carry the frame in which they are written, so that
//! a wrong sum or product does not compile.
//!
//! The frames are those of [`hzn_core::frames`], and [`Rotation`] has the order of parameters of the rotation there.
//! The types there hold unit directions, and matrices of any scalar. A filter also has positions, velocities and rates,
//! and integrates its attitude as a quaternion, so it has types of its own. A type has the frame; the name of a value
//! has its unit.
//!
//! ```
//! use hzn_nav::frames::{Cam, Fixed, Rotation, Vector, Vehicle};
//!
//! // The camera looks along the vehicle's x axis: camera z is x, camera x is y, camera y is z.
//! let mount = Rotation::<Cam, Vehicle>::assume_from_quaternion([0.5, 0.5, 0.5, 0.5]).expect("a rotation");
//! let attitude = Rotation::<Vehicle, Fixed>::identity();
//! let fixed_from_camera: Rotation<Cam, Fixed> = attitude * mount;
//! let boresight = fixed_from_camera * Vector::<Cam>::new(0.0, 0.0, 1.0);
//! assert!((boresight - Vector::<Fixed>::new(1.0, 0.0, 0.0)).norm() < 1e-15);
//! ```
//!
//! The usual mistakes do not compile. A vector of the camera is added to one of the Earth:
//!
//! ```compile_fail,E0308
//! use hzn_nav::frames::{Cam, Fixed, Vector};
//! let position_m = Vector::<Fixed>::new(6.6e6, 0.0, 0.0);
//! let lever_m = Vector::<Cam>::new(0.0, 0.0, 1.0);
//! let sum = position_m + lever_m;
//! ```
//!
//! The mount is applied in the wrong direction:
//!
//! ```compile_fail,E0277
//! use hzn_nav::frames::{Cam, Rotation, Vector, Vehicle};
//! let mount = Rotation::<Cam, Vehicle>::identity();
//! let on_vehicle = Vector::<Vehicle>::new(1.0, 0.0, 0.0);
//! let on_camera: Vector<Cam> = mount * on_vehicle;
//! ```
//!
//! Attitude and mount are composed in the wrong order:
//!
//! ```compile_fail,E0277
//! use hzn_nav::frames::{Cam, Fixed, Rotation, Vehicle};
//! let (mount, attitude) = (Rotation::<Cam, Vehicle>::identity(), Rotation::<Vehicle, Fixed>::identity());
//! let fixed_from_camera: Rotation<Cam, Fixed> = mount * attitude;
//! ```
//!
//! A rate of the vehicle is given where one in ECEF belongs:
//!
//! ```compile_fail,E0308
//! use hzn_nav::frames::{Vector, Vehicle};
//! let rate_rad_s = Vector::<Vehicle>::new(0.0, 0.0, 0.1);
//! let relative = rate_rad_s - hzn_nav::gravity::earth_rate();
//! ```
//!
//! A covariance of the attitude about the vehicle's axes is given to the filter, which takes one in ECEF:
//!
//! ```compile_fail,E0308
//! use hzn_nav::frames::{Covariance, Fixed, Rotation, Vehicle};
//! use hzn_nav::filter::Filter;
//! fn begin(filter: &mut Filter<40>, attitude: &Rotation<Vehicle, Fixed>) {
//!     filter.set_attitude(attitude, &Covariance::<Vehicle>::isotropic(1e-6));
//! }
//! ```

use core::fmt::{Debug, Formatter};
use core::marker::PhantomData;
use core::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub};

use hzn_core::frames::UnitVec3;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

pub use hzn_core::frames::{Cam, Fixed, Inertial, Vehicle};

/// Implements what does not depend on the frames. A derive would ask each frame for the same traits.
macro_rules! framed {
    ($name:ident<$($frame:ident),+>, $inner:ty, $numbers:ident) => {
        impl<$($frame),+> $name<$($frame),+> {
            #[inline]
            const fn assume(inner: $inner) -> Self {
                Self { inner, frames: PhantomData }
            }
            /// Returns the numbers without their frame, for algebra that has no type here.
            #[inline]
            pub const fn as_inner(&self) -> &$inner {
                &self.inner
            }
            /// Returns the numbers without their frame.
            #[inline]
            pub fn into_inner(self) -> $inner {
                self.inner
            }
            /// Returns whether all numbers are finite.
            #[inline]
            pub fn is_finite(&self) -> bool {
                $numbers(&self.inner).iter().all(|x| x.is_finite())
            }
        }
        impl<$($frame),+> Clone for $name<$($frame),+> {
            #[inline]
            fn clone(&self) -> Self {
                *self
            }
        }
        impl<$($frame),+> Copy for $name<$($frame),+> {}
        impl<$($frame),+> PartialEq for $name<$($frame),+> {
            #[inline]
            fn eq(&self, other: &Self) -> bool {
                self.inner == other.inner
            }
        }
        impl<$($frame),+> Debug for $name<$($frame),+> {
            fn fmt(&self, f: &mut Formatter<'_>) -> core::fmt::Result {
                self.inner.fmt(f)
            }
        }
        impl<$($frame),+> From<$inner> for $name<$($frame),+> {
            /// The caller guarantees the frame.
            #[inline]
            fn from(inner: $inner) -> Self {
                Self::assume(inner)
            }
        }
    };
}

#[inline]
fn itself<T>(inner: &T) -> &T {
    inner
}
#[inline]
fn coordinates(q: &UnitQuaternion<f64>) -> &nalgebra::Vector4<f64> {
    &q.coords
}

/// A vector in frame `F`: a position, a velocity, a rate, a specific force or a direction.
#[repr(transparent)]
pub struct Vector<F> {
    inner: Vector3<f64>,
    frames: PhantomData<F>,
}
framed!(Vector<F>, Vector3<f64>, itself);

impl<F> Vector<F> {
    /// Makes a vector from its components; the caller guarantees the frame.
    #[inline]
    pub const fn new(x: f64, y: f64, z: f64) -> Self {
        Self::assume(Vector3::new(x, y, z))
    }
    /// Returns the vector of length 0.
    #[inline]
    pub const fn zeros() -> Self {
        Self::new(0.0, 0.0, 0.0)
    }
    /// Returns the three components.
    #[inline]
    pub fn xyz(&self) -> [f64; 3] {
        self.inner.into()
    }
    /// Returns the direction as a type of hzn-core; `None` when the vector is too short or not finite.
    pub fn to_unit(&self) -> Option<UnitVec3<F, f64>> {
        UnitVec3::try_new(self.xyz())
    }
    /// Returns the length.
    #[inline]
    pub fn norm(&self) -> f64 {
        libm::sqrt(self.norm_squared())
    }
    /// Returns the square of the length.
    #[inline]
    pub fn norm_squared(&self) -> f64 {
        self.inner.norm_squared()
    }
    /// Returns the vector with length 1. A vector of length 0 gives NaN.
    #[inline]
    #[must_use]
    pub fn normalize(&self) -> Self {
        Self::assume(self.inner.normalize())
    }
    /// Returns the vector with length 1; `None` if it is not longer than `least`.
    #[inline]
    pub fn try_normalize(&self, least: f64) -> Option<Self> {
        self.inner.try_normalize(least).map(Self::assume)
    }
    /// Returns the scalar product with a vector of the same frame.
    #[inline]
    pub fn dot(&self, other: &Self) -> f64 {
        self.inner.dot(&other.inner)
    }
    /// Returns the vector product with a vector of the same frame.
    #[inline]
    #[must_use]
    pub fn cross(&self, other: &Self) -> Self {
        Self::assume(self.inner.cross(&other.inner))
    }
    /// Returns the products of the components, for example of scale factors of three axes with their rates.
    #[inline]
    #[must_use]
    pub fn component_mul(&self, other: &Self) -> Self {
        Self::assume(self.inner.component_mul(&other.inner))
    }
    /// Returns the angle to a vector of the same frame in radians.
    pub fn angle_rad(&self, other: &Self) -> f64 {
        self.inner.angle(&other.inner)
    }
}

impl<F> Default for Vector<F> {
    #[inline]
    fn default() -> Self {
        Self::zeros()
    }
}
impl<F> From<[f64; 3]> for Vector<F> {
    /// The caller guarantees the frame.
    #[inline]
    fn from(xyz: [f64; 3]) -> Self {
        Self::assume(xyz.into())
    }
}
impl<F> From<UnitVec3<F, f64>> for Vector<F> {
    #[inline]
    fn from(direction: UnitVec3<F, f64>) -> Self {
        direction.xyz().into()
    }
}
impl<F> Add for Vector<F> {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        Self::assume(self.inner + other.inner)
    }
}
impl<F> Sub for Vector<F> {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        Self::assume(self.inner - other.inner)
    }
}
impl<F> Neg for Vector<F> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self::assume(-self.inner)
    }
}
impl<F> Mul<f64> for Vector<F> {
    type Output = Self;
    #[inline]
    fn mul(self, factor: f64) -> Self {
        Self::assume(self.inner * factor)
    }
}
impl<F> Div<f64> for Vector<F> {
    type Output = Self;
    #[inline]
    fn div(self, divisor: f64) -> Self {
        Self::assume(self.inner / divisor)
    }
}
impl<F> AddAssign for Vector<F> {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        self.inner += other.inner;
    }
}
impl<F> MulAssign<f64> for Vector<F> {
    #[inline]
    fn mul_assign(&mut self, factor: f64) {
        self.inner *= factor;
    }
}

/// A rotation that converts coordinates from frame `A` to frame `B`, as a unit quaternion. Products are read from the
/// right, as those of matrices: `Rotation<B, C> * Rotation<A, B>` is a `Rotation<A, C>`.
#[repr(transparent)]
pub struct Rotation<A, B> {
    inner: UnitQuaternion<f64>,
    frames: PhantomData<(A, B)>,
}
framed!(Rotation<A, B>, UnitQuaternion<f64>, coordinates);

impl<A, B> Rotation<A, B> {
    /// Returns the rotation between frames with the same axes.
    #[inline]
    pub fn identity() -> Self {
        Self::assume(UnitQuaternion::identity())
    }
    /// Makes a rotation from a quaternion, scalar first, that converts coordinates **from A to B** (`q_B_from_A_wxyz`);
    /// the caller guarantees this direction. The quaternion is normalised; `None` when its length is about 0 or not
    /// finite.
    pub fn assume_from_quaternion([w, x, y, z]: [f64; 4]) -> Option<Self> {
        let rotation = UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-6).map(Self::assume);
        // Asked after the division, because the length of a quaternion with an infinite number passes the limit above.
        rotation.filter(Self::is_finite)
    }
    /// Returns the quaternion `q_B_from_A_wxyz`, scalar first.
    pub fn wxyz(&self) -> [f64; 4] {
        let q = &self.inner.coords;
        [q.w, q.x, q.y, q.z]
    }
    /// Returns the inverse rotation.
    #[inline]
    #[must_use]
    pub fn inverse(&self) -> Rotation<B, A> {
        Rotation::assume(self.inner.inverse())
    }
    /// Returns the matrix. Its columns are the axes of `A` in the frame `B`.
    #[inline]
    pub fn to_matrix(&self) -> Matrix3<f64> {
        self.inner.to_rotation_matrix().into_inner()
    }
    /// Returns the angle of the rotation that leads to another one, in radians.
    pub fn angle_to(&self, other: &Self) -> f64 {
        self.inner.angle_to(&other.inner)
    }
    /// Returns the rotation at a part of the shortest way to another one.
    #[must_use]
    pub fn slerp(&self, other: &Self, part: f64) -> Self {
        Self::assume(self.inner.slerp(&other.inner, part))
    }
    /// Returns the rotation with a quaternion of length 1: products of many rotations lose it by rounding.
    #[inline]
    #[must_use]
    pub fn renormalized(self) -> Self {
        Self::assume(UnitQuaternion::new_normalize(self.inner.into_inner()))
    }
}

/// Turns within one frame: errors and changes of an attitude.
impl<F> Rotation<F, F> {
    /// Makes a rotation from a rotation vector: axis times angle in radians.
    #[inline]
    pub fn from_scaled_axis(vector_rad: Vector<F>) -> Self {
        Self::assume(UnitQuaternion::from_scaled_axis(vector_rad.inner))
    }
    /// Returns the rotation vector: axis times angle in radians.
    #[inline]
    pub fn scaled_axis(&self) -> Vector<F> {
        Vector::assume(self.inner.scaled_axis())
    }
}

impl<A, B, C> Mul<Rotation<A, B>> for Rotation<B, C> {
    type Output = Rotation<A, C>;
    #[inline]
    fn mul(self, first: Rotation<A, B>) -> Rotation<A, C> {
        Rotation::assume(self.inner * first.inner)
    }
}
impl<A, B> Mul<Vector<A>> for Rotation<A, B> {
    type Output = Vector<B>;
    #[inline]
    fn mul(self, vector: Vector<A>) -> Vector<B> {
        Vector::assume(self.inner * vector.inner)
    }
}

/// A covariance of three components in frame `F`: of a direction or a rotation vector in rad², of a position in m².
///
/// ```
/// use hzn_nav::frames::{Cam, Covariance, Vector};
///
/// // A direction along z that is known to 1 mrad.
/// let covariance = Covariance::across(&Vector::<Cam>::new(0.0, 0.0, 1.0), 1e-6);
/// assert_eq!(covariance.as_inner().diagonal().as_slice(), [1e-6, 1e-6, 0.0]);
/// ```
#[repr(transparent)]
pub struct Covariance<F> {
    inner: Matrix3<f64>,
    frames: PhantomData<F>,
}
framed!(Covariance<F>, Matrix3<f64>, itself);

impl<F> Covariance<F> {
    /// Returns the covariance of three independent components with the same variance.
    pub fn isotropic(variance: f64) -> Self {
        Self::assume(Matrix3::identity() * variance)
    }
    /// Returns the covariance of a direction (unit vector) with the same variance in each axis across it.
    pub fn across(direction: &Vector<F>, variance: f64) -> Self {
        let d = &direction.inner;
        Self::assume((Matrix3::identity() - d * d.transpose()) * variance)
    }
    /// Returns the covariance in another frame.
    #[must_use]
    pub fn rotated<B>(&self, rotation: &Rotation<F, B>) -> Covariance<B> {
        let matrix = rotation.to_matrix();
        Covariance::assume(matrix * self.inner * matrix.transpose())
    }
}
impl<F> Add for Covariance<F> {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        Self::assume(self.inner + other.inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_are_read_from_the_right() {
        let half = core::f64::consts::FRAC_1_SQRT_2;
        // Camera z is the vehicle's x; then a turn of +90° about z converts x to y.
        let mount = Rotation::<Cam, Vehicle>::assume_from_quaternion([0.5, 0.5, 0.5, 0.5]).unwrap();
        let attitude = Rotation::<Vehicle, Fixed>::assume_from_quaternion([half, 0.0, 0.0, half]).unwrap();
        let boresight = Vector::<Cam>::new(0.0, 0.0, 1.0);
        let both: Rotation<Cam, Fixed> = attitude * mount;
        assert!((both * boresight - Vector::new(0.0, 1.0, 0.0)).norm() < 1e-15);
        assert!((both.inverse() * (both * boresight) - boresight).norm() < 1e-15);
        assert!((attitude * (mount * boresight) - both * boresight).norm() < 1e-15);
        assert_eq!(mount.wxyz(), [0.5; 4]);
    }

    #[test]
    fn what_is_no_rotation_is_refused() {
        for wxyz in [[0.0; 4], [f64::NAN, 0.0, 0.0, 1.0], [f64::INFINITY, 0.0, 0.0, 1.0]] {
            assert!(Rotation::<Cam, Vehicle>::assume_from_quaternion(wxyz).is_none(), "{wxyz:?}");
        }
    }

    #[test]
    fn a_covariance_turns_with_its_frame() {
        let turn = Rotation::<Cam, Vehicle>::assume_from_quaternion([0.8, 0.0, 0.6, 0.0]).unwrap();
        let direction = Vector::<Cam>::new(0.6, 0.0, 0.8);
        let turned = Covariance::across(&direction, 4.0).rotated(&turn);
        let expected = Covariance::across(&(turn * direction), 4.0);
        assert!((turned.into_inner() - expected.into_inner()).norm() < 1e-14);
    }

    /// A frame costs no memory.
    #[test]
    fn the_types_are_their_numbers() {
        assert_eq!(size_of::<Vector<Cam>>(), size_of::<Vector3<f64>>());
        assert_eq!(size_of::<Option<Rotation<Cam, Fixed>>>(), size_of::<Option<UnitQuaternion<f64>>>());
    }
}
