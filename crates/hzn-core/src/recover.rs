//! When no edge of the whole picture gives an answer.

/// What is done then.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Method {
    /// Nothing.
    #[default]
    None,
}

/// `[recover]` of sensor.toml.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct Config {
    /// What is done when no edge of the whole picture gives an answer.
    pub method: Method,
}
