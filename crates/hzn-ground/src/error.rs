//! The reasons why the ground station cannot begin, or ends early.

use std::fmt::Display;

use hzn_files::Problem;

/// An error of the ground station.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A command, a line or an output cannot be used. Nothing was done.
    #[error("{0}")]
    Unusable(String),
    /// Something failed while packets came or went.
    #[error("{0}")]
    Failed(String),
    /// A sensor.toml to load is refused.
    #[error(transparent)]
    Sensor(#[from] Problem),
    /// An output is refused, or cannot be written.
    #[error(transparent)]
    Output(#[from] hzn_run::Error),
    /// The system refuses a thread or a write.
    #[error(transparent)]
    System(#[from] std::io::Error),
}

impl Error {
    pub(crate) fn unusable(message: impl Display) -> Self {
        Self::Unusable(message.to_string())
    }
    pub(crate) fn failed(message: impl Display) -> Self {
        Self::Failed(message.to_string())
    }
}
