//! Kannala-Brandt and equidistant lenses.
//!
//! The inverse θ(ρ) has no closed form. On loading it is solved by Newton's method at Chebyshev nodes, and what a
//! ray needs (sin θ/ρ, cos θ, dθ/dρ) is kept as three Chebyshev series in ρ². The series are checked against Newton
//! between the nodes; where they do not reach the precision of `T` (close to the end of monotony), rays are solved
//! by Newton instead.

use super::config::Config;
use super::radial_ray;
use crate::block::LANES;
use crate::error::{ConfigError, Limit, require};
use crate::linalg::V3;
use crate::real::Real;

/// Most terms of each series; as many are used as the precision of `T` asks for.
const TERMS: usize = 24;

#[derive(Debug, Clone)]
pub(super) struct Radial<T> {
    k: [T; 4],
    theta_max: T,
    r_max: T,
    inverse: Inverse<T>,
}

#[derive(Debug, Clone)]
enum Inverse<T> {
    Newton,
    /// ρ² is mapped to −1…1 by `scale`·ρ² − 1. Each entry holds one order's coefficients of the three series
    /// (sin θ/ρ, cos θ, dθ/dρ), lowest first; the first `used` are summed by Clenshaw's recurrence.
    Series {
        scale: T,
        used: usize,
        terms: [[T; 3]; TERMS],
    },
}

/// Eight unit vectors, and eight derivatives in the tangent basis.
pub(super) type Lanes<T> = ([[T; LANES]; 3], [[T; LANES]; 4]);

/// r(θ) and r'(θ).
fn forward<T: Real>(k: &[T; 4], theta: T) -> (T, T) {
    let t2 = theta * theta;
    let [k1, k2, k3, k4] = *k;
    let one = T::one();
    let r = theta * (one + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4))));
    let d = one + t2 * (T::of(3.0) * k1 + t2 * (T::of(5.0) * k2 + t2 * (T::of(7.0) * k3 + t2 * T::of(9.0) * k4)));
    (r, d)
}

/// First root of r'(θ) below 180°, in radians: bracketed on a fine grid, then halved.
pub(super) fn monotonic_limit(k: &[f64; 4]) -> Option<f64> {
    const STEPS: i32 = 1800;
    let at = |i: i32| core::f64::consts::PI * f64::from(i) / f64::from(STEPS);
    let (mut low, mut high) = (1..=STEPS).find(|&i| forward(k, at(i)).1 <= 0.0).map(|i| (at(i - 1), at(i)))?;
    for _ in 0..60 {
        let mid = 0.5 * (low + high);
        if forward(k, mid).1 > 0.0 { low = mid } else { high = mid }
    }
    Some(low)
}

/// θ with r(θ) = ρ: Newton clamped to 0…θ_max from ρ θ_max/r(θ_max).
fn invert<T: Real>(k: &[T; 4], rho: T, theta_max: T, r_max: T) -> T {
    let mut theta = rho * theta_max / r_max;
    for _ in 0..8 {
        let (r, d) = forward(k, theta);
        let step = (r - rho) / d;
        theta = (theta - step).most(T::zero()).least(theta_max);
        if step.abs() <= T::EPSILON * theta {
            break;
        }
    }
    theta
}

impl<T: Real> Radial<T> {
    /// The lens, ρ_max and θ_max in radians.
    pub(super) fn try_new(config: &Config, rho_corner: f64) -> Result<(Self, f64, f64), ConfigError> {
        let k: [f64; 4] = core::array::from_fn(|i| config.coefficient(i));
        let limit = monotonic_limit(&k).unwrap_or(core::f64::consts::PI);
        let margin = 2f64.to_radians();
        let usable = limit - margin;
        // Where the corner is reached, if it is reached before the lens folds back.
        let corner =
            (forward(&k, usable).0 >= rho_corner).then(|| invert(&k, rho_corner, usable, forward(&k, usable).0));
        let theta_max = match (config.theta_max_deg.map(f64::to_radians), corner) {
            (Some(circle), Some(corner)) => circle.least(corner),
            (None, Some(corner)) => corner,
            (Some(circle), None) => {
                let deg = circle.to_degrees();
                require(circle <= usable, "camera.theta_max_deg", deg, Limit::Monotone(limit.to_degrees()))?;
                circle
            }
            (None, None) => {
                return Err(ConfigError {
                    field: "camera.k",
                    value: config.coefficient(0),
                    limit: Limit::Monotone(limit.to_degrees()),
                    body: None,
                });
            }
        };
        let r_max = forward(&k, theta_max).0;
        let (kt, tt, rt) = (k.map(T::of), T::of(theta_max), T::of(r_max));
        let inverse = Self::series(&k, theta_max, r_max);
        Ok((Self { k: kt, theta_max: tt, r_max: rt, inverse }, r_max, theta_max))
    }

