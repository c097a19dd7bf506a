//! Gates and choice.

use crate::error::{ConfigError, Limit, above, between, require};

/// `[select]` of sensor.toml: what an answer must fulfil.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct Config {
    /// Fewest inliers, 8 or more.
    pub min_inliers: u16,
    /// Shortest edge that inliers must cover, in pixels, 0 or more.
    pub min_arc_px: f64,
    /// Largest weighted RMS distance of the inliers from the limb in pixels, above 0.
    pub max_rms_px: f64,
    /// Largest difference of the fitted half-angle from the expected one in standard deviations, above 0.
    pub max_half_angle_sigma: f64,
    /// Largest standard deviation of an answer in degrees, above 0 to 180.
    pub max_sigma_deg: f64,
}

impl Default for Config {
    fn default() -> Self {
        Self { min_inliers: 24, min_arc_px: 60.0, max_rms_px: 2.0, max_half_angle_sigma: 4.0, max_sigma_deg: 10.0 }
    }
}

impl Config {
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        require(self.min_inliers >= 8, "select.min_inliers", f64::from(self.min_inliers), Limit::AtLeast(8.0))?;
        between("select.min_arc_px", self.min_arc_px, 0.0, 1e6)?;
        above("select.max_rms_px", self.max_rms_px, 0.0)?;
        above("select.max_half_angle_sigma", self.max_half_angle_sigma, 0.0)?;
        above("select.max_sigma_deg", self.max_sigma_deg, 0.0)?;
        between("select.max_sigma_deg", self.max_sigma_deg, 0.0, 180.0)
    }
}
