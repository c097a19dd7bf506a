//! A calibration in words and numbers.

use hzn_calib::noise::{self, Calibration};
use hzn_core::camera::Config;
use hzn_run::explain::counted;

use crate::tell::one_line;

/// Returns the report.
pub(super) fn report(calibration: &Calibration, pictures: u64, camera: &Config) -> String {
    noise::lines(calibration, &counted(pictures, "picture"), camera)
        .iter()
        .map(|(name, value)| format!("{name:<14} {}\n", one_line(value)))
        .collect()
}