    /// The three series, or Newton where they are not good enough.
    fn series(k: &[f64; 4], theta_max: f64, r_max: f64) -> Inverse<T> {
        let values = |rho: f64| -> [f64; 3] {
            if rho == 0.0 {
                return [1.0, 1.0, 1.0];
            }
            let theta = invert(k, rho, theta_max, r_max);
            let (sin, cos) = libm::sincos(theta);
            [sin / rho, cos, 1.0 / forward(k, theta).1]
        };
        let rho_of = |t: f64| libm::sqrt(0.5 * (t + 1.0)) * r_max;
        let mut terms = [[0.0f64; 3]; TERMS];
        let n = TERMS as f64;
        for node in 0..TERMS {
            let angle = core::f64::consts::PI * (node as f64 + 0.5) / n;
            let v = values(rho_of(libm::cos(angle)));
            for (order, term) in terms.iter_mut().enumerate() {
                let weight = libm::cos(order as f64 * angle) * if order == 0 { 1.0 } else { 2.0 } / n;
                for (c, v) in term.iter_mut().zip(v) {
                    *c += weight * v;
                }
            }
        }
        let scale = 2.0 / (r_max * r_max);
        // Direction to the working precision; the derivative only weighs points, so 1e-6 is ample.
        let tolerance = (T::EPSILON.f64() * 2.0).most(1e-14);
        let good = |used: usize| {
            (0..=64).all(|i| {
                let rho = r_max * f64::from(i) / 64.0;
                let (got, want) =
                    (clenshaw(terms.get(..used).unwrap_or_default(), scale * rho * rho - 1.0), values(rho));
                let direction = ((got[0] - want[0]).abs() * rho).most((got[1] - want[1]).abs());
                direction <= tolerance && (got[2] - want[2]).abs() <= (1e-6 * want[2]).most(tolerance)
            })
        };
        match (4..=TERMS).find(|&used| good(used)) {
            Some(used) => Inverse::Series { scale: T::of(scale), used, terms: terms.map(|row| row.map(T::of)) },
            None => Inverse::Newton,
        }
    }

    /// Rays of eight points (x, y) at once, where there are series: unit vectors and derivatives in the tangent basis.
    #[inline(always)]
    pub(super) fn rays(&self, x: &[T; LANES], y: &[T; LANES]) -> Option<Lanes<T>> {
        let Inverse::Series { scale, used, terms } = &self.inverse else { return None };
        let terms = terms.get(..*used)?;
        let (first, rest) = terms.split_first()?;
        let zero = [T::ZERO; LANES];
        let mut t = zero;
        for l in 0..LANES {
            t[l] = *scale * (x[l] * x[l] + y[l] * y[l]) - T::one();
        }
        let (mut b1, mut b2) = ([zero; 3], [zero; 3]);
        for term in rest.iter().rev() {
            for k in 0..3 {
                for l in 0..LANES {
                    let next = (t[l] + t[l]) * b1[k][l] - b2[k][l] + term[k];
                    b2[k][l] = b1[k][l];
                    b1[k][l] = next;
                }
            }
        }
        let (mut s, mut m) = ([zero; 3], [zero; 4]);
        for l in 0..LANES {
            let [sin, cos, dtheta]: [T; 3] = core::array::from_fn(|k| t[l] * b1[k][l] - b2[k][l] + first[k]);
            let rho2 = (x[l] * x[l] + y[l] * y[l]).most(T::of(1e-24));
            let k = (dtheta - sin) / rho2;
            let xy = k * x[l] * y[l];
            s[0][l] = x[l] * sin;
            s[1][l] = y[l] * sin;
            s[2][l] = cos;
            m[0][l] = sin + k * x[l] * x[l];
            m[1][l] = xy;
            m[2][l] = xy;
            m[3][l] = sin + k * y[l] * y[l];
        }
        Some((s, m))
    }

    /// The ray of (x, y) in units of the focal length and its derivative in the tangent basis.
    #[inline(always)]
    pub(super) fn ray(&self, x: T, y: T, rho2: T) -> (V3<T>, [T; 4]) {
        match &self.inverse {
            Inverse::Series { scale, used, terms } => {
                let [s, c, d] = clenshaw(terms.get(..*used).unwrap_or_default(), *scale * rho2 - T::one());
                radial_ray(x, y, s, c, d)
            }
            Inverse::Newton => {
                let rho = rho2.sqrt();
                let theta = invert(&self.k, rho, self.theta_max, self.r_max);
                let (sin, cos) = theta.sin_cos();
                let s = if rho > T::of(1e-12) { sin / rho } else { T::one() };
                radial_ray(x, y, s, cos, T::one() / forward(&self.k, theta).1)
            }
        }
    }

    /// θ beyond the largest radius, along the tangent there.
    #[cfg(feature = "horace")]
    pub(super) fn beyond(&self, rho: T) -> T {
        let (r, d) = forward(&self.k, self.theta_max);
        (self.theta_max + (rho - r) / d).least(T::of(core::f64::consts::PI))
    }

    /// r(θ) in units of the focal length.
    pub(super) fn radius(&self, theta: T) -> T {
        forward(&self.k, theta).0
    }
}

/// The three series at t in −1…1.
#[inline(always)]
fn clenshaw<T: Real>(terms: &[[T; 3]], t: T) -> [T; 3] {
    let two_t = t + t;
    let (mut b1, mut b2) = ([T::zero(); 3], [T::zero(); 3]);
    let Some((first, rest)) = terms.split_first() else { return b1 };
    for term in rest.iter().rev() {
        for i in 0..3 {
            let next = two_t * b1[i] - b2[i] + term[i];
            b2[i] = b1[i];
            b1[i] = next;
        }
    }
    core::array::from_fn(|i| t * b1[i] - b2[i] + first[i])
}
