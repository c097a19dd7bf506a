//! The weather along the limb of a thermal band.
//!
//! Clouds, water vapour and temperature change the height of such a limb from place to place, with the correlation
//! exp(−d²/2L²) at the distance d. Along a limb of the radius ρ, this is a random harmonic of each degree k whose
//! cosine and sine have the variance 2 σ² exp(−κ) I_k(κ), κ = (ρ/L)². The degree 0 is a part of the limb height.
//! The degrees above two count: they bend a short arc more than the first two, and the fit takes a bend for another
//! half-angle. No residual shows it.

use super::part::part;
use super::sandwich::response;
use crate::base::linalg::{M3, V3};
use crate::base::real::Real;
use crate::geometry::block::Block;
use crate::model::body::{Expected, weather_kappa};
use crate::stages::fit::Fit;

/// Highest degree.
// From 600 km of altitude κ is 6.8, and the degree 12 has 2·10⁻⁵ of the variance of the first one. Farther away more
// degrees have a part, but more of the limb is in view, so that each of them counts less.
const DEGREES: usize = 12;

/// Returns the covariance of (δ₁₂, δc) from the weather; `None` if the points do not determine the cone.
// A function of its own: its sums must not lie on the stack together with those of the other terms.
#[inline(never)]
pub(super) fn covariance<T: Real>(blocks: &[Block<T>], fit: &Fit<T>, expected: &Expected<T>) -> Option<M3<T>> {
    let mut normal = [T::ZERO; 6];
    let mut harmonics = [[V3::zeros(); 2]; DEGREES];
    part(blocks, fit).for_each(|row| {
        row.add_to(&mut normal);
        let [c, s] = row.azimuth();
        let (mut cos, mut sin) = (c, s);
        for [by_cos, by_sin] in &mut harmonics {
            *by_cos += row.h() * cos;
            *by_sin += row.h() * sin;
            (cos, sin) = (cos * c - sin * s, sin * c + cos * s);
        }
    });
    // The part of the points has its own normal equations, as for the other terms.
    let response = response(&fit.sums.with_normal(normal), fit.mean, fit.free)?;
    let mut sum = M3::zeros();
    for (variance, pair) in variances(expected).zip(&harmonics) {
        for by in pair {
            let error = response * by;
            sum += error * error.transpose() * variance;
        }
    }
    Some(sum)
}

/// Returns the variance of cos α for the cosine and for the sine of each degree.
///
/// exp(−κ) I_k(κ) is close to exp(−k²/2κ)/√(2πκ): within a tenth from κ = 1.3 on, which is 120 km of altitude, and too
/// large below.
fn variances<T: Real>(expected: &Expected<T>) -> impl Iterator<Item = T> {
    let kappa = weather_kappa((expected.radius_m + expected.limb_m) * expected.cos);
    let sigma_cos = expected.weather_m * expected.cos_per_m();
    let all = sigma_cos * sigma_cos * T::from_f64(2.0) / (kappa * T::from_f64(core::f64::consts::TAU)).sqrt();
    (1..=DEGREES as i32).map(move |k| all * (-T::from_i32(k * k) / (kappa + kappa)).exp())
}

#[cfg(test)]
mod tests {
    use super::variances;
    use crate::model::body::{Config, Expected, Limb, Prior, weather_kappa};

    /// The harmonics have the correlation of the weather, from a low orbit to a high one.
    #[test]
    fn the_degrees_sum_up_to_the_correlation() {
        let mut body = Config { limb: Limb::Window, ..Config::default() };
        body.follow_band();
        for (altitude_km, off) in [(120.0, 0.08), (600.0, 0.02), (2000.0, 0.02)] {
            let prior = Prior { altitude_m: Some(altitude_km * 1e3), ..Prior::default() };
            let expected = Expected::<f64>::new(&body, &prior).unwrap();
            let kappa = weather_kappa((expected.radius_m + expected.limb_m) * expected.cos);
            let sigma_cos = expected.weather_m * expected.cos_per_m();
            // The degree 0, by the same formula.
            let mean = 1.0 / (kappa * core::f64::consts::TAU).sqrt();
            for azimuth in [0.0, 0.2, 0.7, 1.5, 3.0_f64] {
                let sum: f64 = (1..).zip(variances(&expected)).map(|(k, v)| v * (f64::from(k) * azimuth).cos()).sum();
                let found = mean + sum / (sigma_cos * sigma_cos);
                let want = (-kappa * (1.0 - azimuth.cos())).exp();
                assert!((found - want).abs() < off, "{altitude_km} km, {azimuth} rad: {found}, {want}");
            }
        }
    }
}
