//! Gravity in ECEF: WGS-84 to J2, with the centrifugal term, because the frame turns with the Earth.
//!
//! J4 and higher terms are left out. They are up to 10⁻⁴ m/s², and the accelerometers of the defaults have a bias of
//! 0.02 m/s².

use nalgebra::{Matrix3, Vector3};

use crate::frames::{Fixed, Vector};

/// Rate of rotation of the Earth, rad/s (WGS-84).
pub const EARTH_RATE_RAD_S: f64 = 7.292115e-5;
/// Gravitational parameter of the Earth, m³/s² (WGS-84).
const GM_M3_S2: f64 = 3.986_004_418e14;
/// Second zonal harmonic (WGS-84).
const J2: f64 = 1.082_629_821_3e-3;
/// Equatorial radius, m (WGS-84).
const A_M: f64 = 6_378_137.0;

/// Returns the rate of rotation of the Earth as a vector in ECEF, rad/s.
pub fn earth_rate() -> Vector<Fixed> {
    Vector::new(0.0, 0.0, EARTH_RATE_RAD_S)
}

/// Returns gravity with the centrifugal acceleration at a position in ECEF (m), in m/s². The result is the zero vector
/// at the centre of the Earth.
pub fn gravity(position_m: &Vector<Fixed>) -> Vector<Fixed> {
    let position_m = position_m.as_inner();
    let r2 = position_m.norm_squared();
    // The comparison is negated, so that NaN takes this way too.
    if !(r2 > 0.0) {
        return Vector::zeros();
    }
    let r = libm::sqrt(r2);
    let flat = 1.5 * J2 * A_M * A_M / r2;
    let z2 = 5.0 * position_m.z * position_m.z / r2;
    let scale = -GM_M3_S2 / (r2 * r);
    let across = scale * (1.0 + flat * (1.0 - z2));
    let along = scale * (1.0 + flat * (3.0 - z2));
    let spin = EARTH_RATE_RAD_S * EARTH_RATE_RAD_S;
    Vector::new((across + spin) * position_m.x, (across + spin) * position_m.y, along * position_m.z)
}

/// Returns the derivative of [`gravity`] by the position, in 1/s²; rows and columns are in ECEF. It neglects J2, which
/// is 0.1 % of it: it moves only the covariance, and not the state.
pub fn gradient(position_m: &Vector<Fixed>) -> Matrix3<f64> {
    let position_m = position_m.as_inner();
    let r2 = position_m.norm_squared();
    if !(r2 > 0.0) {
        return Matrix3::zeros();
    }
    let spin = EARTH_RATE_RAD_S * EARTH_RATE_RAD_S;
    let radial = position_m * position_m.transpose() * (3.0 / r2) - Matrix3::identity();
    radial * (GM_M3_S2 / (r2 * libm::sqrt(r2))) + Matrix3::from_diagonal(&Vector3::new(spin, spin, 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_gravity_at_equator_and_pole() {
        // Normal gravity of WGS-84 is 9.7803253359 m/s² at the equator and 9.8321849378 m/s² at the pole. J4 and higher
        // terms, which are missing here, are up to 1e-4 m/s².
        let equator = gravity(&Vector::new(A_M, 0.0, 0.0)).xyz();
        assert!((equator[0] + 9.780_325_335_9).abs() < 6e-5 && equator[1] == 0.0, "{equator:?}");
        let pole = gravity(&Vector::new(0.0, 0.0, 6_356_752.314_2)).xyz();
        assert!((pole[2] + 9.832_184_937_8).abs() < 1.2e-4, "{pole:?}");
        assert_eq!(gravity(&Vector::zeros()), Vector::zeros());
    }

    #[test]
    fn gradient_is_the_derivative() {
        let at = Vector::new(4.2e6, -2.1e6, 4.9e6);
        let derivative = gradient(&at);
        for i in 0..3 {
            let mut step = Vector3::zeros();
            step[i] = 10.0;
            let step = Vector::from(step);
            let numeric = (gravity(&(at + step)) - gravity(&(at - step))) / 20.0;
            assert!((numeric.into_inner() - derivative.column(i)).norm() < 4e-3 * derivative.norm(), "{i}");
        }
    }
}
