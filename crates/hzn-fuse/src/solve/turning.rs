//! How the vehicle turns between a knot and a measurement near it.

use hzn_nav::filter::Corrections;
use hzn_nav::frames::{Fixed, Rotation, Vector, Vehicle};
use hzn_nav::gravity::earth_rate;
use hzn_nav::strapdown::Nominal;

use crate::input::Sample;
use crate::start::DeadReckoning;

/// The gyros over the whole flight.
#[derive(Debug, Clone)]
pub(super) struct Turning {
    reckoning: DeadReckoning,
    samples: Vec<Sample>,
}

impl Turning {
    pub(super) fn new(samples: &[Sample]) -> Self {
        Self { reckoning: DeadReckoning::new(samples), samples: samples.to_vec() }
    }

    /// Returns the attitude at a time near a knot, and the rate against the Earth there. The effect of the gyros'
    /// errors on a rotation of a fraction of a second is taken, and its derivative is neglected.
    pub(super) fn at(
        &self,
        knot: &Nominal,
        corrections: &Corrections,
        time_s: f64,
    ) -> (Rotation<Vehicle, Fixed>, Vector<Vehicle>) {
        let dt = time_s - knot.time_s;
        let turn = self.between(knot.time_s, time_s);
        let errors = |rate: Vector<Vehicle>| {
            corrections.gyro_bias
                + corrections.gyro_scale.component_mul(&rate)
                + corrections.gyro_misalignment.cross(&rate)
        };
        let drift = if dt == 0.0 { Vector::zeros() } else { errors(turn.scaled_axis() / dt) * -dt };
        let earth = Rotation::from_scaled_axis(earth_rate() * -dt);
        let attitude = earth * knot.attitude * turn * Rotation::from_scaled_axis(drift);
        let inertial = self.rate(time_s);
        (attitude, inertial - errors(inertial) - attitude.inverse() * earth_rate())
    }

    /// Returns the rotation of the vehicle against inertial space between two times.
    pub(super) fn between(&self, from_s: f64, to_s: f64) -> Rotation<Vehicle, Vehicle> {
        self.reckoning.at(from_s).inverse() * self.reckoning.at(to_s)
    }

    /// Returns the measured rate at a time. Between two samples it is the mean of both, because the attitude there is
    /// that of a rotation with this rate.
    fn rate(&self, time_s: f64) -> Vector<Vehicle> {
        let next = self.samples.partition_point(|s| s.imu.time_s < time_s);
        let before = next.checked_sub(1).and_then(|i| self.samples.get(i));
        match (before, self.samples.get(next)) {
            (Some(a), Some(b)) => (a.imu.gyro_rad_s + b.imu.gyro_rad_s) * 0.5,
            (Some(one), None) | (None, Some(one)) => one.imu.gyro_rad_s,
            (None, None) => Vector::zeros(),
        }
    }
}
