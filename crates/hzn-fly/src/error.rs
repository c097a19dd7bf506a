//! Why a flight cannot start.

use std::fmt;

/// An error, in words that name the file, the address or the key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Error {
    /// Whether the settings are wrong; otherwise something failed.
    pub is_usage: bool,
    message: String,
}

impl Error {
    pub(crate) fn usage(message: String) -> Self {
        Self { is_usage: true, message }
    }
    pub(crate) fn failed(message: impl fmt::Display) -> Self {
        Self { is_usage: false, message: message.to_string() }
    }
    /// Returns the same error with the name of the head.
    #[cfg(target_os = "linux")]
    pub(crate) fn in_head(self, name: &str) -> Self {
        Self { message: format!("head {name}: {}", self.message), ..self }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}
impl std::error::Error for Error {}
