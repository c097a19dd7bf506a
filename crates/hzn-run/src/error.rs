//! The reasons why a run cannot begin, or ends early.

use std::fmt;

use hzn_calib::Problem;

/// An error of a run, in words that name the file or the key.
///
/// It is displayed as one line that includes the causes. [`Error::remedy`] says what a caller can offer against it.
#[derive(Debug)]
pub struct Error {
    kind: Kind,
    cause: anyhow::Error,
    remedy: Option<Remedy>,
}

/// The source of an error: the input, or a failure during the run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// An input, a path or a configuration cannot be used. Nothing was done.
    Unusable,
    /// Something failed during the run, for example a disk or a broken file.
    Failed,
}

/// A remedy against an error. Each caller offers it in its own form: an option, an argument, a button.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Remedy {
    /// The caller may replace the file.
    Replace,
    /// The caller may replace the file, or continue the run that wrote it.
    ReplaceOrResume,
    /// The caller may continue the run that left the file, or start it again.
    ResumeOrRestart,
    /// The caller may start the run again.
    Restart,
    /// The caller may leave out the topic.
    NoTopic,
    /// The caller may give the size and format of files without a header.
    Headerless,
}

impl Error {
    /// Returns whether the input is unusable or something failed.
    pub fn kind(&self) -> Kind {
        self.kind
    }
    /// Returns the remedy, if the caller can do something against the error.
    pub fn remedy(&self) -> Option<Remedy> {
        self.remedy
    }
    /// Returns the error with its causes.
    pub fn into_cause(self) -> anyhow::Error {
        self.cause
    }
    pub(crate) fn with_remedy(self, remedy: Remedy) -> Self {
        Self { remedy: Some(remedy), ..self }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:#}", self.cause)
    }
}

impl std::error::Error for Error {}

impl From<anyhow::Error> for Error {
    fn from(cause: anyhow::Error) -> Self {
        Self { kind: Kind::Failed, cause, remedy: None }
    }
}

impl From<std::io::Error> for Error {
    fn from(error: std::io::Error) -> Self {
        Self { kind: Kind::Failed, cause: error.into(), remedy: None }
    }
}

impl From<Problem> for Error {
    fn from(problem: Problem) -> Self {
        Self { kind: Kind::Unusable, cause: problem.into(), remedy: None }
    }
}

/// Returns an error for an input, a path or a configuration that cannot be used.
pub(crate) fn unusable(message: impl fmt::Display) -> Error {
    Error { kind: Kind::Unusable, cause: anyhow::anyhow!("{message}"), remedy: None }
}

/// Returns an error for something that failed.
pub(crate) fn failed(message: impl fmt::Display) -> Error {
    Error { kind: Kind::Failed, cause: anyhow::anyhow!("{message}"), remedy: None }
}
