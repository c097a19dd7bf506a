//! The strapdown solution in ECEF: position, velocity and attitude from angular rate and specific force.
//!
//! The turn of a step is a rotation vector: the mean rate times the step, plus the two-sample term of coning, half of
//! what Bortz' equation adds for a rate that changes linearly (Bortz 1971; Savage 1998). The turn of the Earth is a
//! rotation, too. A spin about a fixed axis therefore has no error, whatever the rate of the samples is. A Runge-Kutta
//! step on the quaternion, which Braun & Barf 2022 name as their error, drifts by 4.5°/s in a spin of 5 Hz that 20
//! samples a second measure. Velocity and position take a step of the fourth-order Runge-Kutta method, with the exact
//! attitudes at its begin, middle and end.

use crate::frames::{Fixed, Rotation, Vector, Vehicle};
use crate::gravity::{earth_rate, gravity};

/// One sample of an inertial measurement unit, in the frame of the vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Imu {
    /// Time, s.
    pub time_s: f64,
    /// Angular rate relative to inertial space, rad/s.
    pub gyro_rad_s: Vector<Vehicle>,
    /// Specific force, m/s².
    pub accel_m_s2: Vector<Vehicle>,
}

impl Imu {
    /// Returns whether all numbers are finite.
    pub fn is_finite(&self) -> bool {
        self.time_s.is_finite() && self.gyro_rad_s.is_finite() && self.accel_m_s2.is_finite()
    }
}

/// Position, velocity and attitude of a vehicle at a time.
///
/// ```
/// use hzn_nav::frames::{Rotation, Vector};
/// use hzn_nav::strapdown::{Imu, Nominal};
///
/// // An apple on the equator is let go: nothing holds it, so the accelerometers show nothing.
/// let start = Nominal {
///     time_s: 0.0,
///     attitude: Rotation::identity(),
///     velocity_m_s: Vector::zeros(),
///     position_m: Vector::new(6_378_137.0, 0.0, 0.0),
/// };
/// let sample = |time_s| Imu { time_s, gyro_rad_s: Vector::zeros(), accel_m_s2: Vector::zeros() };
/// let later = start.step(&sample(0.0), &sample(1.0));
/// let [fallen_m, _, _] = (start.position_m - later.position_m).xyz();
/// assert!((fallen_m - 0.5 * 9.7803).abs() < 1e-4);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nominal {
    /// Time, s.
    pub time_s: f64,
    /// Attitude: rotation from the vehicle's frame to ECEF.
    pub attitude: Rotation<Vehicle, Fixed>,
    /// Velocity relative to the Earth, m/s.
    pub velocity_m_s: Vector<Fixed>,
    /// Position, m.
    pub position_m: Vector<Fixed>,
}

impl Nominal {
    /// Returns the state at the time of `to`. Rate and force change linearly from `from` to `to`; `from` must be the
    /// sample at the time of this state. A step may also go backwards in time.
    #[must_use]
    pub fn step(&self, from: &Imu, to: &Imu) -> Self {
        let dt = to.time_s - self.time_s;
        // Rate and force change during the step. Held constant, they would make the method one of first order.
        let middle = Imu {
            time_s: self.time_s + 0.5 * dt,
            gyro_rad_s: (from.gyro_rad_s + to.gyro_rad_s) * 0.5,
            accel_m_s2: (from.accel_m_s2 + to.accel_m_s2) * 0.5,
        };
        let after = |part: f64, sample: &Imu| {
            // The Earth turns about an axis of ECEF, and the vehicle about one of its own: therefore one turn
            // multiplies from the left and the other from the right.
            let turn = turn(&from.gyro_rad_s, &sample.gyro_rad_s, part * dt);
            Rotation::from_scaled_axis(earth_rate() * (-part * dt)) * self.attitude * turn
        };
        // The end alone gets its length back, because only its rounding goes on into the next step.
        let (half_way, attitude) = (after(0.5, &middle), after(1.0, to).renormalized());
        // Known before the four stages, because forces and attitudes depend on neither velocity nor position.
        let forces = [
            self.attitude * from.accel_m_s2,
            half_way * middle.accel_m_s2,
            half_way * middle.accel_m_s2,
            attitude * to.accel_m_s2,
        ];
        let [f1, f2, f3, f4] = forces;
        let start = (self.velocity_m_s, self.position_m);
        let k1 = derivative(&start, f1);
        let k2 = derivative(&moved(&start, &k1, 0.5 * dt), f2);
        let k3 = derivative(&moved(&start, &k2, 0.5 * dt), f3);
        let k4 = derivative(&moved(&start, &k3, dt), f4);
        let sum =
            |a: Vector<Fixed>, b: Vector<Fixed>, c: Vector<Fixed>, d: Vector<Fixed>| (a + (b + c) * 2.0 + d) / 6.0;
        Self {
            time_s: to.time_s,
            attitude,
            velocity_m_s: start.0 + sum(k1.0, k2.0, k3.0, k4.0) * dt,
            position_m: start.1 + sum(k1.1, k2.1, k3.1, k4.1) * dt,
        }
    }
}

