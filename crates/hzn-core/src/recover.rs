//! When no edge of the whole picture gives an answer.

use crate::error::ConfigError;
#[cfg(feature = "horace")]
use crate::error::between;

/// What is done then.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Method {
    /// Nothing.
    #[default]
    None,
    /// The picture is cut in halves, and those that give no answer again (Barf 2014, 2.2.6).
    #[cfg(feature = "horace")]
    Division,
}

/// What the answers of several parts make together.
#[cfg(feature = "horace")]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Combine {
    /// The median of each component: a part that took something else for the limb does no harm.
    #[default]
    Median,
    /// The mean of each component.
    Mean,
}

/// `[recover]` of sensor.toml.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct Config {
    /// What is done when no edge of the whole picture gives an answer.
    pub method: Method,
    /// For `division`: parts that are smaller than this fraction of the picture's area are not cut again, 1/64 to 1.
    #[cfg(feature = "horace")]
    pub least_part: f64,
    /// For `division`: what the answers of several parts make together.
    #[cfg(feature = "horace")]
    pub combine: Combine,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            method: Method::None,
            #[cfg(feature = "horace")]
            least_part: 0.1,
            #[cfg(feature = "horace")]
            combine: Combine::Median,
        }
    }
}

impl Config {
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        #[cfg(feature = "horace")]
        between("recover.least_part", self.least_part, 1.0 / 64.0, 1.0)?;
        Ok(())
    }
}
