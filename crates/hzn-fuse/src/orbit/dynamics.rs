//! The motion of a satellite in ECEF: gravity to J4, the centrifugal and the Coriolis acceleration.
//!
//! The potential is (GM/r) [1 − Σ J_n (a/r)ⁿ P_n(z/r)] with the Legendre polynomials P₂ to P₄ (Vallado, Fundamentals of
//! Astrodynamics, section 8.6). It does not depend on the longitude, so that the motion needs no UTC. What it leaves
//! out is a noise of the acceleration.

use hzn_nav::gravity::EARTH_RATE_RAD_S;
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

/// Gravitational parameter of the Earth, m³/s² (WGS-84).
pub(super) const GM_M3_S2: f64 = 3.986_004_418e14;
/// Equatorial radius, m (WGS-84).
const A_M: f64 = 6_378_137.0;
/// Zonal harmonics J₂ to J₄ (EGM96).
const J: [f64; 3] = [1.082_626_68e-3, -2.532_66e-6, -1.619_62e-6];
/// Longest step of the integration, s: an error of some millimetres in low orbit.
const STEP_S: f64 = 20.0;
/// Steps of the derivatives: of the position (m) and of the velocity (m/s).
const DIFFERENCE: [f64; 2] = [10.0, 0.01];

/// Position (m) and velocity relative to the Earth (m/s), in ECEF.
pub(super) type Motion = Vector6<f64>;

/// Returns the acceleration relative to the Earth, m/s².
fn acceleration(motion: &Motion) -> Vector3<f64> {
    let (x, v): (Vector3<f64>, Vector3<f64>) = (motion.fixed_rows::<3>(0).into(), motion.fixed_rows::<3>(3).into());
    let r = x.norm();
    let (up, s) = (x / r, x.z / r);
    let polynomials = [
        (1.5 * s * s - 0.5, 3.0 * s),
        (2.5 * s.powi(3) - 1.5 * s, 7.5 * s * s - 1.5),
        ((35.0 * s.powi(4) - 30.0 * s * s + 3.0) / 8.0, (35.0 * s.powi(3) - 15.0 * s) / 2.0),
    ];
    let scale = GM_M3_S2 / (r * r);
    let mut sum = -up * scale;
    let mut ratio = A_M / r;
    for (number, (j, (p, slope))) in J.iter().zip(polynomials).enumerate() {
        ratio *= A_M / r;
        let n = number as f64 + 2.0;
        sum += (up * ((n + 1.0) * p + s * slope) - Vector3::z() * slope) * (scale * j * ratio);
    }
    let spin = Vector3::new(0.0, 0.0, EARTH_RATE_RAD_S);
    sum - spin.cross(&spin.cross(&x)) - spin.cross(&v) * 2.0
}

fn slope(motion: &Motion) -> Motion {
    let a = acceleration(motion);
    Motion::new(motion[3], motion[4], motion[5], a.x, a.y, a.z)
}

/// Returns the motion after a time, which may be negative.
pub(super) fn carried(motion: &Motion, time_s: f64) -> Motion {
    let steps = (time_s.abs() / STEP_S).ceil().clamp(1.0, 1e5);
    let h = time_s / steps;
    let mut at = *motion;
    for _ in 0..steps as usize {
        let k1 = slope(&at);
        let k2 = slope(&(at + k1 * (0.5 * h)));
        let k3 = slope(&(at + k2 * (0.5 * h)));
        let k4 = slope(&(at + k3 * h));
        at += (k1 + (k2 + k3) * 2.0 + k4) * (h / 6.0);
    }
    at
}

/// Returns the motion after a time, and its derivative by the motion before.
pub(super) fn carried_with_derivative(motion: &Motion, time_s: f64) -> (Motion, Matrix6<f64>) {
    let mut by = Matrix6::zeros();
    for i in 0..6 {
        let step = if i < 3 { DIFFERENCE[0] } else { DIFFERENCE[1] };
        let moved = |sign: f64| {
            let mut other = *motion;
            other[i] += sign * step;
            carried(&other, time_s)
        };
        by.set_column(i, &((moved(1.0) - moved(-1.0)) / (2.0 * step)));
    }
    (carried(motion, time_s), by)
}

/// Returns the covariance that a white acceleration (m/s²/√Hz) adds in a time.
pub(super) fn noise(time_s: f64, density: f64) -> Matrix6<f64> {
    let t = time_s.abs();
    let q = density * density;
    let mut out = Matrix6::zeros();
    let mut put = |i: usize, j: usize, value: f64| {
        out.fixed_view_mut::<3, 3>(i, j).copy_from(&(Matrix3::identity() * value));
    };
    put(0, 0, q * t.powi(3) / 3.0);
    put(0, 3, q * t * t / 2.0);
    put(3, 0, q * t * t / 2.0);
    put(3, 3, q * t);
    out
}
