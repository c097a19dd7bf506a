//! Errors of a configuration: the field, its value and its limit.

use core::fmt;

/// The error of a configuration that is refused. After [`crate::Horizon::configure`] accepts a configuration, nothing
/// can fail on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConfigError {
    /// The field as it is written in sensor.toml, for example `camera.fx_px`.
    pub field: &'static str,
    /// The refused value.
    pub value: f64,
    /// What the value must be.
    pub limit: Limit,
    /// Index of the `[[bodies]]` entry that the field belongs to, from 0.
    pub body: Option<u8>,
}

impl ConfigError {
    /// Makes the error for a value that needs a feature which is not in this build: a `word`, or any value but the
    /// default.
    // The value is NaN because a word has no number, and `Display` leaves it out for this limit.
    pub(crate) const fn lacks(field: &'static str, word: Option<&'static str>, feature: &'static str) -> Self {
        Self { field, value: f64::NAN, limit: Limit::Feature { word, feature }, body: None }
    }
}

/// The rule that a value broke.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Limit {
    /// A finite number.
    Finite,
    /// A number greater than this.
    Above(f64),
    /// This number or a greater one.
    AtLeast(f64),
    /// This number or a smaller one.
    AtMost(f64),
    /// A number between the two, ends included.
    Between(f64, f64),
    /// The lens is monotone only up to this angle in degrees; the image circle must end at least 2° below it.
    Monotone(f64),
    /// A rule in words.
    Rule(&'static str),
    /// The value needs a feature of this crate that is not built in.
    Feature {
        /// The refused word; `None` for a value that is not a word.
        word: Option<&'static str>,
        /// The name of the feature.
        feature: &'static str,
    },
}

impl fmt::Display for Limit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Finite => write!(f, "must be a finite number"),
            Self::Above(x) => write!(f, "must be above {x}"),
            Self::AtLeast(x) => write!(f, "must be at least {x}"),
            Self::AtMost(x) => write!(f, "must be at most {x}"),
            Self::Between(a, b) => write!(f, "must be between {a} and {b}"),
            Self::Monotone(deg) => write!(
                f,
                "the lens is monotone only up to {deg:.2} degrees off axis, and pixels beyond that angle have no \
                 unique ray; set camera.theta_max_deg to {:.2} or less, or correct camera.k",
                deg - 2.0
            ),
            Self::Rule(text) => f.write_str(text),
            Self::Feature { word: Some(word), feature } => {
                write!(f, "{word:?} is not in this build: it needs hzn-core with the feature {feature:?}")
            }
            Self::Feature { word: None, feature } => {
                write!(f, "this build does not read this key: the key needs hzn-core with the feature {feature:?}")
            }
        }
    }
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(which) = self.body {
            write!(f, "bodies[{which}]: ")?;
        }
        match self.limit {
            Limit::Feature { .. } => write!(f, "{}: {}", self.field, self.limit),
            _ => write!(f, "{} = {}: {}", self.field, self.value, self.limit),
        }
    }
}

impl core::error::Error for ConfigError {}

/// Checks one field; the `check` of every stage uses it.
// The caller passes `ok` and not its negation, so that NaN fails every comparison and is refused.
pub(crate) fn require(ok: bool, field: &'static str, value: f64, limit: Limit) -> Result<(), ConfigError> {
    if ok { Ok(()) } else { Err(ConfigError { field, value, limit, body: None }) }
}

/// Checks that the value is finite and within `[low, high]`.
pub(crate) fn between(field: &'static str, value: f64, low: f64, high: f64) -> Result<(), ConfigError> {
    require(value.is_finite(), field, value, Limit::Finite)?;
    require(value >= low && value <= high, field, value, Limit::Between(low, high))
}

/// Checks that the value is finite and above `low`.
pub(crate) fn above(field: &'static str, value: f64, low: f64) -> Result<(), ConfigError> {
    require(value.is_finite(), field, value, Limit::Finite)?;
    require(value > low, field, value, Limit::Above(low))
}
