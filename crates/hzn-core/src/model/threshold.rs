//! How the level between dark and lit is chosen: for all bodies, or for one of them.

use crate::base::error::{ConfigError, Limit, above, between, require};

/// How the level is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Method {
    /// The level that separates the sample's histogram best (Otsu 1979).
    #[default]
    Otsu,
    /// `level`, always.
    Fixed,
    /// `factor` times the sample's mean.
    Dynamic,
    /// Halfway between the brightness on both sides of the limb in the picture before; `otsu` when that had no answer.
    Track,
}

/// `[binarize]` of sensor.toml.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct Config {
    /// How the level is found.
    pub method: Method,
    /// For `fixed`: a pixel is lit at this value or above. In the picture's own counts, 1 to 65535; below 1 it is a
    /// fraction of full scale, whatever the bits.
    pub level: f64,
    /// For `dynamic`: level = factor × mean, above 0 to 100.
    pub factor: f64,
    /// For `otsu`: the found level is multiplied by this, 0.1 to 10. To see how much an answer depends on the level.
    pub scale: f64,
}

impl Default for Config {
    fn default() -> Self {
        Self { method: Method::Otsu, level: 64.0, factor: 1.0, scale: 1.0 }
    }
}

/// How the Sun is split from everything else.
pub(crate) static SUN: Config = Config { method: Method::Fixed, level: 0.9, factor: 1.0, scale: 1.0 };

/// `[gate]` of sensor.toml: a picture too dark or too bright is not looked at.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct Gate {
    /// Smallest mean brightness as a fraction of full scale, 0 to 1.
    pub min_mean: f64,
    /// Largest mean brightness as a fraction of full scale, 0 to 1.
    pub max_mean: f64,
}

impl Default for Gate {
    fn default() -> Self {
        Self { min_mean: 0.0, max_mean: 0.98 }
    }
}

impl Gate {
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        between("gate.min_mean", self.min_mean, 0.0, 1.0)?;
        between("gate.max_mean", self.max_mean, self.min_mean, 1.0)
    }
}

impl Config {
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        require(self.level.is_finite(), "binarize.level", self.level, Limit::Finite)?;
        above("binarize.level", self.level, 0.0)?;
        between("binarize.level", self.level, 0.0, 65535.0)?;
        above("binarize.factor", self.factor, 0.0)?;
        between("binarize.factor", self.factor, 0.0, 100.0)?;
        between("binarize.scale", self.scale, 0.1, 10.0)
    }
}
