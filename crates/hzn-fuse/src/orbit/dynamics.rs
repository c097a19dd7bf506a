//! The motion of a satellite in ECEF: gravity to J4, drag, the centrifugal and the Coriolis acceleration.
//!
//! The potential is (GM/r) [1 − Σ J_n (a/r)ⁿ P_n(z/r)] with the Legendre polynomials P₂ to P₄ (Vallado, Fundamentals of
//! Astrodynamics, section 8.6). It does not depend on the longitude, so that the motion needs no UTC. What it leaves
//! out is a noise of the acceleration. The air turns with the Earth, and its density is that of a mean Sun.

use hzn_nav::gravity::EARTH_RATE_RAD_S;
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

/// Gravitational parameter of the Earth, m³/s² (WGS-84).
pub(super) const GM_M3_S2: f64 = 3.986_004_418e14;
/// Equatorial radius, m (WGS-84).
const A_M: f64 = 6_378_137.0;
/// Flattening of the ellipsoid (WGS-84).
const FLATTENING: f64 = 1.0 / 298.257_223_563;
/// Zonal harmonics J₂ to J₄ (EGM96).
const J: [f64; 3] = [1.082_626_68e-3, -2.532_66e-6, -1.619_62e-6];
/// Height above the ellipsoid (km), density (kg/m³) and scale height (km) of the air (Vallado, Fundamentals of
/// Astrodynamics, table 8-4: CIRA-72 for exospheric temperatures of 1000 K).
const AIR: [[f64; 3]; 20] = [
    [100.0, 5.297e-7, 5.877],
    [110.0, 9.661e-8, 7.263],
    [120.0, 2.438e-8, 9.473],
    [130.0, 8.484e-9, 12.636],
    [140.0, 3.845e-9, 16.149],
    [150.0, 2.070e-9, 22.523],
    [180.0, 5.464e-10, 29.740],
    [200.0, 2.789e-10, 37.105],
    [250.0, 7.248e-11, 45.546],
    [300.0, 2.418e-11, 53.628],
    [350.0, 9.518e-12, 53.298],
    [400.0, 3.725e-12, 58.515],
    [450.0, 1.585e-12, 60.828],
    [500.0, 6.967e-13, 63.822],
    [600.0, 1.454e-13, 71.835],
    [700.0, 3.614e-14, 88.667],
    [800.0, 1.170e-14, 124.64],
    [900.0, 5.245e-15, 181.05],
    [1000.0, 3.019e-15, 268.00],
    [1e9, 0.0, 1.0],
];
/// Relative step of the derivative by the drag.
const DRAG_STEP: f64 = 0.1;
/// Longest step of the integration, s: an error of some millimetres in low orbit.
const STEP_S: f64 = 20.0;
/// Steps of the derivatives: of the position (m) and of the velocity (m/s).
const DIFFERENCE: [f64; 2] = [10.0, 0.01];

/// Position (m) and velocity relative to the Earth (m/s), in ECEF.
pub(super) type Motion = Vector6<f64>;

/// Returns the density of the air, kg/m³.
fn density_kg_m3(position_m: &Vector3<f64>) -> f64 {
    let r = position_m.norm();
    let ground_m = A_M * (1.0 - FLATTENING * (position_m.z / r).powi(2));
    let height_km = ((r - ground_m) * 1e-3).max(AIR[0][0]);
    let above = AIR.partition_point(|row| row[0] <= height_km).max(1);
    let [base_km, density, scale_km] = AIR[above - 1];
    density * ((base_km - height_km) / scale_km).exp()
}

/// Returns the acceleration relative to the Earth, m/s², with drag area and mass as the ballistic coefficient, m²/kg.
fn acceleration(motion: &Motion, ballistic_m2_kg: f64) -> Vector3<f64> {
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
    if ballistic_m2_kg != 0.0 {
        sum -= v * (0.5 * density_kg_m3(&x) * ballistic_m2_kg * v.norm());
    }
    sum - spin.cross(&spin.cross(&x)) - spin.cross(&v) * 2.0
}

fn slope(motion: &Motion, ballistic_m2_kg: f64) -> Motion {
    let a = acceleration(motion, ballistic_m2_kg);
    Motion::new(motion[3], motion[4], motion[5], a.x, a.y, a.z)
}

/// Returns the motion after a time, which may be negative.
pub(super) fn carried(motion: &Motion, time_s: f64, ballistic_m2_kg: f64) -> Motion {
    let steps = (time_s.abs() / STEP_S).ceil().clamp(1.0, 1e5);
    let h = time_s / steps;
    let mut at = *motion;
    for _ in 0..steps as usize {
        let slope = |motion: &Motion| slope(motion, ballistic_m2_kg);
        let k1 = slope(&at);
        let k2 = slope(&(at + k1 * (0.5 * h)));
        let k3 = slope(&(at + k2 * (0.5 * h)));
        let k4 = slope(&(at + k3 * h));
        at += (k1 + (k2 + k3) * 2.0 + k4) * (h / 6.0);
    }
    at
}

/// A motion after a time, with its derivatives.
pub(super) struct Carried {
    pub(super) motion: Motion,
    /// By the motion before.
    pub(super) by: Matrix6<f64>,
    /// By the relative change of the drag.
    pub(super) by_drag: Vector6<f64>,
}

impl Carried {
    /// Returns a motion that is not carried yet.
    pub(super) fn at_rest(motion: &Motion) -> Self {
        Self { motion: *motion, by: Matrix6::identity(), by_drag: Vector6::zeros() }
    }

    /// Returns the motion after a further time, with the derivatives by the motion and the drag of the beginning.
    pub(super) fn further(&self, time_s: f64, ballistic_m2_kg: f64) -> Self {
        let next = carried_with_derivative(&self.motion, time_s, ballistic_m2_kg);
        Self { by_drag: next.by * self.by_drag + next.by_drag, by: next.by * self.by, ..next }
    }
}

/// Returns the motion after a time, and its derivatives.
pub(super) fn carried_with_derivative(motion: &Motion, time_s: f64, ballistic_m2_kg: f64) -> Carried {
    let mut by = Matrix6::zeros();
    for i in 0..6 {
        let step = if i < 3 { DIFFERENCE[0] } else { DIFFERENCE[1] };
        let moved = |sign: f64| {
            let mut other = *motion;
            other[i] += sign * step;
            carried(&other, time_s, ballistic_m2_kg)
        };
        by.set_column(i, &((moved(1.0) - moved(-1.0)) / (2.0 * step)));
    }
    let with = |part: f64| carried(motion, time_s, ballistic_m2_kg * part);
    let by_drag = if ballistic_m2_kg == 0.0 {
        Vector6::zeros()
    } else {
        (with(1.0 + DRAG_STEP) - with(1.0 - DRAG_STEP)) / (2.0 * DRAG_STEP)
    };
    Carried { motion: with(1.0), by, by_drag }
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
