//! A spinning rocket and its rate control.

use core::f64::consts::TAU;

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::steps::{AttitudeSteps, STEP_S};
use crate::counter::{Counter, Stream};
use crate::trajectory::earth::from_ecef;
use crate::trajectory::position::PreparedTrajectory;
use crate::trajectory::rocket::Ascent;

/// A spinning rocket and its rate control.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Spin {
    /// Spin about the long axis after burn-out, turns per second.
    pub spin_hz: f64,
    /// Time at which the spin is reached, seconds; the spin grows evenly from lift-off.
    pub spun_up_s: f64,
    /// Time at which the yo-yo is released, seconds. The spin is gone one second later, and rate control begins. `inf`:
    /// the spin goes on.
    #[cfg_attr(feature = "schema", schemars(extend("infinite" = true)))]
    pub yoyo_s: f64,
    /// Rate about the long axis at which a thruster fires, degrees per second.
    pub limit_deg_s: f64,
    /// Rate about the other two axes at which a thruster fires, degrees per second.
    pub lateral_limit_deg_s: f64,
    /// Largest angular acceleration of the disturbance (degrees/s²) divided by the rate limit (degrees/s). Its size and
    /// sign change at random times.
    pub disturbance_per_s: f64,
    /// Angle between the long axis and the direction of flight at burn-out, degrees. It grows evenly from lift-off.
    pub cone_deg: f64,
}

impl Default for Spin {
    fn default() -> Self {
        Self {
            spin_hz: 3.0,
            spun_up_s: 44.0,
            yoyo_s: 56.0,
            limit_deg_s: 0.9,
            lateral_limit_deg_s: 0.3,
            disturbance_per_s: 0.04,
            cone_deg: 3.0,
        }
    }
}

impl Spin {
    /// Fails for the first value that is out of its limits, with its key and the rule.
    pub(super) fn check(&self) -> Result<(), (&'static str, &'static str)> {
        if !(self.limit_deg_s > 0.0 && self.lateral_limit_deg_s > 0.0) {
            return Err(("spin.limit_deg_s", "limit_deg_s and lateral_limit_deg_s must be above 0"));
        }
        if !(self.spin_hz.abs() <= 20.0) {
            return Err(("spin.spin_hz", "must be at most 20 turns per second"));
        }
        Ok(())
    }

    /// Integrates the attitude from lift-off to two seconds after `to_s`.
    pub(super) fn integrate(
        &self,
        trajectory: &PreparedTrajectory,
        ascent: &Ascent,
        to_s: f64,
        seed: u64,
    ) -> AttitudeSteps {
        let mut draws = Draws::new(seed);
        let count = ((to_s + 2.0) / STEP_S) as usize + 2;
        let burnout_s = self.burnout_s();
        let mut roll = TAU * draws.uniform();
        let mut control = RateControl::new(self, draws);
        let mut q = UnitQuaternion::identity();
        let mut steps = Vec::with_capacity(count);
        for i in 0..count {
            let t = i as f64 * STEP_S;
            if t <= burnout_s {
                q = self.attitude_under_thrust(trajectory, ascent, t, roll);
                roll += self.spin_radps(t) * STEP_S;
            } else {
                // After burn-out the long axis keeps its direction in space, until rate control lets it drift.
                let rate = match t > self.yoyo_s + 1.0 {
                    true => control.advance(),
                    false => Vector3::new(self.spin_radps(t), 0.0, 0.0),
                };
                q *= UnitQuaternion::from_scaled_axis(rate * STEP_S);
            }
            steps.push(q);
        }
        AttitudeSteps { from_s: 0.0, steps }
    }

    /// Returns the time at which the spin is reached and the thrust ends, seconds.
    fn burnout_s(&self) -> f64 {
        self.spun_up_s.max(1.0)
    }

    /// Returns the spin before rate control, rad/s.
    fn spin_radps(&self, time_s: f64) -> f64 {
        let left = if time_s > self.yoyo_s { (1.0 - (time_s - self.yoyo_s)).max(0.0) } else { 1.0 };
        TAU * self.spin_hz * (time_s / self.burnout_s()).min(1.0) * left
    }

