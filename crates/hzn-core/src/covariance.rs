//! Covariance.

use crate::error::{ConfigError, above, between};

/// `[covariance]` of sensor.toml: edge errors as a Gauss-Markov process along the limb.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct Config {
    /// 1-sigma of an edge point in pixels, above 0.
    pub sigma_px: f64,
    /// Length along the edge over which errors stay alike, in pixels; 0 for white errors.
    pub correlation_px: f64,
}

impl Default for Config {
    fn default() -> Self {
        Self { sigma_px: 1.0, correlation_px: 300.0 }
    }
}

impl Config {
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        above("covariance.sigma_px", self.sigma_px, 0.0)?;
        between("covariance.sigma_px", self.sigma_px, 0.0, 1e4)?;
        between("covariance.correlation_px", self.correlation_px, 0.0, 1e6)
    }
}
