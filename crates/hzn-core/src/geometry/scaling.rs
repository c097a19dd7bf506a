//! The linear map that turns an ellipsoid into a sphere (math.md, 13.1).
//!
//! Let A be the matrix of the ellipsoid qᵀ A q = 1 in the camera frame, and U any matrix with Uᵀ U = A. The points U q
//! lie on the unit sphere, so that the limb of the ellipsoid is a circular cone of the scaled rays
//! σ = U s/‖U s‖. Everything that is known of a sphere then holds for the ellipsoid. Here U is the symmetric root of A,
//! multiplied by the mean semi-axis: for a sphere it is exactly the identity, and for a body that is nearly a sphere
//! the scaled rays stay near the rays, so that focal length and angles keep their meaning.

use crate::base::linalg::{M3, V3};
use crate::base::real::Real;
use crate::geometry::block::{Block, LANES};
use crate::geometry::camera::ray::Ray;

/// The map between the camera frame and the scaled space of one ellipsoid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Scaling<T> {
    /// U, symmetric; lengths that it maps are in units of the mean semi-axis.
    pub(crate) to: M3<T>,
    /// U⁻¹.
    pub(crate) from: M3<T>,
}

impl<T: Real> Scaling<T> {
    /// Makes the map for an ellipsoid with the given semi-axes, in units of their mean. The columns of
    /// `camera_from_fixed` are the axes of the body in the camera frame.
    pub(crate) fn new(semi_axes: [T; 3], camera_from_fixed: &M3<T>) -> Self {
        let [a, b, c] = semi_axes;
        let one = T::one();
        // A sphere gets the exact identity. The sums below would leave rounding in it, and `is_uniform` would not see
        // the sphere.
        if a == b && b == c {
            return Self { to: M3::identity() * (one / a), from: M3::identity() * a };
        }
        // R D Rᵀ = c I + (a − c) x xᵀ + (b − c) y yᵀ keeps small differences between the axes exact.
        let m = camera_from_fixed;
        let (x, y) = (V3::new(m.m11, m.m21, m.m31), V3::new(m.m12, m.m22, m.m32));
        let root = |a: T, b: T, c: T| M3::identity() * c + x * x.transpose() * (a - c) + y * y.transpose() * (b - c);
        Self { to: root(one / a, one / b, one / c), from: root(a, b, c) }
    }

    /// Returns the scaled unit vector of a direction in the camera frame.
    pub(crate) fn scale(&self, direction: &V3<T>) -> V3<T> {
        let scaled = self.to * direction;
        scaled * (T::one() / scaled.dot(&scaled).sqrt())
    }

    /// Returns the unit vector in the camera frame of a scaled direction.
    pub(crate) fn unscale(&self, scaled: &V3<T>) -> V3<T> {
        let direction = self.from * scaled;
        direction * (T::one() / direction.dot(&direction).sqrt())
    }

    /// Returns whether scaled rays are the rays themselves: the body is a sphere.
    pub(crate) fn is_uniform(&self) -> bool {
        self.to == M3::identity() * self.to.m11
    }

    /// Adds to a derivative v·dσ by (u, v) for each lane the part that it lacks, for v·σ = `along`: it is that of
    /// σ = U s/‖U s‖, while (13.10) has that of U s/‖U s‖ at constant length. With w = U⁻¹σ, the derivative of ln ‖U s‖
    /// is −(U⁻¹w)·dσ/(w·w).
    #[inline(always)]
    pub(crate) fn add_length(&self, block: &Block<T>, along: &[T; LANES], derivative: &mut [[T; LANES]; 2]) {
        for l in 0..LANES {
            // Plain sums are used instead of nalgebra's product, so that the loop becomes vector instructions.
            let w = times(&self.from, [block.s[0][l], block.s[1][l], block.s[2][l]]);
            let per = -along[l] / dot(w, w).max(T::from_f64(1e-20));
            let [gu, gv] = block.gradient_at(l, &V3::from(times(&self.from, w).map(|x| x * per)));
            (derivative[0][l], derivative[1][l]) = (derivative[0][l] + gu, derivative[1][l] + gv);
        }
    }

