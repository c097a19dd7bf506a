//! The difference between a flattened body and a sphere, for a camera with a known height but an unknown position.
//!
//! A plane that touches the ellipsoid, with its normal at latitude φ', lies R − k P₂(sin φ') from the centre to first
//! order in the flattening f, with k = ⅔ a f. For a camera at latitude φ, the normals of the planes that touch the
//! ellipsoid at the limb lie on a circle about the nadir. By the addition theorem, the mean of P₂(sin φ') along the
//! circle is P₂(sin φ) P₂(s), with s = sin α. The second harmonic in azimuth is ¾ cos²φ cos²α. The first harmonic is a
//! tilt of the axis, which the limb axis already includes. Therefore:
//!
//! - the sphere with this half-angle at this height above the ellipsoid has the radius R + k P₂(sin φ) (3 s + 1)/2,
//! - the limb is uneven by a second harmonic of height with the amplitude ¾ k cos²φ cos²α.
//!
//! The result depends on the distribution of latitudes. A polar orbit spends equal times at all latitudes, which gives
//! the largest uncertainty of the radius (RMS of P₂ 0.586, compared with 0.447 for places evenly distributed over the
//! globe). Places evenly distributed over the globe lie nearer to the equator, which gives the largest uncertainty of
//! the second harmonic (RMS of cos²φ 0.730, compared with 0.612).

use crate::base::real::Real;
use crate::geometry::ellipsoid::{WGS84_A_M, WGS84_B_M};

/// k of the Earth in metres.
pub(super) const EARTH_K_M: f64 = (WGS84_A_M - WGS84_B_M) * 2.0 / 3.0;
/// RMS of P₂(sin φ) over evenly distributed latitudes: √(11/32).
// The distribution of the polar orbit is used because it gives the larger radius error; a smaller sigma would be wrong
// for a sensor that flies there.
const RADIUS_RMS: f64 = 0.586_301_969_977_929_6;
/// RMS of cos²φ over the globe: √(8/15).
// Here the globe gives the larger value, for the same reason.
const SECOND_RMS: f64 = 0.730_296_743_340_221_5;

/// Returns the 1-sigma of the radius of the equivalent sphere (with the same half-angle) about the mean radius, metres:
/// 16.7 km at low altitude, 6 km far away.
pub(super) fn radius_sigma_m<T: Real>(sin: T, k_m: f64) -> T {
    (T::from_f64(3.0) * sin + T::one()) * T::from_f64(0.5 * k_m * RADIUS_RMS)
}

/// Returns the 1-sigma amplitude of the second harmonic of the limb's height in azimuth, metres: 0.15 km at 60 km,
/// 1.3 km at 600 km.
pub(super) fn second_harmonic_m<T: Real>(sin: T, k_m: f64) -> T {
    (T::one() - sin * sin) * T::from_f64(0.75 * k_m * SECOND_RMS)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::ellipsoid::{EARTH_MEAN_RADIUS_M, LimbCone};
    use std::vec::Vec;

    /// Returns the radius of the equivalent sphere, and the amplitude of the second harmonic, from the exact cone.
    fn exact(latitude_deg: f64, altitude_m: f64) -> (f64, f64) {
        let (s, c) = libm::sincos(latitude_deg.to_radians());
        let e2 = 1.0 - (WGS84_B_M / WGS84_A_M) * (WGS84_B_M / WGS84_A_M);
        let n = WGS84_A_M / libm::sqrt(1.0 - e2 * s * s);
        let position = [(n + altitude_m) * c, 0.0, (n * (1.0 - e2) + altitude_m) * s];
        let cone = LimbCone::<f64>::try_new(position, WGS84_A_M, WGS84_B_M).unwrap();
        let sin = libm::sin(cone.mean_half_angle_rad());
        let (east, meridian) = cone.half_angles_rad();
        let distance = EARTH_MEAN_RADIUS_M + altitude_m;
        (sin * altitude_m / (1.0 - sin), (libm::sin(east) - libm::sin(meridian)).abs() * 0.5 * distance)
    }

    #[test]
    fn sigmas_are_those_of_the_exact_cone() {
        for (km, radius_km, second_km) in
            [(60.0, 16.6, 0.15), (200.0, 16.3, 0.47), (600.0, 15.5, 1.27), (2000.0, 13.7, 3.3), (35786.0, 6.1, 7.6)]
        {
            let altitude = km * 1e3;
            let sin = EARTH_MEAN_RADIUS_M / (EARTH_MEAN_RADIUS_M + altitude);
            let latitudes: Vec<f64> = (0..90).map(|i| f64::from(i) + 0.5).collect();
            let mean_square = |f: &dyn Fn(f64) -> f64, weight: &dyn Fn(f64) -> f64| {
                let total: f64 = latitudes.iter().map(|&l| weight(l)).sum();
                libm::sqrt(latitudes.iter().map(|&l| f(l) * f(l) * weight(l)).sum::<f64>() / total)
            };
            let radius = mean_square(&|l| exact(l, altitude).0 - EARTH_MEAN_RADIUS_M, &|_| 1.0);
            let second = mean_square(&|l| exact(l, altitude).1, &|l| libm::cos(l.to_radians()));
            for (got, want, rounded) in [
                (radius_sigma_m(sin, EARTH_K_M), radius, radius_km),
                (second_harmonic_m(sin, EARTH_K_M), second, second_km),
            ] {
                assert!((got / want - 1.0).abs() < 0.03, "{km} km: {got} {want}");
                assert!((got * 1e-3 / rounded - 1.0).abs() < 0.06, "{km} km: {got} {rounded}");
            }
        }
    }
}
