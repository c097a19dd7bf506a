//! Candidates.

use crate::error::{ConfigError, Limit, require};

/// How a border pixel becomes an edge point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum SubPixel {
    /// Crossing of the mid-level between the plateaus on both sides, in three rows smoothed along the edge.
    #[default]
    Linear,
    /// The border pixel's centre, moved half a pixel to the dark side.
    None,
}

/// `[candidates]` of sensor.toml.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct Config {
    /// Edges with fewer border pixels are left out, 8 or more.
    pub min_points: u16,
    /// Points kept of each candidate, evenly along the edge, 16 or more; 0 keeps all that fit.
    pub keep_points: u16,
    /// How a border pixel becomes an edge point.
    pub subpixel: SubPixel,
}

impl Default for Config {
    fn default() -> Self {
        Self { min_points: 40, keep_points: 600, subpixel: SubPixel::Linear }
    }
}

impl Config {
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        let (min, keep) = (f64::from(self.min_points), f64::from(self.keep_points));
        require(self.min_points >= 8, "candidates.min_points", min, Limit::AtLeast(8.0))?;
        require(
            self.keep_points == 0 || self.keep_points >= 16,
            "candidates.keep_points",
            keep,
            Limit::Rule("must be 16 or more, or 0 to keep all"),
        )
    }
}
