//! Brown-Conrady: a pinhole with radial and tangential distortion, with the coefficients in OpenCV's order.

use super::config::Config;
use super::ray::radial_ray;
use crate::base::error::{ConfigError, Limit};
use crate::base::linalg::V3;
use crate::base::parts::packed;
use crate::base::real::Real;

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Brown<T> {
    k1: T,
    k2: T,
    p1: T,
    p2: T,
    k3: T,
}

impl Brown<f64> {
    /// Returns the lens of a calibration, which is not checked.
    pub(super) fn of_config(config: &Config) -> Self {
        let k = |i| config.coefficient(i);
        Self { k1: k(0), k2: k(1), p1: k(2), p2: k(3), k3: k(4) }
    }
}

impl<T: Real> Brown<T> {
    /// Returns the lens, ρ_max (distorted) and θ_max in radians.
    pub(super) fn try_new(config: &Config, rho_corner: f64) -> Result<(Self, f64, f64), ConfigError> {
        let k = |i| config.coefficient(i);
        let lens = Brown::of_config(config);
        // `radius` is the distorted radius as a function of the undistorted one, and `slope` is its derivative. The
        // lens ends where the slope is not positive.
        let radius = |t: f64| t * lens.factor(t * t);
        let slope = |t: f64| {
            let q = t * t;
            1.0 + q * (3.0 * lens.k1 + q * (5.0 * lens.k2 + q * 7.0 * lens.k3))
        };
        // 1.5 rad is the end because tan θ grows without limit towards 90°, and its rounding with it.
        let end = config.theta_max_deg.map_or(1.5, |deg| deg.to_radians().min(1.5));
        let mut theta = 0.0;
        // The tangential terms move the corner a little; a margin of 1 % allows for this.
        while theta < end && radius(libm::tan(theta)) < rho_corner * 1.01 {
            // The slope must be positive 2° beyond the last ray, because near its root a small error of the image point
            // becomes a large one of the angle.
            if slope(libm::tan(theta + 2f64.to_radians())) <= 0.0 {
                let limit = theta.to_degrees() + 2.0;
                let (field, value) =
                    config.theta_max_deg.map_or(("camera.k", k(0)), |deg| ("camera.theta_max_deg", deg));
                return Err(ConfigError { field, value, limit: Limit::Monotone(limit), body: None });
            }
            // Fixed steps are enough at load time, because the margin of 2° is 35 of them.
            theta += 1e-3;
        }
        let theta = theta.min(end);
        let rho = radius(libm::tan(theta)).min(rho_corner * 1.01);
        // The checks are in f64 whatever the precision, so that a calibration is accepted or refused alike in both.
        let t = Brown {
            k1: T::from_f64(lens.k1),
            k2: T::from_f64(lens.k2),
            p1: T::from_f64(lens.p1),
            p2: T::from_f64(lens.p2),
            k3: T::from_f64(lens.k3),
        };
        Ok((t, rho, theta))
    }

    fn factor(&self, q: T) -> T {
        T::one() + q * (self.k1 + q * (self.k2 + q * self.k3))
    }

    /// Returns the distorted coordinates of the pinhole point (x, y).
    pub(super) fn distort(&self, x: T, y: T) -> (T, T) {
        let two = T::from_f64(2.0);
        let q = x * x + y * y;
        let f = self.factor(q);
        (
            x * f + two * self.p1 * x * y + self.p2 * (q + two * x * x),
            y * f + self.p1 * (q + two * y * y) + two * self.p2 * x * y,
        )
    }

    /// Returns the derivative of [`Self::distort`]: xx, xy, yx, yy.
    pub(super) fn slope(&self, x: T, y: T) -> [T; 4] {
        let (two, six) = (T::from_f64(2.0), T::from_f64(6.0));
        let q = x * x + y * y;
        let f = self.factor(q);
        let g = two * (self.k1 + q * (two * self.k2 + q * T::from_f64(3.0) * self.k3));
        let xy = g * x * y + two * self.p1 * x + two * self.p2 * y;
        [
            f + g * x * x + two * self.p1 * y + six * self.p2 * x,
            xy,
            xy,
            f + g * y * y + six * self.p1 * y + two * self.p2 * x,
        ]
    }

    /// Returns the derivatives of [`Self::distort`] by k1, k2, p1, p2, k3; they do not depend on the coefficients.
    #[inline(always)]
    pub(super) fn by_coefficients(x: T, y: T) -> [[T; 2]; 5] {
        let two = T::from_f64(2.0);
        let q = x * x + y * y;
        [
            [x * q, y * q],
            [x * q * q, y * q * q],
            // The order is that of OpenCV: k3 stands behind p1 and p2.
            [two * x * y, q + two * y * y],
            [q + two * x * x, two * x * y],
            [x * q * q * q, y * q * q * q],
        ]
    }

    /// Returns the ray of the distorted point and its derivative in the tangent basis; `None` if Newton's method does
    /// not converge.
    // One copy in flash, not one for every caller.
    #[inline(never)]
    pub(super) fn ray(&self, xd: T, yd: T) -> Option<(V3<T>, [T; 4])> {
        let (mut x, mut y) = (xd, yd);
        let mut inverse = [T::one(), T::zero(), T::zero(), T::one()];
        let mut arrived = false;
        // Newton's method doubles the digits at each step; twelve are far more than f64 needs. The limit is for points
        // at which the lens has no inverse.
        for _ in 0..12 {
            let (px, py) = self.distort(x, y);
            let [a, b, c, d] = self.slope(x, y);
            let det = a * d - b * c;
            // A determinant near 0 is the fold of the lens: beyond it two rays would share an image point.
            if !(det > T::from_f64(1e-3)) {
                return None;
            }
            let s = T::one() / det;
            inverse = [d * s, -b * s, -c * s, a * s];
            // The derivative is taken once more at the solution, because the ray's derivative must belong to the last x
            // and y.
            if arrived {
                break;
            }
            let (ex, ey) = (xd - px, yd - py);
            let (sx, sy) = (inverse[0] * ex + inverse[1] * ey, inverse[2] * ex + inverse[3] * ey);
            x += sx;
            y += sy;
            arrived = sx.abs() + sy.abs() <= T::EPSILON * T::from_f64(8.0) * (T::one() + x.abs() + y.abs());
        }
        // A point without convergence has no ray. A guess would be an edge point in a wrong direction.
        if !arrived {
            return None;
        }
        let z = T::one() / (T::one() + x * x + y * y).sqrt();
        let (s, [pa, pb, pc, pd]) = radial_ray(x, y, z, z, z * z);
        let [ia, ib, ic, id] = inverse;
        Some((s, [pa * ia + pb * ic, pa * ib + pb * id, pc * ia + pd * ic, pc * ib + pd * id]))
    }
}

packed!(Brown<T> { k1, k2, p1, p2, k3 });
