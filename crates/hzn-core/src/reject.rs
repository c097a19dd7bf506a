//! Outlier rejection.

use crate::error::{ConfigError, Limit, above, between, require};

/// How outliers are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Method {
    /// RANSAC on two points with the expected half-angle (three points when it is too uncertain), verified on one
    /// further point before it is scored.
    #[default]
    TwoPoint,
    /// Every point is taken.
    None,
}

/// `[reject]` of sensor.toml.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct Config {
    /// How outliers are found.
    pub method: Method,
    /// Distance from the limb in pixels up to which a point can be an inlier, above 0 to 1000.
    pub threshold_px: f64,
    /// Seed of the sampler: the same seed gives the same answer.
    pub seed: u32,
    /// Most draws, 1 to 100000. 800 find the limb among 80 % of outliers.
    pub max_draws: u32,
}

impl Default for Config {
    fn default() -> Self {
        Self { method: Method::TwoPoint, threshold_px: 3.0, seed: 1, max_draws: 800 }
    }
}

impl Config {
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        above("reject.threshold_px", self.threshold_px, 0.0)?;
        between("reject.threshold_px", self.threshold_px, 0.0, 1000.0)?;
        let draws = f64::from(self.max_draws);
        require((1..=100_000).contains(&self.max_draws), "reject.max_draws", draws, Limit::Between(1.0, 1e5))
    }
}