    /// Converts a ray with its derivative: dσ = (I − σ σᵀ) U ds/‖U s‖.
    #[inline]
    pub(crate) fn scale_ray(&self, ray: &Ray<T>) -> Ray<T> {
        let ([x, y, z], m) = self.scaled([ray.s.x, ray.s.y, ray.s.z], ray.m);
        Ray { s: V3::new(x, y, z), m }
    }

    /// Converts the rays of a block, as [`Self::scale_ray`].
    #[inline(never)]
    pub(crate) fn scale_block(&self, block: &mut Block<T>) {
        let (s, m) = (block.s, block.m);
        for l in 0..LANES {
            let (scaled, derivative) = self.scaled([s[0][l], s[1][l], s[2][l]], [m[0][l], m[1][l], m[2][l], m[3][l]]);
            for i in 0..3 {
                block.s[i][l] = scaled[i];
            }
            for i in 0..4 {
                block.m[i][l] = derivative[i];
            }
        }
    }

    /// Converts a ray and its derivative in the tangent bases, which are perpendicular to the rays, so that the
    /// projection (I − σ σᵀ) is implicit. A ray of length 0 stays so.
    #[inline(always)]
    fn scaled(&self, s: [T; 3], [au, av, bu, bv]: [T; 4]) -> ([T; 3], [T; 4]) {
        let one = T::one();
        let long = times(&self.to, s);
        // The floor is for cleared points, whose ray may be 0: the quotient stays finite.
        let per_length = one / dot(long, long).max(T::from_f64(1e-20)).sqrt();
        let [x, y, z] = long.map(|c| c * per_length);
        let (from, to) = (one / (one + s[2]), one / (one + z));
        let by = |a: T, b: T| {
            let along = s[0] * a + s[1] * b;
            let moved = times(&self.to, [a - s[0] * (along * from), b - s[1] * (along * from), -along]);
            let w = (x * moved[0] + y * moved[1]) * to + moved[2];
            [(moved[0] - x * w) * per_length, (moved[1] - y * w) * per_length]
        };
        let ([au, bu], [av, bv]) = (by(au, bu), by(av, bv));
        ([x, y, z], [au, av, bu, bv])
    }
}

/// Returns the product of a symmetric matrix and a vector, as plain sums that become vector instructions.
#[inline(always)]
fn times<T: Real>(m: &M3<T>, [x, y, z]: [T; 3]) -> [T; 3] {
    [m.m11 * x + m.m12 * y + m.m13 * z, m.m12 * x + m.m22 * y + m.m23 * z, m.m13 * x + m.m23 * y + m.m33 * z]
}

#[inline(always)]
fn dot<T: Real>(a: [T; 3], b: [T; 3]) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// A cone σ·e = cos α about a scaled axis, seen from the scaled space of another body.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ScaledCone<T> {
    /// Axis in the scaled space of the cone's own body, and the cosine of the half-angle.
    pub(crate) e: V3<T>,
    pub(crate) c: T,
    /// The scaling of that body; `None` if the cone is circular in the camera frame.
    pub(crate) scaling: Option<Scaling<T>>,
}

impl<T: Real> ScaledCone<T> {
    /// Returns cos α − σ·e for a direction in the camera frame. The result is negative inside the cone.
    pub(crate) fn outside(&self, s: &V3<T>) -> T {
        self.c - self.scaling.as_ref().map_or(*s, |scaling| scaling.scale(s)).dot(&self.e)
    }

    /// Converts the cone to double precision.
    pub(crate) fn to_f64(self) -> ScaledCone<f64> {
        let double = |m: M3<T>| m.map(Real::to_f64);
        let scaling = self.scaling.map(|s| Scaling { to: double(s.to), from: double(s.from) });
        ScaledCone { e: self.e.map(Real::to_f64), c: self.c.to_f64(), scaling }
    }

    /// Returns the vector v with d(σ·e) = v·ds for a direction in the camera frame.
    pub(crate) fn gradient(&self, s: &V3<T>) -> V3<T> {
        let Some(scaling) = &self.scaling else { return self.e };
        let scaled = scaling.to * s;
        let per_length = T::one() / scaled.dot(&scaled).sqrt();
        let sigma = scaled * per_length;
        // U is symmetric.
        scaling.to * (self.e - sigma * sigma.dot(&self.e)) * per_length
    }

