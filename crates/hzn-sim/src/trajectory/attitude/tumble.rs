//! A rigid body without torque.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::steps::{AttitudeSteps, STEP_S};
use crate::counter::{Counter, Stream};

/// A rigid body without torque.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Tumble {
    /// Rates about the vehicle's axes at time 0, degrees per second.
    pub rates_deg_s: [f64; 3],
    /// Moments of inertia about the vehicle's axes, in any unit.
    pub inertia: [f64; 3],
}

impl Default for Tumble {
    fn default() -> Self {
        Self { rates_deg_s: [1.5, -0.8, 0.5], inertia: [1.0, 1.6, 2.1] }
    }
}

impl Tumble {
    /// Fails for the first value that is out of its limits, with its key and the rule.
    pub(super) fn check(&self) -> Result<(), (&'static str, &'static str)> {
        if !self.inertia.iter().all(|&i| i > 0.0) {
            return Err(("tumble.inertia", "all three must be above 0"));
        }
        if self.rates_deg_s.iter().any(|r| !(r.abs() <= 3600.0)) {
            return Err(("tumble.rates_deg_s", "must be at most 3600 degrees per second"));
        }
        Ok(())
    }

    /// Integrates the attitude from one second before the span, with a random attitude at its start.
    pub(super) fn integrate(&self, [from_s, to_s]: [f64; 2], seed: u64) -> AttitudeSteps {
        let draws = Counter::new(seed, Stream::Drift);
        let start = [0, 1, 2, 3].map(|i| draws.normal(i));
        let mut q = UnitQuaternion::from_quaternion(Quaternion::from(start));
        let [a, b, c] = self.inertia;
        let acceleration = |w: &Vector3<f64>| {
            // These are Euler's equations without torque.
            Vector3::new((b - c) * w.y * w.z / a, (c - a) * w.z * w.x / b, (a - b) * w.x * w.y / c)
        };
        let mut w = Vector3::from(self.rates_deg_s.map(f64::to_radians));
        let from_s = from_s - 1.0;
        let count = ((to_s - from_s + 2.0) / STEP_S) as usize + 2;
        let mut steps = Vec::with_capacity(count);
        for _ in 0..count {
            steps.push(q);
            let middle = w + acceleration(&w) * (STEP_S / 2.0);
            q *= UnitQuaternion::from_scaled_axis(middle * STEP_S);
            w += acceleration(&middle) * STEP_S;
        }
        AttitudeSteps { from_s, steps }
    }
}
