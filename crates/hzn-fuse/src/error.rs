//! The reasons why a flight cannot be fused.

use crate::finding::Finding;

/// An error, in words that name the file, the line or the key.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// An input cannot be used. Nothing was written.
    #[error("{0}")]
    Unusable(String),
    /// No solution is possible, and the inputs contradict each other. Nothing was written.
    #[error(
        "the inputs contradict each other, probably because {}. With them there is no solution: {why}",
        .finding.what
    )]
    Contradicts {
        /// Why there is no solution.
        why: String,
        /// The likeliest cause.
        finding: Box<Finding>,
    },
    /// Something failed, for example a disk.
    #[error("{0}")]
    Failed(String),
}

impl Error {
    pub(crate) fn unusable(message: impl std::fmt::Display) -> Self {
        Self::Unusable(message.to_string())
    }
    /// This program cannot solve a whole flight.
    pub(crate) fn without_solver() -> Self {
        Self::unusable(
            "this hzn was built without the feature `solve`, so that it compiles faster; the whole command is built by \
             cargo install --locked --path crates/hzn-cli",
        )
    }
    pub(crate) fn failed(message: impl std::fmt::Display) -> Self {
        Self::Failed(message.to_string())
    }
}

impl From<hzn_run::Error> for Error {
    fn from(error: hzn_run::Error) -> Self {
        match error.kind() {
            hzn_run::Kind::Unusable => Self::unusable(error),
            hzn_run::Kind::Failed => Self::failed(error),
        }
    }
}
