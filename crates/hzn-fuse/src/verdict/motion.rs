//! What inertial unit and receiver say about the motion, at any time.

use std::sync::Arc;

use hzn_nav::frames::{Fixed, Rotation, Vector, Vehicle};
use hzn_nav::gravity::{earth_rate, gravity};
use hzn_nav::strapdown::turn;
use nalgebra::{Matrix3, Vector3};

use crate::input::{Fix, Sample};
use crate::start::AtFirst;

/// Longest time between two fixes that are interpolated, s.
pub(super) const FIX_STEP_S: f64 = 5.0;

/// The unit's integrals from its first sample to a time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Integrals {
    pub(super) time_s: f64,
    /// The attitude.
    pub(super) attitude: Rotation<Vehicle, AtFirst>,
    /// ∫ f: the change of the velocity without gravity, m/s.
    pub(super) velocity_m_s: Vector<AtFirst>,
    /// ∫ |f|: the same for a push along one axis of the vehicle, whatever the gyros say, m/s.
    pub(super) pushed_m_s: f64,
    /// ∫ Q: a bias of the gyros turns the attitude by minus its product with this, s.
    pub(super) by_bias: Matrix3<f64>,
    /// ∫ Q diag(ω): the same for errors of the scale, rad.
    pub(super) by_scale: Matrix3<f64>,
    /// ∫ |ω|: how far the vehicle has turned, rad.
    pub(super) turned_rad: f64,
    /// The time for which nobody knows the rate: gaps and saturation, s.
    pub(super) unknown_s: f64,
    /// The rate, rad/s.
    pub(super) rate_rad_s: Vector<Vehicle>,
}

/// The integrals at all samples. Copies share them, because each suspicion has one.
#[derive(Debug, Clone)]
pub(super) struct Reckoning {
    steps: Arc<[Integrals]>,
}

impl Reckoning {
    /// Integrates the samples; `gyro` multiplies the rates, for suspicions about their axes and units.
    pub(super) fn new(samples: &[Sample], max_step_s: f64, gyro: &Matrix3<f64>) -> Self {
        let mut steps: Vec<Integrals> = Vec::with_capacity(samples.len());
        for (i, sample) in samples.iter().enumerate() {
            let rate: Vector<Vehicle> = (gyro * sample.imu.gyro_rad_s.as_inner()).into();
            let before = i.checked_sub(1).and_then(|before| samples.get(before));
            let (Some(last), Some(before)) = (steps.last().copied(), before) else {
                steps.push(Integrals {
                    time_s: sample.imu.time_s,
                    attitude: Rotation::identity(),
                    velocity_m_s: Vector::zeros(),
                    pushed_m_s: 0.0,
                    by_bias: Matrix3::zeros(),
                    by_scale: Matrix3::zeros(),
                    turned_rad: 0.0,
                    unknown_s: 0.0,
                    rate_rad_s: rate,
                });
                continue;
            };
            let dt = sample.imu.time_s - last.time_s;
            let half = last.attitude * turn(&last.rate_rad_s, &((last.rate_rad_s + rate) * 0.5), 0.5 * dt);
            let mean = (last.rate_rad_s + rate) * 0.5;
            let force = (before.imu.accel_m_s2 + sample.imu.accel_m_s2) * 0.5;
            let is_unknown = sample.saturated || dt > max_step_s;
            let matrix = half.to_matrix() * dt;
            steps.push(Integrals {
                time_s: sample.imu.time_s,
                attitude: (last.attitude * turn(&last.rate_rad_s, &rate, dt)).renormalized(),
                velocity_m_s: last.velocity_m_s + half * (force * dt),
                pushed_m_s: last.pushed_m_s + force.norm() * dt,
                by_bias: last.by_bias + matrix,
                by_scale: last.by_scale + matrix * Matrix3::from_diagonal(mean.as_inner()),
                turned_rad: last.turned_rad + mean.norm() * dt,
                unknown_s: last.unknown_s + if is_unknown { dt } else { 0.0 },
                rate_rad_s: rate,
            });
        }
        Self { steps: steps.into() }
    }

    /// Returns the integrals at a time between two samples; outside those of the nearest sample.
    pub(super) fn at(&self, time_s: f64) -> Option<Integrals> {
        let next = self.steps.partition_point(|step| step.time_s < time_s);
        let (Some(a), Some(b)) = (next.checked_sub(1).and_then(|i| self.steps.get(i)), self.steps.get(next)) else {
            return self.steps.get(next).or(self.steps.last()).copied();
        };
        let part = (time_s - a.time_s) / (b.time_s - a.time_s);
        let mix = |a: f64, b: f64| a + (b - a) * part;
        Some(Integrals {
            time_s,
            attitude: a.attitude.slerp(&b.attitude, part),
            velocity_m_s: a.velocity_m_s + (b.velocity_m_s - a.velocity_m_s) * part,
            pushed_m_s: mix(a.pushed_m_s, b.pushed_m_s),
            by_bias: a.by_bias + (b.by_bias - a.by_bias) * part,
            by_scale: a.by_scale + (b.by_scale - a.by_scale) * part,
            turned_rad: mix(a.turned_rad, b.turned_rad),
            unknown_s: mix(a.unknown_s, b.unknown_s),
            rate_rad_s: a.rate_rad_s + (b.rate_rad_s - a.rate_rad_s) * part,
        })
    }

    /// Returns the time of the first and of the last sample.
    pub(super) fn span_s(&self) -> Option<[f64; 2]> {
        Some([self.steps.first()?.time_s, self.steps.last()?.time_s])
    }
}

/// Returns position and velocity of the receiver at a time, by Hermite's cubic between two fixes; without velocities by
/// a straight line.
pub(super) fn receiver_at(fixes: &[Fix], time_s: f64) -> Option<(Vector<Fixed>, Vector<Fixed>)> {
    let next = fixes.partition_point(|fix| fix.time_s < time_s);
    let (a, b) = (fixes.get(next.checked_sub(1)?)?, fixes.get(next)?);
    let dt = b.time_s - a.time_s;
    if !(dt > 0.0 && dt <= FIX_STEP_S && a.position_m.is_finite() && b.position_m.is_finite()) {
        return None;
    }
    let mean = (b.position_m - a.position_m) / dt;
    let own = |v: Vector<Fixed>| if v.is_finite() { v } else { mean };
    let (va, vb, s) = (own(a.velocity_m_s), own(b.velocity_m_s), (time_s - a.time_s) / dt);
    let (s2, s3) = (s * s, s * s * s);
    let position = a.position_m * (2.0 * s3 - 3.0 * s2 + 1.0)
        + va * ((s3 - 2.0 * s2 + s) * dt)
        + b.position_m * (3.0 * s2 - 2.0 * s3)
        + vb * ((s3 - s2) * dt);
    Some((position, va + (vb - va) * s))
}

/// Returns the change of the velocity between two fixes that gravity and the turning frame do not explain, m/s.
pub(super) fn felt_m_s(a: &Fix, b: &Fix) -> Option<Vector3<f64>> {
    let dt = b.time_s - a.time_s;
    let all = [a.position_m, b.position_m, a.velocity_m_s, b.velocity_m_s];
    if !(dt > 0.0 && dt <= FIX_STEP_S && all.iter().all(Vector::is_finite)) {
        return None;
    }
    let (middle, mean) = ((a.position_m + b.position_m) * 0.5, (a.velocity_m_s + b.velocity_m_s) * 0.5);
    let free = gravity(&middle) - earth_rate().cross(&mean) * 2.0;
    Some((b.velocity_m_s - a.velocity_m_s - free * dt).into_inner())
}
