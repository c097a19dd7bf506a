//! Radially symmetric lenses.
//!
//! The inverse θ(ρ) has no closed form. At load time Newton's method solves it at Chebyshev nodes. The quantities of a
//! ray (sin θ/ρ, cos θ, dθ/dρ) are then kept as three polynomials in ρ², made from Chebyshev series. They are checked
//! against Newton's method between the nodes. If they do not reach the precision of `T` (close to the angle from which
//! r(θ) no longer grows), Newton's method computes every ray.

use super::config::Config;
use super::curve::Curve;
use super::ray::radial_ray;
use crate::base::error::{ConfigError, Limit, require};
use crate::base::linalg::V3;
use crate::base::packed::{Packed, Packer, Unpacker};
use crate::base::parts::packed;
use crate::base::real::Real;
use crate::geometry::block::LANES;

/// Maximum number of terms of each series; the number in use depends on the precision of `T`.
// The rays are polynomials because of their cost: a table with one Newton step and Newton's method both take longer.
const TERMS: usize = 24;

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Radial<T> {
    curve: Curve<T>,
    theta_max: T,
    r_max: T,
    inverse: Inverse<T>,
}

#[derive(Debug, Clone, PartialEq)]
enum Inverse<T> {
    Newton,
    /// ρ² is mapped to −1…1 by `scale`·ρ² − 1. Each entry holds the coefficients of one power for the three polynomials
    /// (sin θ/ρ, cos θ, dθ/dρ), lowest power first. The first `used` entries count.
    Series {
        scale: T,
        used: usize,
        terms: [[T; 3]; TERMS],
    },
}

/// Eight unit vectors, and their eight derivatives in the tangent basis.
pub(super) type Lanes<T> = ([[T; LANES]; 3], [[T; LANES]; 4]);

/// Returns the first root of r'(θ) below 180°, or the first pole of r(θ), in radians. It is bracketed on a fine grid
/// and found by bisection. `None` if there is neither.
pub(super) fn monotonic_limit(curve: &Curve<f64>) -> Option<f64> {
    // A tenth of a degree brackets the first root; Newton's method could step over it to a later one.
    const STEPS: i32 = 1800;
    let at = |i: i32| core::f64::consts::PI * f64::from(i) / f64::from(STEPS);
    let grows = |theta: f64| {
        let (r, slope) = curve.radius_and_slope(theta);
        slope > 0.0 && r >= 0.0
    };
    let (mut low, mut high) = (1..=STEPS).find(|&i| !grows(at(i))).map(|i| (at(i - 1), at(i)))?;
    // Sixty halvings of the bracket reach the last bit of f64.
    for _ in 0..60 {
        let mid = 0.5 * (low + high);
        if grows(mid) { low = mid } else { high = mid }
    }
    Some(low)
}

/// Returns θ with r(θ) = ρ, by Newton's method from ρ θ_max/r(θ_max), clamped to 0…θ_max.
#[inline(never)]
fn invert<T: Real>(curve: &Curve<T>, rho: T, theta_max: T, r_max: T) -> T {
    // From this start f64 needs at most five steps on lenses up to 110° off axis; from θ = ρ up to seven.
    let mut theta = rho * theta_max / r_max;
    for _ in 0..8 {
        let (r, d) = curve.radius_and_slope(theta);
        let step = (r - rho) / d;
        // The clamp keeps a step from a flat part of the curve within the range that was checked.
        theta = (theta - step).max(T::zero()).min(theta_max);
        if step.abs() <= T::EPSILON * theta {
            break;
        }
    }
    theta
}

