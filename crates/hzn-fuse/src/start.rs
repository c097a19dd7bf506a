//! The first attitude: Wahba's problem over the directions in a window of time.
//!
//! Between the directions of the window the gyros carry the attitude, in a frame that does not turn. Of each camera and
//! body the first and the last direction of the window count: others share their mount, and would say little more.

use hzn_nav::frames::{Fixed, Rotation, Vector, Vehicle};
use hzn_nav::gravity::EARTH_RATE_RAD_S;
use hzn_nav::strapdown::turn;
use hzn_nav::vectors::{Direction, Wahba, davenport};
use nalgebra::{UnitQuaternion, Vector3};

use crate::input::{Body, Sample};

/// A direction on the vehicle, with its reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sight {
    /// Time, s.
    pub time_s: f64,
    /// Number of the camera.
    pub camera: usize,
    /// The body.
    pub body: Body,
    /// Unit vector.
    pub on_vehicle: Vector<Vehicle>,
    /// The same direction from outside, a unit vector.
    pub reference: Vector<Fixed>,
    /// 1-sigma, rad, with the error of the mount.
    pub sigma_rad: f64,
}

/// The frame of the vehicle at its first sample. It does not turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AtFirst {}

/// The attitude of the vehicle in a frame that does not turn, from the gyros alone.
#[derive(Debug, Clone)]
pub struct DeadReckoning {
    steps: Vec<(f64, Rotation<Vehicle, AtFirst>)>,
}

impl DeadReckoning {
    /// Integrates the gyros.
    pub fn new(samples: &[Sample]) -> Self {
        let mut q = Rotation::identity();
        let mut steps: Vec<(f64, Rotation<Vehicle, AtFirst>)> = Vec::with_capacity(samples.len());
        let mut last: Option<&Sample> = None;
        for sample in samples {
            if let Some(last) = last {
                let dt = sample.imu.time_s - last.imu.time_s;
                q = (q * turn(&last.imu.gyro_rad_s, &sample.imu.gyro_rad_s, dt)).renormalized();
            }
            steps.push((sample.imu.time_s, q));
            last = Some(sample);
        }
        Self { steps }
    }

    /// Returns the attitude at a time; outside the samples that of the nearest one.
    pub fn at(&self, time_s: f64) -> Rotation<Vehicle, AtFirst> {
        let next = self.steps.partition_point(|(t, _)| *t < time_s);
        let before = next.checked_sub(1).and_then(|i| self.steps.get(i));
        match (before, self.steps.get(next)) {
            (Some((t0, a)), Some((t1, b))) => a.slerp(b, ((time_s - t0) / (t1 - t0)).clamp(0.0, 1.0)),
            (Some((_, q)), None) | (None, Some((_, q))) => *q,
            (None, None) => Rotation::identity(),
        }
    }
}

/// What sights say about the attitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sighted {
    /// The attitude of the vehicle at the time of the last sight, and the number of sights that it is made of.
    Attitude(Wahba, usize),
    /// The sights contradict each other.
    Contradiction,
    /// The sights do not determine an attitude.
    Nothing,
}

/// Returns the attitude of the vehicle at the time of the last sight.
pub fn attitude(sights: &[Sight], reckoning: &DeadReckoning) -> Sighted {
    let Some(end_s) = sights.last().map(|s| s.time_s) else { return Sighted::Nothing };
    let about_pole = |angle_rad: f64| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle_rad);
    let turned = |time_s: f64| Rotation::<Fixed, Fixed>::from(about_pole(EARTH_RATE_RAD_S * (time_s - end_s)));
    let chosen: Vec<&Sight> = sights
        .iter()
        .enumerate()
        .filter(|(i, sight)| {
            let same = |other: &Sight| (other.camera, other.body) == (sight.camera, sight.body);
            let (before, after) = (sights.iter().take(*i), sights.iter().skip(i + 1));
            !before.into_iter().any(same) || !after.into_iter().any(same)
        })
        .map(|(_, sight)| sight)
        .collect();
    let directions: Vec<Direction<AtFirst>> = chosen
        .iter()
        .map(|sight| Direction {
            vehicle: reckoning.at(sight.time_s) * sight.on_vehicle,
            reference: turned(sight.time_s) * sight.reference,
            sigma_rad: sight.sigma_rad,
        })
        .collect();
    let Some(wahba) = davenport(&directions) else { return Sighted::Nothing };
    let freedom = (2 * directions.len()).saturating_sub(3).max(1) as f64;
    // A right set is above this once in a thousand.
    let limit = freedom + 4.0 * (2.0 * freedom).sqrt() + 4.0;
    let attitude = wahba.attitude * reckoning.at(end_s);
    if wahba.chi2 < limit {
        let Wahba { covariance_rad2, chi2, .. } = wahba;
        Sighted::Attitude(Wahba { attitude, covariance_rad2, chi2 }, directions.len())
    } else {
        Sighted::Contradiction
    }
}