    /// Returns the attitude relative to inertial space while the long axis follows the direction of flight.
    fn attitude_under_thrust(
        &self,
        trajectory: &PreparedTrajectory,
        ascent: &Ascent,
        time_s: f64,
        roll_rad: f64,
    ) -> UnitQuaternion<f64> {
        let sidereal_rad = trajectory.sidereal_rad(time_s);
        let forward = from_ecef(sidereal_rad, &ascent.forward(time_s));
        let up = from_ecef(sidereal_rad, &ascent.point(time_s).position_m.normalize());
        let lean = self.cone_deg.to_radians() * (time_s / self.burnout_s());
        attitude_along(forward, up)
            * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), lean)
            * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), roll_rad)
    }
}

/// Returns the attitude whose x axis is along `x` and whose y axis is perpendicular to `up`.
fn attitude_along(x: Vector3<f64>, up: Vector3<f64>) -> UnitQuaternion<f64> {
    let x = x.normalize();
    let helper = if x.dot(&up).abs() < 0.999 * up.norm() { up } else { Vector3::new(up.y, up.z, up.x) };
    let y = helper.cross(&x).normalize();
    let axes = Matrix3::from_columns(&[x, y, x.cross(&y)]);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes))
}

/// Uniform random numbers that are used in order.
struct Draws {
    numbers: Counter,
    count: u64,
}

impl Draws {
    fn new(seed: u64) -> Self {
        Self { numbers: Counter::new(seed, Stream::Drift), count: 0 }
    }

    /// Returns the next number, between 0 and 1.
    fn uniform(&mut self) -> f64 {
        self.count += 1;
        self.numbers.uniform(self.count)
    }
}

/// The drift under rate control: each axis has a rate, the acceleration of a disturbance, and a thruster.
struct RateControl {
    draws: Draws,
    /// Rate at which a thruster fires, rad/s.
    limits: [f64; 3],
    /// Largest acceleration of the disturbance, rad/s².
    pushes: [f64; 3],
    rate: [f64; 3],
    torque: [f64; 3],
    /// Acceleration by the thruster; 0 while it is off.
    pulse: [f64; 3],
}

impl RateControl {
    fn new(spin: &Spin, mut draws: Draws) -> Self {
        let limits = [spin.limit_deg_s, spin.lateral_limit_deg_s, spin.lateral_limit_deg_s].map(f64::to_radians);
        let pushes = limits.map(|limit| limit * spin.disturbance_per_s);
        let rate = core::array::from_fn(|a| limits[a] * (1.6 * draws.uniform() - 0.8));
        let torque = core::array::from_fn(|a| pushes[a] * (2.0 * draws.uniform() - 1.0));
        Self { draws, limits, pushes, rate, torque, pulse: [0.0; 3] }
    }

    /// Returns the rate, rad/s, and advances it by one step.
    fn advance(&mut self) -> Vector3<f64> {
        let rate = Vector3::from(self.rate);
        (0..3).for_each(|a| self.advance_axis(a));
        rate
    }

    fn advance_axis(&mut self, a: usize) {
        let limit = self.limits[a];
        if self.draws.uniform() < STEP_S / 12.0 {
            self.torque[a] = self.pushes[a] * (2.0 * self.draws.uniform() - 1.0);
        }
        // A thruster brings the rate through zero within a third of a second.
        if self.rate[a].abs() >= limit && self.pulse[a] == 0.0 {
            self.pulse[a] = -self.rate[a] * (1.0 + 0.7 * self.draws.uniform()) / 0.3;
        }
        self.rate[a] += (self.torque[a] + self.pulse[a]) * STEP_S;
        if self.pulse[a] != 0.0 && (self.rate[a] * self.pulse[a] > 0.0) && self.rate[a].abs() >= 0.3 * limit {
            self.pulse[a] = 0.0;
        }
    }
}
