//! An attitude in even steps of time.

use nalgebra::UnitQuaternion;

/// Time between two steps, seconds.
pub(super) const STEP_S: f64 = 0.01;

/// Attitudes of the vehicle relative to inertial space, every [`STEP_S`] from `from_s`.
#[derive(Debug, Clone)]
pub(crate) struct AttitudeSteps {
    pub(super) from_s: f64,
    pub(super) steps: Vec<UnitQuaternion<f64>>,
}

impl AttitudeSteps {
    /// Returns the attitude at a time, on the shortest turn between two steps.
    pub(super) fn interpolate(&self, time_s: f64) -> UnitQuaternion<f64> {
        let place = ((time_s - self.from_s) / STEP_S).clamp(0.0, self.steps.len().saturating_sub(2) as f64);
        let i = place as usize;
        match (self.steps.get(i), self.steps.get(i + 1)) {
            (Some(a), Some(b)) => a.try_slerp(b, place - i as f64, 1e-12).unwrap_or(*a),
            _ => UnitQuaternion::identity(),
        }
    }
}
