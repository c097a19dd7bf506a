//! The strapdown solution in ECEF: position, velocity and attitude from angular rate and specific force.
//!
//! A step is one of the fourth-order Runge-Kutta method. A vehicle that turns by 0.04 rad a sample gains an error of
//! 3·10⁻⁶ rad in 1000 s. The error grows fast with the turn of a sample, so the samples must be frequent: a spin of 5
//! Hz drifts by 0.009°/s at 100 samples a second, and by 4.5°/s at 20.

use nalgebra::{Quaternion, UnitQuaternion};

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
    /// Returns the state at the time of `to`, by a step of the fourth-order Runge-Kutta method. Rate and force change
    /// linearly from `from` to `to`; `from` must be the sample at the time of this state. A step may also go backwards
    /// in time.
    #[must_use]
    pub fn step(&self, from: &Imu, to: &Imu) -> Self {
        let dt = to.time_s - self.time_s;
        let between = |part: f64| {
            let mix = |a: Vector<Vehicle>, b: Vector<Vehicle>| a + (b - a) * part;
            (mix(from.gyro_rad_s, to.gyro_rad_s), mix(from.accel_m_s2, to.accel_m_s2))
        };
        // Rate and force change during the step. Held constant, they would make the method one of first order.
        let (begin, middle, end) = (between(0.0), between(0.5), between(1.0));
        let start = (self.attitude.into_inner().into_inner(), self.velocity_m_s, self.position_m);
        let k1 = derivative(&start, &begin);
        let k2 = derivative(&moved(&start, &k1, 0.5 * dt), &middle);
        let k3 = derivative(&moved(&start, &k2, 0.5 * dt), &middle);
        let k4 = derivative(&moved(&start, &k3, dt), &end);
        let sum =
            |a: Vector<Fixed>, b: Vector<Fixed>, c: Vector<Fixed>, d: Vector<Fixed>| (a + (b + c) * 2.0 + d) / 6.0;
        let turn = (k1.0 + (k2.0 + k3.0) * 2.0 + k4.0) / 6.0;
        Self {
            time_s: to.time_s,
            attitude: UnitQuaternion::new_normalize(start.0 + turn * dt).into(),
            velocity_m_s: start.1 + sum(k1.1, k2.1, k3.1, k4.1) * dt,
            position_m: start.2 + sum(k1.2, k2.2, k3.2, k4.2) * dt,
        }
    }
}

/// Attitude, velocity and position, or their derivatives.
type State = (Quaternion<f64>, Vector<Fixed>, Vector<Fixed>);

/// q̇ = ½ q ω_ib − ½ ω_ie q,  v̇ = R f + g − 2 ω_ie × v,  ẋ = v.
fn derivative((q, v, x): &State, (gyro, accel): &(Vector<Vehicle>, Vector<Vehicle>)) -> State {
    let rate = earth_rate();
    let turn = (q * Quaternion::from_imag(gyro.into_inner()) - Quaternion::from_imag(rate.into_inner()) * q) * 0.5;
    // The quaternion between the stages is not of unit length, and would scale the force.
    let attitude = Rotation::<Vehicle, Fixed>::from(UnitQuaternion::new_normalize(*q));
    (turn, attitude * *accel + gravity(x) - rate.cross(v) * 2.0, *v)
}

fn moved((q, v, x): &State, (dq, dv, dx): &State, dt: f64) -> State {
    (q + dq * dt, *v + *dv * dt, *x + *dx * dt)
}

#[cfg(test)]
mod tests {
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
        assert!(state.attitude.angle_to(&exact) < 5e-6, "{}", state.attitude.angle_to(&exact));
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
}
