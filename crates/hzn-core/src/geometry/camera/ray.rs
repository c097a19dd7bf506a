//! The ray of a pixel, and its derivative in a tangent basis.

use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::geometry::frames::{Cam, UnitVec3};

/// The ray of a pixel and its derivative by the pixel.
///
/// # Example
///
/// Near the middle of the picture, a pixel is 1/f radians wide:
///
/// ```
/// use hzn_core::camera::{Camera, Config, Model};
/// use hzn_core::pixel::ImagePoint;
///
/// let camera = Camera::<f64>::try_new(&Config::ideal(Model::Pinhole, 641, 481, 500.0))?;
/// let ray = camera.ray(ImagePoint { u: 320.0, v: 240.0 }).expect("the middle has a ray");
/// let [[x_by_u, _], [_, y_by_v], _] = ray.jacobian();
/// assert_eq!([x_by_u, y_by_v], [1.0 / 500.0; 2]);
/// # Ok::<(), hzn_core::error::ConfigError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray<T> {
    /// Unit vector in the camera frame.
    pub(crate) s: V3<T>,
    /// `[∂a/∂u, ∂a/∂v, ∂b/∂u, ∂b/∂v]`, where a and b are the coordinates of the ray's change in the tangent basis that
    /// [`tangent`] spans at `s`; radians per pixel.
    // Four numbers in a tangent basis replace the six of the derivative, because the ray keeps its length. An edge
    // point is smaller by two numbers.
    pub(crate) m: [T; 4],
}

/// Returns the tangent basis at `s`: the images of x and y under the shortest rotation that takes z to `s`. It is
/// smooth everywhere except at `s` = −z, which no lens sees.
#[inline(always)]
pub(crate) fn tangent<T: Real>(s: &V3<T>) -> [V3<T>; 2] {
    let one = T::one();
    // `linalg::basis` would not do here: it changes its sign at z = 0, which a lens wider than 180° sees.
    let q = one / (one + s.z);
    let xy = -s.x * s.y * q;
    [V3::new(one - s.x * s.x * q, xy, -s.x), V3::new(xy, one - s.y * s.y * q, -s.y)]
}

impl<T: Real> Ray<T> {
    /// Returns the direction.
    pub fn direction(&self) -> UnitVec3<Cam, T> {
        UnitVec3::assume_unit(self.s)
    }
    /// Returns the derivative of the ray by (u, v): rows x, y, z; radians per pixel.
    pub fn jacobian(&self) -> [[T; 2]; 3] {
        let [a, b] = tangent(&self.s);
        let [au, av, bu, bv] = self.m;
        let row = |a: T, b: T| [a * au + b * bu, a * av + b * bv];
        [row(a.x, b.x), row(a.y, b.y), row(a.z, b.z)]
    }
}

/// Returns the ray and its derivative for a radially symmetric lens: `scale` = sin θ / ρ, `cos` = cos θ,
/// `dtheta` = dθ/dρ.
///
/// In the tangent basis of [`tangent`] the derivative by (x, y) is `scale`·I + (`dtheta` − `scale`)·u uᵀ with u the
/// unit vector of (x, y) (math: J = t_r dθ/dρ uᵀ + t_φ (sin θ/ρ) u⊥ᵀ, and the basis turns t_r to u, t_φ to u⊥).
#[inline(always)]
pub(super) fn radial_ray<T: Real>(x: T, y: T, scale: T, cos: T, dtheta: T) -> (V3<T>, [T; 4]) {
    let s = V3::new(x * scale, y * scale, cos);
    let rho2 = x * x + y * y;
    // At the centre the derivative is a multiple of the identity. Below this limit rho2 would be a divisor near 0.
    let k = if rho2 > T::from_f64(1e-24) { (dtheta - scale) / rho2 } else { T::zero() };
    let xy = k * x * y;
    (s, [scale + k * x * x, xy, xy, scale + k * y * y])
}
