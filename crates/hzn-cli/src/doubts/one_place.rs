//! Looks for answers that are all at the same place in the picture, as the rim of an image circle is.

use hzn_core::frames::{Cam, UnitVec3};
use hzn_run::engine::Finished;

use crate::tell;

/// Fewest answers that say something.
const MIN_ANSWERS: usize = 5;
/// Largest distance of the answers from their mean, in sigmas of their own noise.
const MAX_SIGMAS: f64 = 4.0;
/// Largest angle between the optical axis and the answers, and smallest half-angle: an image circle lies about the
/// optical axis and is large.
const MAX_OFF_AXIS_DEG: f64 = 6.0;
const MIN_HALF_ANGLE_DEG: f64 = 45.0;

/// Collects the answers of the first body for which nothing says whether the camera turns.
#[derive(Default)]
pub(crate) struct OnePlace {
    axes: Vec<[f64; 3]>,
    noise_rad: Vec<f64>,
    /// Answers that are no rim, or for which an attitude or a rate is known: the sensor itself compares these.
    others: usize,
}

impl OnePlace {
    pub(crate) fn count(&mut self, frame: &Finished) {
        let solution = frame.outcomes.first().and_then(|first| first.report.as_ref().ok()?.solution.as_ref());
        let Some(solution) = solution else { return };
        let data = frame.data.as_ref();
        let is_told = data.is_some_and(|d| d.q_fixed_from_camera_wxyz.is_some() || d.rate_rad_s.is_some());
        let off_axis_deg = off_axis_deg(&solution.axis);
        if is_told || off_axis_deg > MAX_OFF_AXIS_DEG || solution.half_angle_rad.to_degrees() < MIN_HALF_ANGLE_DEG {
            self.others += 1;
            return;
        }
        self.axes.push(solution.axis.xyz());
        self.noise_rad.push(solution.noise_rad());
    }

    /// Returns what is odd, in words.
    fn describe(&self) -> Option<String> {
        let n = self.axes.len();
        if n < MIN_ANSWERS || self.others > 0 {
            return None;
        }
        let sum = |i: usize| self.axes.iter().map(|axis| axis[i]).sum::<f64>();
        let mean = UnitVec3::<Cam, f64>::try_new([sum(0), sum(1), sum(2)])?;
        let from_mean = |axis: &[f64; 3]| UnitVec3::try_new(*axis).map_or(0.0, |axis| mean.angle_rad(&axis));
        let is_one_place =
            self.axes.iter().zip(&self.noise_rad).all(|(axis, noise)| from_mean(axis) <= MAX_SIGMAS * noise);
        is_one_place.then(|| {
            format!(
                "all {n} answers lie at one place in the picture, {:.1} deg off the optical axis, and nothing says \
                 that the camera keeps its attitude. The rim of a fisheye's image circle looks like this: \
                 camera.theta_max_deg masks it. It is right for a camera that always looks at the nadir",
                off_axis_deg(&mean)
            )
        })
    }

    pub(crate) fn tell(&self) {
        if let Some(what) = self.describe() {
            tell::warning(what);
        }
    }
}

fn off_axis_deg(axis: &UnitVec3<Cam, f64>) -> f64 {
    axis.xyz()[2].clamp(-1.0, 1.0).acos().to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answers(turn_rad: f64, noise_rad: f64) -> OnePlace {
        let axes = (0..8).map(|k| [0.01 + turn_rad * f64::from(k), 0.0, 1.0]).collect();
        OnePlace { axes, noise_rad: vec![noise_rad; 8], others: 0 }
    }

    #[test]
    fn only_answers_at_one_place_are_told() {
        let what = answers(1e-5, 1e-4).describe().unwrap();
        assert!(what.contains("all 8 answers") && what.contains("0.6 deg off"), "{what}");
        assert_eq!(answers(1e-3, 1e-4).describe(), None);
        assert_eq!(OnePlace { others: 1, ..answers(1e-5, 1e-4) }.describe(), None);
    }
}
