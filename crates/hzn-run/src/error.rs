//! The reasons why a run cannot begin, or ends early.

use std::error::Error as StdError;
use std::fmt;

use hzn_files::Problem;

/// An error of a run, in words that name the file or the key.
///
/// It is displayed as one line that includes the causes. [`Error::remedy`] says what a caller can offer against it.
#[derive(Debug)]
pub struct Error {
    kind: Kind,
    cause: Box<dyn StdError + Send + Sync>,
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
    /// The caller may give a sensor.toml.
    Sensor,
    /// The caller may give an altitude for all pictures.
    Altitude,
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
    /// Returns an error for something that failed, with its causes. A source or a sink of another crate ends the run
    /// with it.
    pub fn failed(cause: impl Into<Box<dyn StdError + Send + Sync>>) -> Self {
        Self { kind: Kind::Failed, cause: cause.into(), remedy: None }
    }
    /// Returns the error with its causes.
    pub fn into_cause(self) -> Box<dyn StdError + Send + Sync> {
        self.cause
    }
    pub(crate) fn with_remedy(self, remedy: Remedy) -> Self {
        Self { remedy: Some(remedy), ..self }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.cause)?;
        let mut cause = self.cause.source();
        while let Some(error) = cause {
            write!(f, ": {error}")?;
            cause = error.source();
        }
        Ok(())
    }
}

// The causes are in the text already, so they are no sources.
impl StdError for Error {}

impl From<std::io::Error> for Error {
    fn from(error: std::io::Error) -> Self {
        Self::failed(error)
    }
}

impl From<Problem> for Error {
    fn from(problem: Problem) -> Self {
        Self { kind: Kind::Unusable, cause: problem.into(), remedy: None }
    }
}

/// Returns an error for an input, a path or a configuration that cannot be used.
pub(crate) fn unusable(message: impl fmt::Display) -> Error {
    Error { kind: Kind::Unusable, cause: message.to_string().into(), remedy: None }
}

/// Returns an error for something that failed.
pub(crate) fn failed(message: impl fmt::Display) -> Error {
    Error::failed(message.to_string())
}

#[cfg(test)]
mod tests {
    use std::io;

    use super::*;

    /// An error with a cause.
    #[derive(Debug)]
    struct Outer(io::Error);

    impl fmt::Display for Outer {
        fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("the table is lost")
        }
    }

    impl StdError for Outer {
        fn source(&self) -> Option<&(dyn StdError + 'static)> {
            Some(&self.0)
        }
    }

    #[test]
    fn an_error_names_its_causes_and_keeps_them() {
        let error = Error::failed(Outer(io::Error::new(io::ErrorKind::BrokenPipe, "closed")));
        assert_eq!((error.to_string().as_str(), error.kind()), ("the table is lost: closed", Kind::Failed));
        let cause = error.into_cause();
        let io = cause.source().and_then(|e| e.downcast_ref::<io::Error>()).unwrap();
        assert_eq!(io.kind(), io::ErrorKind::BrokenPipe);
    }
}
