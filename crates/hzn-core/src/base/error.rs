//! What can be wrong with a configuration, said by field, value and limit.

use core::fmt;

/// A configuration was refused. Nothing after [`crate::Horizon::new`] can fail on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConfigError {
    /// The field as it is written in sensor.toml, such as `camera.fx_px`.
    pub field: &'static str,
    /// The value that was given.
    pub value: f64,
    /// What the value must be.
    pub limit: Limit,
    /// Which of several `[[bodies]]` the field belongs to, from 0.
    pub body: Option<u8>,
}

impl ConfigError {
    /// A value that needs a feature which this build does not have: a `word`, or any value but the default.
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
    /// Greater than this.
    Above(f64),
    /// This or greater.
    AtLeast(f64),
    /// This or smaller.
    AtMost(f64),
    /// Within both, ends included.
    Between(f64, f64),
    /// The lens is monotone only up to this angle in degrees; the image circle must end 2° below it.
    Monotone(f64),
    /// A rule in words.
    Rule(&'static str),
    /// The value needs a feature of this crate that is not built in.
    Feature {
        /// The word that was given; `None` for a value that is no word.
        word: Option<&'static str>,
        /// The feature.
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
                "the lens is monotone only up to {deg:.2} degrees off axis, so that pixels beyond have no single ray; \
                 set camera.theta_max_deg to {:.2} or less, or correct camera.k",
                deg - 2.0
            ),
            Self::Rule(text) => f.write_str(text),
            Self::Feature { word: Some(word), feature } => {
                write!(f, "{word:?} is not in this build: it needs hzn-core with the feature {feature:?}")
            }
            Self::Feature { word: None, feature } => {
                write!(f, "this build reads no such key: it needs hzn-core with the feature {feature:?}")
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

/// Checks of one field, used by every stage's `check`.
pub(crate) fn require(ok: bool, field: &'static str, value: f64, limit: Limit) -> Result<(), ConfigError> {
    if ok { Ok(()) } else { Err(ConfigError { field, value, limit, body: None }) }
}

/// A finite number within `[low, high]`.
pub(crate) fn between(field: &'static str, value: f64, low: f64, high: f64) -> Result<(), ConfigError> {
    require(value.is_finite(), field, value, Limit::Finite)?;
    require(value >= low && value <= high, field, value, Limit::Between(low, high))
}

/// A finite number above `low`.
pub(crate) fn above(field: &'static str, value: f64, low: f64) -> Result<(), ConfigError> {
    require(value.is_finite(), field, value, Limit::Finite)?;
    require(value > low, field, value, Limit::Above(low))
}
