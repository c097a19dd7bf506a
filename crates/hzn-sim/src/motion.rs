//! Rotation of the camera while it takes one picture.

use serde::{Deserialize, Serialize};

use crate::pose::Pose;

/// Rotation of the camera during one picture. The pose of the picture is the pose at the middle of the middle row's
/// exposure.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motion {
    /// Rate of the camera relative to ECEF, in the camera frame, rad/s.
    pub rate_radps: [f64; 3],
    /// Exposure time of a row, seconds.
    pub exposure_s: f64,
    /// Time from the first row's exposure to the last row's exposure, seconds; 0 is a global shutter.
    pub readout_s: f64,
}

/// Distance in pixels between two of the poses that a blurred picture is averaged over.
const STEP_PX: f64 = 1.2;
/// Largest number of these poses.
const MAX_POSES: usize = 48;

impl Motion {
    fn rate(&self) -> f64 {
        self.rate_radps.iter().map(|x| x * x).sum::<f64>().sqrt()
    }

    /// Returns true if the rotation during the picture is more than 0.02 px.
    pub(crate) fn is_significant(&self, pixel_rad: f64) -> bool {
        self.rate() * (self.exposure_s.abs() + self.readout_s.abs()) > 0.02 * pixel_rad
    }

    /// Returns the time of the middle of a row's exposure, in seconds after the time of the picture.
    pub(crate) fn row_time_s(&self, row: f64, rows: usize) -> f64 {
        let last = rows.saturating_sub(1).max(1) as f64;
        self.readout_s * (row / last - 0.5)
    }

    /// Returns the poses that the light of a row comes from. All have the same weight.
    pub(crate) fn poses(&self, pose: &Pose, row: f64, rows: usize, pixel_rad: f64) -> Vec<Pose> {
        let blur_px = self.rate() * self.exposure_s / pixel_rad;
        let count = ((blur_px / STEP_PX).ceil() as usize).clamp(1, MAX_POSES);
        let middle = self.row_time_s(row, rows);
        (0..count)
            .map(|i| {
                let time_s = middle + self.exposure_s * ((i as f64 + 0.5) / count as f64 - 0.5);
                pose.disturbed(self.rate_radps.map(|w| w * time_s))
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_are_spread_over_the_exposure() {
        let motion = Motion { rate_radps: [0.0, 0.0, 2.0], exposure_s: 0.01, readout_s: 0.1 };
        let pose = Pose { position_m: [7e6, 0.0, 0.0], q_fixed_from_camera_wxyz: [1.0, 0.0, 0.0, 0.0] };
        let about_z = |p: &Pose| 2.0 * libm::asin(p.q_fixed_from_camera_wxyz[3]);
        let top = motion.poses(&pose, 0.0, 101, 1e-3);
        // The blur is 20 mrad at 1 mrad per pixel.
        assert_eq!(top.len(), 17);
        let mean = top.iter().map(about_z).sum::<f64>() / 17.0;
        assert!((mean + 0.1).abs() < 1e-9, "{mean}");
        let span = about_z(&top[16]) - about_z(&top[0]);
        assert!((span - 0.02 * 16.0 / 17.0).abs() < 1e-9);
        assert!(!Motion { rate_radps: [0.0; 3], ..motion }.is_significant(1e-3));
    }
}