/// Returns the rotation against inertial space in a time, during which the rate changes linearly: from the vehicle's
/// frame after it to that before it.
pub fn turn(from_rad_s: &Vector<Vehicle>, to_rad_s: &Vector<Vehicle>, time_s: f64) -> Rotation<Vehicle, Vehicle> {
    let coning = from_rad_s.cross(to_rad_s) * (time_s * time_s / 12.0);
    Rotation::from_scaled_axis((*from_rad_s + *to_rad_s) * (0.5 * time_s) + coning)
}

/// Velocity and position, or their derivatives.
type Motion = (Vector<Fixed>, Vector<Fixed>);

/// v̇ = R f + g − 2 ω_ie × v,  ẋ = v.
fn derivative((v, x): &Motion, force_m_s2: Vector<Fixed>) -> Motion {
    (force_m_s2 + gravity(x) - earth_rate().cross(v) * 2.0, *v)
}

fn moved((v, x): &Motion, (dv, dx): &Motion, dt: f64) -> Motion {
    (*v + *dv * dt, *x + *dx * dt)
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;
    use crate::gravity::EARTH_RATE_RAD_S;

    fn imu(time_s: f64, gyro_rad_s: Vector<Vehicle>, accel_m_s2: Vector<Vehicle>) -> Imu {
        Imu { time_s, gyro_rad_s, accel_m_s2 }
    }

    /// A vehicle at rest on the Earth turns with it, and its force balances gravity.
    #[test]
    fn at_rest_nothing_moves() {
        let attitude = Rotation::from(UnitQuaternion::from_euler_angles(0.3, -0.8, 2.0));
        let position_m = Vector::new(3.2e6, 1.1e6, 5.4e6);
        let mut state = Nominal { time_s: 0.0, attitude, velocity_m_s: Vector::zeros(), position_m };
        let still = |t: f64| imu(t, attitude.inverse() * earth_rate(), attitude.inverse() * -gravity(&position_m));
        for k in 0..6000 {
            state = state.step(&still(0.01 * f64::from(k)), &still(0.01 * f64::from(k + 1)));
        }
        assert!(state.attitude.angle_to(&attitude) < 1e-10, "{}", state.attitude.angle_to(&attitude));
        assert!((state.position_m - position_m).norm() < 1e-4, "{:?}", state.position_m - position_m);
    }

    /// A circular orbit in free fall keeps its radius and energy, and the attitude of a spinning body is exact.
    #[test]
    fn an_orbit_and_a_spin() {
        let r = 7.0e6;
        let speed = (3.986_004_418e14f64 / r).sqrt();
        // In the equatorial plane, J2 makes gravity stronger; the test compares with energy instead of the radius.
        let begin = Nominal {
            time_s: 0.0,
            attitude: Rotation::identity(),
            velocity_m_s: Vector::new(0.0, speed - EARTH_RATE_RAD_S * r, 0.0),
            position_m: Vector::new(r, 0.0, 0.0),
        };
        let spin = Vector::new(0.0, 0.0, 2.0);
        let energy = |s: &Nominal| {
            let inertial = s.velocity_m_s + earth_rate().cross(&s.position_m);
            let r = s.position_m.norm();
            let j2 = 1.082_629_821_3e-3
                * (6_378_137.0 / r).powi(2)
                * 0.5
                * (3.0 * (s.position_m.xyz()[2] / r).powi(2) - 1.0);
            0.5 * inertial.norm_squared() - 3.986_004_418e14 / r * (1.0 - j2)
        };
        let mut state = begin;
        let dt = 0.02;
        for k in 0..50_000 {
            let sample = |k: i32| imu(dt * f64::from(k), spin, Vector::zeros());
            state = state.step(&sample(k), &sample(k + 1));
        }
        assert!((energy(&state) / energy(&begin) - 1.0).abs() < 1e-10, "{}", energy(&state) / energy(&begin));
        let turned = (2.0 - EARTH_RATE_RAD_S) * 1000.0;
        let exact = Rotation::from(UnitQuaternion::from_axis_angle(&nalgebra::Vector3::z_axis(), turned));
        assert!(state.attitude.angle_to(&exact) < 1e-10, "{}", state.attitude.angle_to(&exact));
    }

    #[test]
    fn a_step_back_returns() {
        let begin = Nominal {
            time_s: 5.0,
            attitude: UnitQuaternion::from_euler_angles(0.1, 0.2, 0.3).into(),
            velocity_m_s: Vector::new(100.0, 2000.0, -50.0),
            position_m: Vector::new(6.5e6, 0.0, 1e5),
        };
        let a = imu(5.0, Vector::new(1.0, 0.2, -3.0), Vector::new(10.0, 0.0, 50.0));
        let b = imu(5.01, Vector::new(1.1, 0.1, -3.0), Vector::new(10.5, 0.3, 49.0));
        let back = begin.step(&a, &b).step(&b, &a);
        assert!(back.attitude.angle_to(&begin.attitude) < 1e-10);
        assert!(
            (back.position_m - begin.position_m).norm() < 1e-7
                && (back.velocity_m_s - begin.velocity_m_s).norm() < 1e-7
        );
    }

    /// A spin of 5 Hz that 20 samples a second measure: a quarter of a turn each.
    #[test]
    fn a_fast_spin_does_not_drift() {
        let rate = Vector::new(0.6, -0.8, 0.0) * (5.0 * core::f64::consts::TAU);
        let begin = Nominal {
            time_s: 0.0,
            attitude: UnitQuaternion::from_euler_angles(0.3, -0.8, 2.0).into(),
            velocity_m_s: Vector::zeros(),
            position_m: Vector::new(6.9e6, 0.0, 0.0),
        };
        let sample = |k: i32| imu(0.05 * f64::from(k), rate, Vector::zeros());
        let end = (0..2000).fold(begin, |state, k| state.step(&sample(k), &sample(k + 1)));
        let exact = Rotation::from_scaled_axis(earth_rate() * -100.0) * begin.attitude;
        let exact = exact * Rotation::from_scaled_axis(rate * 100.0);
        assert!(end.attitude.angle_to(&exact).to_degrees() < 1e-6, "{}°", end.attitude.angle_to(&exact).to_degrees());
    }

    /// Classical coning: an axis that is tilted by 0.1 rad runs round a cone five times a second. The attitude is known
    /// in closed form.
    #[test]
    fn coning_is_followed() {
        let (tilt, cone): (f64, f64) = (0.1, 5.0 * core::f64::consts::TAU);
        // The attitude with the rotation vector tilt (cos, sin, 0) has this rate: ω = 2 q* q̇.
        let rate = |t: f64| {
            let (s, c) = (cone * t).sin_cos();
            Vector::<Vehicle>::new(-s * tilt.sin(), c * tilt.sin(), -(1.0 - tilt.cos())) * cone
        };
        let at = |t: f64| {
            let (s, c) = (cone * t).sin_cos();
            Rotation::<Vehicle, Vehicle>::from_scaled_axis(Vector::new(c * tilt, s * tilt, 0.0))
        };
        // What remains is of the second order: a straight line between samples is not the round that the rate runs.
        for (hz, limit_deg) in [(200.0, 0.04), (400.0, 0.01)] {
            let steps = hz as i32;
            let step = |q: Rotation<Vehicle, Vehicle>, k: i32| {
                let [from, to] = [k, k + 1].map(|k| rate(f64::from(k) / hz));
                q * turn(&from, &to, 1.0 / hz)
            };
            let end = (0..steps).fold(at(0.0), step);
            let error_deg = end.angle_to(&at(1.0)).to_degrees();
            assert!(error_deg < limit_deg, "{hz} Hz: {error_deg}°");
        }
    }
}
