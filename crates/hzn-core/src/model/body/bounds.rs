//! The expected half-angle far from its mean, where cos α is no linear function of altitude and limb height.
//!
//! With the radius R, the limb height d and the altitude H, sin α = (R + d)/(R + H). A limb at the surface of which the
//! camera may stand has no largest half-angle; far from the body, cos α saturates at 1. A sigma of cos α alone would
//! allow every small disc and refuse a large one.

use crate::base::real::Real;

use super::Expected;

/// Largest relative difference between σ of cos α and the exact change of cos α over one sigma for which the prior
/// counts as linear.
// With the relative difference ε, the second-order term at z sigmas is ε z² σ. Its mean square is 3 ε² σ², 3 % of the
// variance for ε = 0.1, so that a covariance cannot show it.
const LINEAR: f64 = 0.1;
/// Number of halvings that find the best half-angle between two values.
// The interval that remains, 6e-8 of the first one, is the rounding of single precision.
const HALVINGS: usize = 24;

/// The half-angle after the exact prior was fused.
pub(crate) struct Updated<T> {
    /// Change of the fitted cos α, as a part of its variance.
    pub(crate) moved: T,
    /// 1/(P₃₃ + σ²), with the sigma of the prior at the fused cos α.
    pub(crate) weight: T,
    /// Sigma of the prior at the fused cos α, multiplied by `weight`.
    pub(crate) sigma_weight: T,
}

impl<T: Real> Expected<T> {
    /// Returns the change of cos α where altitude and limb height are together `sigmas` 1-sigmas from the expected
    /// ones; positive sigmas make the cone narrower. `None` if the limb would enclose the camera.
    ///
    /// Of all pairs of altitude and limb height, the likeliest one counts: its errors are in proportion to their
    /// shares of the variance.
    fn cos_change(&self, sigmas: T) -> Option<T> {
        let total2 = self.limb_sigma_parts_m.iter().fold(T::ZERO, |sum, s| sum + *s * *s);
        if !(total2 > T::ZERO) {
            return Some(T::ZERO);
        }
        let per_total = sigmas / total2.sqrt();
        let altitude = self.limb_sigma_parts_m[1];
        // The part of the altitude is its sigma times sin α.
        let higher_m = altitude * altitude / self.sin * per_total;
        let lower_limb_m = (total2 - altitude * altitude) * per_total;
        let distance = self.distance_m() + higher_m;
        // A difference of the sines and not of the cosines, so that a small disc keeps its digits in single precision.
        let by_sin = (self.sin * higher_m + lower_limb_m) / distance;
        let sin = (self.sin - by_sin).max(T::ZERO);
        if !(distance > T::ZERO && sin < T::one()) {
            return None;
        }
        let cos = (T::one() - sin * sin).sqrt();
        Some((self.sin - sin) * (self.sin + sin) / (cos + self.cos))
    }

    /// Returns the expected altitude and its 1-sigma, metres.
    pub(crate) fn altitude_and_sigma_m(&self) -> (T, T) {
        (self.distance_m() - self.radius_m, self.limb_sigma_parts_m[1] / self.sin)
    }

    /// Returns R + H in metres.
    fn distance_m(&self) -> T {
        (self.radius_m + self.limb_m) / self.sin
    }

    /// Returns whether the sizes of a body are given by [`Self::limb_sigma_parts_m`]. Without a known distance they say
    /// nothing.
    fn has_bounds(&self) -> bool {
        self.target().is_none_or(|target| target.range.is_some())
    }

    /// Returns the variance of the expected cos α for a cone of cosine `cos`, of which the gates allow `sigmas`: the
    /// exact change of cos α over these sigmas, divided by their number. `None` if there is no limit on that side.
    pub(crate) fn variance_towards(&self, cos: T, sigmas: T) -> Option<T> {
        if !self.has_bounds() {
            return Some(self.sigma_cos * self.sigma_cos);
        }
        let change = self.cos_change(if cos >= self.cos { sigmas } else { -sigmas })?;
        let sigma = change / sigmas;
        Some(sigma * sigma)
    }