    /// Does the same as [`Self::outside`] and [`Self::gradient`] for a ray in the scaled space of another body; the
    /// gradient is by that ray.
    pub(crate) fn offset_from(&self, ray: &V3<T>, other: Option<&Scaling<T>>) -> (T, V3<T>) {
        let Some(other) = other else { return (self.outside(ray), self.gradient(ray)) };
        // s = U⁻¹σ/‖U⁻¹σ‖, and U is symmetric.
        let long = other.from * ray;
        let per_length = T::one() / long.dot(&long).sqrt();
        let s = long * per_length;
        let by_s = self.gradient(&s);
        (self.outside(&s), other.from * (by_s - s * s.dot(&by_s)) * per_length)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::camera::{self, Camera};
    use crate::geometry::frames::{Cam, Rotation, Vehicle};
    use crate::geometry::pixel::ImagePoint;

    fn rotation() -> M3<f64> {
        Rotation::<Vehicle, Cam, f64>::assume_from_quaternion([0.3, -0.5, 0.7, 0.2]).unwrap().to_matrix()
    }

    #[test]
    fn points_of_the_ellipsoid_lie_on_the_unit_sphere() {
        let (axes, r) = ([1.3, 1.0, 0.7], rotation());
        let scaling = Scaling::new(axes, &r);
        for direction in [[1.0, 0.0, 0.0], [0.3, -0.4, 0.5], [-0.1, 0.2, 2.0]] {
            let n = V3::from(direction).normalize();
            let q = r * V3::new(axes[0] * n.x, axes[1] * n.y, axes[2] * n.z);
            assert!(((scaling.to * q).norm() - 1.0).abs() < 1e-14);
        }
        assert!((scaling.to * scaling.from - M3::identity()).norm() < 1e-14);
        let sphere = Scaling::new([1.0, 1.0, 1.0], &r);
        assert_eq!((sphere.to, sphere.from), (M3::identity(), M3::identity()));
    }

    #[test]
    fn scaled_rays_have_the_derivatives_of_finite_differences() {
        let camera =
            Camera::<f64>::try_new(&camera::Config::ideal(camera::Model::Equidistant, 640, 480, 200.0)).unwrap();
        let scaling = Scaling::new([1.2, 1.0, 0.8], &rotation());
        for (u, v) in [(10.0, 20.0), (319.5, 239.5), (600.0, 100.0)] {
            let at = |u: f64, v: f64| scaling.scale_ray(&camera.ray(ImagePoint { u, v }).unwrap());
            let ray = at(u, v);
            for (k, (du, dv)) in [(0, (1e-4, 0.0)), (1, (0.0, 1e-4))] {
                let change = (at(u + du, v + dv).s - at(u - du, v - dv).s) / 2e-4;
                assert!((change - V3::from(ray.jacobian().map(|row| row[k]))).norm() < 1e-9);
            }
        }
    }

    #[test]
    fn a_cone_has_the_gradient_of_finite_differences() {
        let scaling = Some(Scaling::new([1.2, 1.0, 0.8], &rotation()));
        for scaling in [scaling, None] {
            let cone = ScaledCone { e: V3::new(0.1, 0.2, 0.9).normalize(), c: 0.7, scaling };
            let s = V3::new(-0.3, 0.5, 0.8).normalize();
            let gradient = cone.gradient(&s);
            for step in [V3::new(0.8, 0.0, 0.3), V3::new(0.0, -0.8, 0.5)].map(|t| t - s * s.dot(&t)) {
                let change = (cone.outside(&(s - step * 1e-6)) - cone.outside(&(s + step * 1e-6))) / 2e-6;
                assert!((change - gradient.dot(&step)).abs() < 1e-8, "{change} {}", gradient.dot(&step));
            }
            let other = Scaling::new([0.9, 1.0, 1.1], &rotation());
            let ray = other.scale(&s);
            let (r, by_ray) = cone.offset_from(&ray, Some(&other));
            assert!((r - cone.outside(&s)).abs() < 1e-14);
            for step in [V3::new(0.8, 0.0, 0.3), V3::new(0.0, -0.8, 0.5)].map(|t| t - ray * ray.dot(&t)) {
                let at = |sign: f64| cone.offset_from(&(ray + step * (sign * 1e-6)).normalize(), Some(&other)).0;
                let change = (at(-1.0) - at(1.0)) / 2e-6;
                assert!((change - by_ray.dot(&step)).abs() < 1e-8);
            }
        }
    }
}
