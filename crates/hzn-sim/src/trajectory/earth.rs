//! The rotating Earth: its rate, its gravity, and the conversion between inertial axes and ECEF.

use nalgebra::Vector3;

/// Gravitational parameter of the Earth, m³/s² (WGS-84).
pub(super) const MU: f64 = 3.986_004_418e14;
/// Rotation rate of the Earth, rad/s (WGS-84).
pub(super) const EARTH_RATE: f64 = 7.292_115e-5;

/// Converts a vector from inertial axes to ECEF, by Greenwich sidereal time.
pub(super) fn to_ecef(sidereal_rad: f64, v: &Vector3<f64>) -> Vector3<f64> {
    let (s, c) = libm::sincos(sidereal_rad);
    Vector3::new(c * v.x + s * v.y, c * v.y - s * v.x, v.z)
}

/// Converts a vector from ECEF to inertial axes; the inverse of [`to_ecef`].
pub(super) fn from_ecef(sidereal_rad: f64, v: &Vector3<f64>) -> Vector3<f64> {
    to_ecef(-sidereal_rad, v)
}

/// Returns the gravitational acceleration in m/s², from the central field and the Earth's flattening (J2). The
/// centrifugal acceleration is not included.
pub(super) fn gravity(position_m: &Vector3<f64>) -> Vector3<f64> {
    const J2: f64 = 1.082_629_8e-3;
    const A: f64 = hzn_core::ellipsoid::WGS84_A_M;
    let r2 = position_m.norm_squared();
    let r = r2.sqrt();
    let z2 = position_m.z * position_m.z / r2;
    let k = 1.5 * J2 * (A * A) / r2;
    let side = 1.0 + k * (1.0 - 5.0 * z2);
    let pole = 1.0 + k * (3.0 - 5.0 * z2);
    -MU / (r2 * r) * Vector3::new(side * position_m.x, side * position_m.y, pole * position_m.z)
}