    /// Returns whether the exact change of cos α over one sigma differs from its sigma so much that the prior must not
    /// be used as a linear one.
    pub(super) fn bends(&self) -> bool {
        let limit = self.sigma_cos * T::from_f64(LINEAR);
        let is_linear =
            |sigmas: T| self.cos_change(sigmas).is_some_and(|change| (change.abs() - self.sigma_cos).abs() <= limit);
        self.has_bounds() && !self.free && !(is_linear(T::one()) && is_linear(-T::one()))
    }

    /// Returns the variance of cos α for a half-angle that is not fitted: the larger one of both sides at one sigma.
    pub(crate) fn fixed_variance(&self) -> T {
        if !self.is_curved {
            return self.sigma_cos * self.sigma_cos;
        }
        // Without a limit the half-angle may be anything up to 90°.
        let change = |sigmas: T| self.cos_change(sigmas).map_or(self.cos, T::abs);
        let widest = change(T::one()).max(change(-T::one()));
        widest * widest
    }

    /// Returns how many sigmas altitude and limb height are from the expected ones where the limb has the cosine `cos`,
    /// and the derivative of this number by the cosine.
    ///
    /// z = (L/sin α − D)/σ with L = R + d, D = R + H and σ² = σ_H² + σ_d²/sin²α.
    fn sigmas_at(&self, cos: T) -> (T, T) {
        let sin2 = (T::one() - cos * cos).max(T::EPSILON);
        let sin = sin2.sqrt();
        let square = |i: usize| self.limb_sigma_parts_m[i & 3] * self.limb_sigma_parts_m[i & 3];
        let limb2 = square(0) + square(2) + square(3);
        let variance = square(1) / (self.sin * self.sin) + limb2 / sin2;
        let per = T::one() / variance.max(T::from_f64(1e-20)).sqrt();
        let limb = self.radius_m + self.limb_m;
        let z = limb * (self.sin - sin) / (sin * self.sin) * per;
        let slope = limb * per / sin - z * limb2 * per * per / sin2;
        (z, slope * cos / sin2)
    }

    /// Returns the expected half-angle as a measurement of cos α near `cos`: the difference to it, and 1/σ² as a factor
    /// of a unit weight. A cone that encloses the camera has none.
    pub(crate) fn linear_near(&self, cos: T) -> (T, T) {
        let (z, slope) = self.sigmas_at(cos);
        if !(cos > T::ZERO && slope > T::ZERO) {
            return (T::ZERO, T::ZERO);
        }
        (-z / slope, slope * slope)
    }

