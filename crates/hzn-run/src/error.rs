//! Why a run cannot begin, or ends early.

use std::fmt;

use hzn_calib::Problem;

/// Why something cannot be done, in words that name the file or the key.
///
/// It is displayed as one line, causes included; what a caller offers against it is told by [`Error::remedy`].
#[derive(Debug)]
pub struct Error {
    kind: Kind,
    cause: anyhow::Error,
    remedy: Option<Remedy>,
}

/// Whose fault an error is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// An input, a path or a configuration cannot be used. Nothing was done.
    Unusable,
    /// Something failed on the way: a disk, a file that is broken.
    Failed,
}

/// What would help against an error. Each caller has its own way to offer it: an option, an argument, a button.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Remedy {
    /// The file may be replaced.
    Replace,
    /// The file may be replaced, or the run that wrote it continued.
    ReplaceOrResume,
    /// The run that left the file may be continued, or begun again.
    ResumeOrRestart,
    /// The run may be begun again.
    Restart,
    /// The topic may be left out.
    NoTopic,
    /// Files without a header can be read when their size and format are told.
    Headerless,
}

impl Error {
    /// Whose fault it is.
    pub fn kind(&self) -> Kind {
        self.kind
    }
    /// What would help, where the caller can do something about it.
    pub fn remedy(&self) -> Option<Remedy> {
        self.remedy
    }
    /// The causes.
    pub fn into_cause(self) -> anyhow::Error {
        self.cause
    }
    pub(crate) fn with(self, remedy: Remedy) -> Self {
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

/// An input, a path or a configuration that cannot be used.
pub(crate) fn unusable(message: impl fmt::Display) -> Error {
    Error { kind: Kind::Unusable, cause: anyhow::anyhow!("{message}"), remedy: None }
}

/// Something that failed.
pub(crate) fn failed(message: impl fmt::Display) -> Error {
    Error { kind: Kind::Failed, cause: anyhow::anyhow!("{message}"), remedy: None }
}
