//! The error of gyros whose noise is smaller than their step.
//!
//! Such a unit gives the same number while the rate moves within a step q. The error is uniform there, with the
//! variance q²/12, and it stays as long as the number does, for a time T. Taken as independent from number to number,
//! it lets the variance of the angle grow by q²/12 T in each second, as white noise of the density q √(T/12) does.
//! Noise of half a step or more takes the rate through several numbers, so that their mean has no such error.

use nalgebra::Vector3;

use crate::input::Sample;

/// Share of the samples that equal the one before if the noise is half a step: two numbers of the sigma σ are as near
/// to each other with the probability q / (2σ√π).
const EQUAL: f64 = 0.56;
/// Change in steps that is no noise about the border between two numbers.
const MOVED: f64 = 1.5;

/// Returns the density of the white noise that the steps of the gyros add, rad/√s: that of the worst axis, because the
/// filter has one for all.
pub(crate) fn gyro_noise(samples: &[Sample]) -> f64 {
    let mut rows: Vec<(f64, Vector3<f64>)> = Vec::with_capacity(samples.len());
    for sample in samples.iter().filter(|s| !s.saturated) {
        let rates = *sample.imu.gyro_rad_s.as_inner();
        // A row that repeats the one before on all axes may be that of a log which is faster than its unit.
        if rows.last().is_none_or(|(_, last)| *last != rates) {
            rows.push((sample.imu.time_s, rates));
        }
    }
    let of_axis = |axis: usize| {
        let values: Vec<(f64, f64)> = rows.iter().map(|(time_s, rates)| (*time_s, rates[axis])).collect();
        density(&values).unwrap_or(0.0)
    };
    (0..3).map(of_axis).fold(0.0, f64::max)
}

/// Returns the density of one axis; `None` if its noise is no smaller than its step.
fn density(values: &[(f64, f64)]) -> Option<f64> {
    let (first, last) = (values.first()?, values.last()?);
    let pairs = values.len() - 1;
    let equal = values.windows(2).filter(|w| w[0].1 == w[1].1).count();
    if equal as f64 <= EQUAL * pairs as f64 {
        return None;
    }
    let step = crate::standing::step(&values.iter().map(|v| v.1).collect::<Vec<_>>())?;
    // The way of the rate in steps, without the noise about a border.
    let (mut held, mut way) = (first.1, 1.0);
    for (_, value) in values {
        let moved = (value - held).abs() / step;
        if moved > MOVED {
            (held, way) = (*value, way + moved);
        }
    }
    Some(step * ((last.0 - first.0) / way / 12.0).sqrt())
}