    /// Fuses the fitted cos α of the variance `var_cos` with the exact prior. `None` if the linear prior is right.
    ///
    /// The result minimises (c − ĉ)²/P₃₃ + z(c)². It lies between ĉ and c₀, because outside of them both terms grow in
    /// the same direction. Halving cannot diverge there as Newton's steps do.
    pub(crate) fn update(&self, fitted_cos: T, var_cos: T) -> Option<Updated<T>> {
        if !(self.is_curved && var_cos > T::ZERO) {
            return None;
        }
        let (most, half) = (T::one() - T::EPSILON, T::from_f64(0.5));
        let fitted = fitted_cos.max(T::ZERO).min(most);
        let (mut low, mut high) = (fitted.min(self.cos), fitted.max(self.cos));
        for _ in 0..HALVINGS {
            let cos = (low + high) * half;
            let (z, slope) = self.sigmas_at(cos);
            if (cos - fitted_cos) + var_cos * z * slope > T::ZERO { high = cos } else { low = cos }
        }
        let cos = (low + high) * half;
        let (_, slope) = self.sigmas_at(cos);
        let per = T::one() / (T::one() + var_cos * slope * slope);
        Some(Updated { moved: (cos - fitted_cos) / var_cos, weight: slope * slope * per, sigma_weight: slope * per })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::body::{Config, Kind, Prior};

    /// Expects a Moon of 1737.4 km at an altitude with its sigma, km.
    fn moon<T: Real>(altitude_km: f64, sigma_km: f64, limb_sigma_km: f64) -> Expected<T> {
        let body = Config {
            kind: Kind::Sphere,
            radius_km: Some(1737.4),
            altitude_sigma_km: sigma_km,
            limb_height_km: 0.0,
            limb_height_sigma_km: limb_sigma_km,
            ..Config::default()
        };
        Expected::new(&body, &Prior { altitude_m: Some(T::from_f64(altitude_km * 1e3)), ..Prior::default() }).unwrap()
    }

    fn cos_at(altitude_km: f64) -> f64 {
        let sin = 1737.4 / (1737.4 + altitude_km);
        (1.0 - sin * sin).sqrt()
    }

    #[test]
    fn the_bounds_are_the_half_angles_at_the_altitudes_of_both_bounds() {
        let expected = moon::<f64>(6000.0, 1500.0, 0.0);
        for (sigmas, altitude) in [(3.0, 10_500.0), (1.0, 7500.0), (-1.0, 4500.0), (-3.0, 1500.0)] {
            let change = expected.cos_change(sigmas).unwrap();
            assert!((expected.cos + change - cos_at(altitude)).abs() < 1e-12, "{altitude} km");
            let variance = expected.variance_towards(cos_at(altitude), sigmas.abs()).unwrap();
            assert!((variance.sqrt() * sigmas.abs() - change.abs()).abs() < 1e-12);
        }
        // 5 sigmas lower, the camera would stand below the surface.
        assert!(expected.cos_change(-5.0).is_none());
        assert!(expected.variance_towards(0.1, 5.0).is_none());
        // Only the limb height is uncertain.
        let by_limb = moon::<f64>(6000.0, 0.0, 100.0);
        let sin: f64 = 1437.4 / 7737.4;
        assert!((by_limb.cos + by_limb.cos_change(3.0).unwrap() - (1.0 - sin * sin).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn a_small_sigma_has_the_linear_bounds_in_both_precisions() {
        for altitude in [100.0, 6000.0, 400_000.0] {
            let double = moon::<f64>(altitude, altitude * 1e-3, 0.01);
            let single = moon::<f32>(altitude, altitude * 1e-3, 0.01);
            assert!(!double.is_curved && !single.is_curved);
            for sigmas in [-3.0, 3.0] {
                let of = |change: f64, sigma: f64| (change / (sigma * sigmas) - 1.0).abs();
                assert!(of(double.cos_change(sigmas).unwrap(), double.sigma_cos) < 0.02, "{altitude} km");
                let change = single.cos_change(sigmas as f32).unwrap();
                assert!(of(f64::from(change), f64::from(single.sigma_cos)) < 0.02, "{altitude} km");
            }
        }
    }

    #[test]
    fn the_fused_half_angle_is_the_most_probable_one() {
        let expected = moon::<f64>(6000.0, 5000.0, 2.0);
        assert!(expected.is_curved);
        for (fitted, sigma) in [(cos_at(1424.0), 0.001), (cos_at(1424.0), 0.1), (0.999, 0.002), (0.1, 0.05)] {
            let updated = expected.update(fitted, sigma * sigma).unwrap();
            let cost = |c: f64| {
                let z = (1737.4 / (1.0 - c * c).sqrt() - 7737.4) / libm::hypot(5000.0, 2.0 / (1.0 - c * c).sqrt());
                ((c - fitted) / sigma).powi(2) + z * z
            };
            let best = (1..100_000).map(|i| f64::from(i) * 1e-5).min_by(|a, b| cost(*a).total_cmp(&cost(*b))).unwrap();
            let fused = fitted + updated.moved * sigma * sigma;
            assert!((fused - best).abs() < 2e-5, "{fitted} ± {sigma}: {fused} instead of {best}");
        }
        // An exact edge hardly moves, and a single-precision sensor agrees.
        let updated = moon::<f32>(6000.0, 5000.0, 2.0).update(cos_at(1424.0) as f32, 1e-6).unwrap();
        assert!((updated.moved * 1e-6).abs() < 1e-5);
    }
}
