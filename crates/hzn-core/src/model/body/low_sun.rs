//! A low Sun: little of its light reaches deep air, so that the edge of the limb rises.
//!
//! The line of sight that touches the Earth at a height h meets the optical depth x = x₀ e^(−h/H), with the scale
//! height H. The light that it scatters once, with the density e^(−s²/2) along it and the Sun to its side, is
//!
//! ∫ x φ(s) exp(−r x e^(−s²/2) − x Φ(s)) ds,
//!
//! where φ and Φ are the normal density and its integral, and r is the Sun's way through the air in units of the
//! line's. Where this light is half of its largest value, x is smaller than with a high Sun. The edge rises by H ln(1 +
//! 2.2 r) within 1 km (see the test); the band and the optical depth do not matter. With r = ½ on the horizon the edge
//! is 6 km higher, and with the Sun ahead 8 km. Light that is scattered several times reaches deep air and raises the
//! edge less; the simulator, which takes deep air as lit from above, has less than half.

use super::Expected;
use crate::base::real::Real;

/// Factor of r, see above.
const PER_WAY: f64 = 2.2;
/// Sine of the lowest elevation of the Sun at which the edge is seen, −3°: a limb then has an eighth of its light.
const LOWEST: f64 = -0.052_335_956_242_943_8;

impl<T: Real> Expected<T> {
    /// Returns how much higher the edge of the limb is than with the Sun at 45°, in metres, from the sine of the
    /// elevation of the Sun there; for light that is scattered once. 0 for a body without air.
    pub(crate) fn raised_by_low_sun_m(&self, sine: T) -> T {
        let (one, half) = (T::one(), T::from_f64(0.5));
        if !(self.scale_height_m > T::ZERO) {
            return T::ZERO;
        }
        // The Sun's way through the air on the horizon, and by day √(μ² + 1/g²)⁻¹ of it (book/theory/simulator.md).
        let g2 = T::from_f64(core::f64::consts::FRAC_PI_2) * self.radius_m / self.scale_height_m;
        let way = |sine: T| {
            let day = half / (one + g2 * sine * sine).sqrt();
            if sine < T::ZERO {
                (g2 * sine * sine * T::from_f64(core::f64::consts::FRAC_1_PI)).exp() - day
            } else {
                day
            }
        };
        let by_way = |sine: T| one + T::from_f64(PER_WAY) * way(sine);
        let usual = by_way(T::from_f64(core::f64::consts::FRAC_1_SQRT_2));
        self.scale_height_m * (by_way(sine.max(T::from_f64(LOWEST))) / usual).max(one).ln()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::body::{Config, Prior};

    /// Returns the optical depth of the line of sight that has half of the largest light, for light that is scattered
    /// once and the Sun's way `r`.
    fn half_depth(r: f64) -> f64 {
        let light = |x: f64| -> f64 {
            (-600..600).fold(0.0, |sum, i| {
                let s = (f64::from(i) + 0.5) * 0.01;
                let before = 0.5 * (1.0 + libm::erf(s / 2f64.sqrt()));
                sum + x * (-0.5 * s * s - r * x * (-0.5 * s * s).exp() - x * before).exp()
            })
        };
        let depths = (0..400).map(|i| 1e-2 * (f64::from(i) * 0.02).exp());
        let most = depths.clone().map(light).fold(0.0, f64::max);
        depths.clone().find(|x| light(*x) > 0.5 * most).unwrap()
    }

    #[test]
    fn light_that_is_scattered_once_raises_the_edge_by_this_law() {
        let prior = Prior { altitude_m: Some(400e3), ..Prior::default() };
        let expected = Expected::<f64>::new(&Config::default(), &prior).unwrap();
        let high = half_depth(0.0);
        // The Sun's way at these elevations by Chapman's function, which the law approximates.
        for (deg, way) in [(10.0, 0.076), (4.0, 0.166), (2.0, 0.259), (0.0, 0.5), (-1.0, 0.791), (-2.0, 1.421)] {
            let km = 7.5 * (high / half_depth(way)).ln();
            let law = expected.raised_by_low_sun_m(f64::sin(f64::to_radians(deg))) * 1e-3;
            // The Sun at 45° raises the edge by 0.3 km.
            assert!((law + 0.3 - km).abs() < 1.0, "{deg}: {law} {km}");
        }
        let at = |deg: f64| expected.raised_by_low_sun_m(deg.to_radians().sin());
        assert_eq!([at(45.0), at(90.0)], [0.0, 0.0]);
        assert_eq!(at(-3.0), at(-40.0));
        assert_eq!(Expected { scale_height_m: 0.0, ..expected }.raised_by_low_sun_m(0.0), 0.0);
    }
}