impl<T: Real> Radial<T> {
    /// Returns the lens, ρ_max and θ_max in radians.
    pub(super) fn try_new(config: &Config, rho_corner: f64) -> Result<(Self, f64, f64), ConfigError> {
        let curve = Curve::new(config);
        let limit = monotonic_limit(&curve).unwrap_or(core::f64::consts::PI);
        // Nearer to the root of r'(θ), 1/r' grows so fast that series fail by degrees.
        let margin = 2f64.to_radians();
        // The lens need not be monotone beyond the picture: calibrations are often wild there, and would otherwise be
        // refused.
        let usable = limit - margin;
        // `corner` is the angle of the corner, if the lens reaches it before the end of monotony.
        let corner = (curve.radius_and_slope(usable).0 >= rho_corner)
            .then(|| invert(&curve, rho_corner, usable, curve.radius_and_slope(usable).0));
        let theta_max = match (config.theta_max_deg.map(f64::to_radians), corner) {
            (Some(circle), Some(corner)) => circle.min(corner),
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
        let r_max = curve.radius_and_slope(theta_max).0;
        let (tt, rt) = (T::from_f64(theta_max), T::from_f64(r_max));
        let inverse = Self::series(&curve, theta_max, r_max);
        Ok((Self { curve: curve.cast(), theta_max: tt, r_max: rt, inverse }, r_max, theta_max))
    }

    /// Returns the three series, or Newton's method if the series are not accurate enough.
    fn series(curve: &Curve<f64>, theta_max: f64, r_max: f64) -> Inverse<T> {
        let values = |rho: f64| -> [f64; 3] {
            if rho == 0.0 {
                // At the centre sin θ/ρ is 0/0; its limit is 1/r'(0), which is not 1 for the lenses of Kalibr.
                let slope = 1.0 / curve.radius_and_slope(0.0).1;
                return [slope, 1.0, slope];
            }
            let theta = invert(curve, rho, theta_max, r_max);
            let (sin, cos) = libm::sincos(theta);
            [sin / rho, cos, 1.0 / curve.radius_and_slope(theta).1]
        };
        // The series is in ρ², because all three functions are even in ρ: half of the terms would be 0 otherwise, and a
        // ray would need a root.
        let rho_of = |t: f64| libm::sqrt(0.5 * (t + 1.0)) * r_max;
        let mut terms = [[0.0f64; 3]; TERMS];
        let n = TERMS as f64;
        for node in 0..TERMS {
            // Chebyshev nodes are dense at both ends. Equally spaced nodes would let a polynomial of this degree swing
            // there.
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
        // The direction has the working precision. The derivative only weights points, so 1e-6 is enough.
        let tolerance = (T::EPSILON.to_f64() * 2.0).max(1e-14);
        let good = |powers: &[[f64; 3]]| {
            (0..=64).all(|i| {
                let rho = r_max * f64::from(i) / 64.0;
                let (got, want) = (horner(powers, scale * rho * rho - 1.0), values(rho));
                let direction = ((got[0] - want[0]).abs() * rho).max((got[1] - want[1]).abs());
                direction <= tolerance && (got[2] - want[2]).abs() <= (1e-6 * want[2]).max(tolerance)
            })
        };
        // The shortest series that is good enough is kept, because each term costs three products a ray. Single
        // precision needs fewer.
        for used in 4..=TERMS {
            // Powers of t are kept in place of Chebyshev's polynomials, because Horner's form needs one sum a term less
            // than Clenshaw's.
            let powers = powers(terms.get(..used).unwrap_or_default());
            if good(powers.get(..used).unwrap_or_default()) {
                return Inverse::Series {
                    scale: T::from_f64(scale),
                    used,
                    terms: powers.map(|row| row.map(T::from_f64)),
                };
            }
        }
        Inverse::Newton
    }

    /// Returns the rays of eight points (x, y) at once: unit vectors and derivatives in the tangent basis. `None`
    /// without series.
    #[inline(always)]
    pub(super) fn rays(&self, x: &[T; LANES], y: &[T; LANES]) -> Option<Lanes<T>> {
        let Inverse::Series { scale, used, terms } = &self.inverse else { return None };
        let (last, rest) = terms.get(..*used)?.split_last()?;
        let zero = [T::ZERO; LANES];
        let (mut rho2, mut t) = (zero, zero);
        for l in 0..LANES {
            rho2[l] = x[l] * x[l] + y[l] * y[l];
            t[l] = *scale * rho2[l] - T::one();
        }
        let [mut sin, mut cos, mut dtheta] = last.map(|highest| [highest; LANES]);
        for term in rest.iter().rev() {
            for l in 0..LANES {
                sin[l] = sin[l] * t[l] + term[0];
                cos[l] = cos[l] * t[l] + term[1];
                dtheta[l] = dtheta[l] * t[l] + term[2];
            }
        }
        let (mut s, mut m) = ([zero; 3], [zero; 4]);
        for l in 0..LANES {
            // The floor keeps the quotient finite at the centre, so that the loop needs no branch; the products with x
            // and y make it vanish there.
            let k = (dtheta[l] - sin[l]) / rho2[l].max(T::from_f64(1e-24));
            let xy = k * x[l] * y[l];
            s[0][l] = x[l] * sin[l];
            s[1][l] = y[l] * sin[l];
            s[2][l] = cos[l];
            m[0][l] = sin[l] + k * x[l] * x[l];
            m[1][l] = xy;
            m[2][l] = xy;
            m[3][l] = sin[l] + k * y[l] * y[l];
        }
        Some((s, m))
    }

    /// Returns the ray of (x, y), in units of the focal length, and its derivative in the tangent basis.
    #[inline(always)]
    pub(super) fn ray(&self, x: T, y: T, rho2: T) -> (V3<T>, [T; 4]) {
        match &self.inverse {
            Inverse::Series { scale, used, terms } => {
                let [s, c, d] = horner(terms.get(..*used).unwrap_or_default(), *scale * rho2 - T::one());
                radial_ray(x, y, s, c, d)
            }
            Inverse::Newton => self.ray_by_newton(x, y, rho2),
        }
    }

    /// Does the same as [`Self::ray`], without series.
    // One copy in flash, not one for every caller.
    #[inline(never)]
    fn ray_by_newton(&self, x: T, y: T, rho2: T) -> (V3<T>, [T; 4]) {
        let rho = rho2.sqrt();
        let theta = invert(&self.curve, rho, self.theta_max, self.r_max);
        let (sin, cos) = theta.sin_cos();
        let dtheta = T::one() / self.curve.radius_and_slope(theta).1;
        // At the centre, sin θ/ρ equals dθ/dρ.
        let s = if rho > T::from_f64(1e-12) { sin / rho } else { dtheta };
        radial_ray(x, y, s, cos, dtheta)
    }

    /// Returns θ beyond the largest radius, along the tangent of the curve there, up to π.
    pub(super) fn extrapolate_theta(&self, rho: T) -> T {
        let (r, d) = self.curve.radius_and_slope(self.theta_max);
        (self.theta_max + (rho - r) / d).min(T::from_f64(core::f64::consts::PI))
    }

    /// Returns ∂r/∂k at θ for every coefficient, times `per`.
    pub(super) fn by_coefficients(&self, theta: T, per: T) -> [T; 5] {
        self.curve.by_coefficients(theta, per)
    }

    /// Returns r(θ) in units of the focal length.
    pub(super) fn radius(&self, theta: T) -> T {
        self.curve.radius_and_slope(theta).0
    }
}

/// Evaluates the three polynomials at t.
#[inline(always)]
fn horner<T: Real>(terms: &[[T; 3]], t: T) -> [T; 3] {
    terms.iter().rev().fold([T::zero(); 3], |sum, term| core::array::from_fn(|i| sum[i] * t + term[i]))
}

/// Converts three Chebyshev series to coefficients of powers of t, by T₀ = 1, T₁ = t, Tₙ₊₁ = 2 t Tₙ − Tₙ₋₁.
fn powers(series: &[[f64; 3]]) -> [[f64; 3]; TERMS] {
    let mut sums = [[0.0; 3]; TERMS];
    let (mut before, mut this) = ([0.0; TERMS], [0.0; TERMS]);
    for (order, term) in series.iter().enumerate() {
        let next: [f64; TERMS] = core::array::from_fn(|power| match (order, power) {
            (0, 0) | (1, 1) => 1.0,
            (0 | 1, _) => 0.0,
            (_, 0) => -before[0],
            _ => 2.0 * this[power - 1] - before[power],
        });
        (before, this) = (this, next);
        for (sum, factor) in sums.iter_mut().zip(this) {
            for (s, c) in sum.iter_mut().zip(term) {
                *s += factor * c;
            }
        }
    }
    sums
}

packed!(Radial<T> { curve, theta_max, r_max, inverse });

impl<T: Real> Packed for Inverse<T> {
    fn pack(&self, to: &mut Packer<'_>) {
        match self {
            Self::Newton => 0u8.pack(to),
            Self::Series { scale, used, terms } => {
                (*used as u8).pack(to);
                scale.pack(to);
                terms.iter().take(*used).for_each(|row| row.pack(to));
            }
        }
    }
    fn unpack(from: &mut Unpacker<'_>) -> Self {
        let used = usize::from(u8::unpack(from));
        if used == 0 {
            return Self::Newton;
        }
        from.require(used <= TERMS);
        let scale = T::unpack(from);
        let mut terms = [[T::ZERO; 3]; TERMS];
        terms.iter_mut().take(used).for_each(|row| *row = Packed::unpack(from));
        Self::Series { scale, used: used.min(TERMS), terms }
    }
}
