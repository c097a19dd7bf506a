//! Exit codes, and errors with their exit code.

use std::process::ExitCode;

use hzn_files::Problem;
use hzn_run::{Kind, Remedy};

/// Exit codes. The numbers are fixed: scripts rely on them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Exit {
    /// Every picture was read and processed.
    Done = 0,
    /// Something failed during the run, for example a disk or a broken file.
    Failed = 1,
    /// The command line or a configuration is wrong; nothing was done.
    Usage = 2,
    /// The run finished, but some pictures could not be read.
    SomeUnreadable = 3,
    /// The run was interrupted; its output is valid and can be continued.
    Interrupted = 130,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

/// An error with its exit code.
#[derive(Debug)]
pub struct Stop {
    /// The code.
    pub exit: Exit,
    /// What went wrong and what to do.
    pub error: anyhow::Error,
    /// Further lines about it, for example one for each picture.
    pub details: Vec<String>,
}

impl Stop {
    /// Returns the error with its exit code.
    pub fn new(exit: Exit, error: anyhow::Error) -> Self {
        Self { exit, error, details: Vec::new() }
    }
    /// Adds lines about the error.
    pub(crate) fn with_details(self, details: impl IntoIterator<Item = String>) -> Self {
        Self { details: details.into_iter().collect(), ..self }
    }
}

/// The result of a command.
pub type Outcome = Result<Exit, Stop>;

impl From<anyhow::Error> for Stop {
    fn from(error: anyhow::Error) -> Self {
        Self::new(Exit::Failed, error)
    }
}

impl From<std::io::Error> for Stop {
    fn from(error: std::io::Error) -> Self {
        Self::new(Exit::Failed, error.into())
    }
}

impl From<hzn_run::Error> for Stop {
    fn from(error: hzn_run::Error) -> Self {
        let exit = match error.kind() {
            Kind::Unusable => Exit::Usage,
            Kind::Failed => Exit::Failed,
        };
        let error = match error.remedy().and_then(option) {
            Some(option) => anyhow::anyhow!("{error}; {option}"),
            // A closed pipe is recognised by its type, which a boxed error hides.
            None => {
                error.into_cause().downcast::<std::io::Error>().map_or_else(anyhow::Error::from_boxed, |e| (*e).into())
            }
        };
        Self::new(exit, error)
    }
}

/// Returns the option of the command line that helps against an error.
fn option(remedy: Remedy) -> Option<&'static str> {
    Some(match remedy {
        Remedy::Replace => "--force replaces it",
        Remedy::ReplaceOrResume => "--force replaces it, --resume continues it",
        Remedy::ResumeOrRestart => "--resume continues it, --force starts over",
        Remedy::Restart => "--force starts over",
        Remedy::NoTopic => "leave out --topic, or give an MCAP as the input",
        Remedy::Headerless => "--raw reads files without a header",
        Remedy::Sensor => "--sensor FILE names another one",
        Remedy::Altitude => "or give --altitude-km",
        _ => return None,
    })
}

impl From<hzn_ground::Error> for Stop {
    fn from(error: hzn_ground::Error) -> Self {
        match error {
            hzn_ground::Error::Unusable(message) => usage(message),
            hzn_ground::Error::Sensor(problem) => problem.into(),
            hzn_ground::Error::Output(error) => error.into(),
            hzn_ground::Error::System(error) => error.into(),
            error => failed(error),
        }
    }
}

impl From<hzn_plot::Error> for Stop {
    fn from(error: hzn_plot::Error) -> Self {
        Self::new(Exit::Failed, error.into())
    }
}

impl From<Problem> for Stop {
    fn from(problem: Problem) -> Self {
        Self::new(Exit::Usage, problem.into())
    }
}

/// Returns the error for a wrong command line or configuration.
pub fn usage(message: impl std::fmt::Display) -> Stop {
    Stop::new(Exit::Usage, anyhow::anyhow!("{message}"))
}

/// Returns the error for a file of which nothing could be read.
pub fn unreadable(message: impl std::fmt::Display) -> Stop {
    Stop::new(Exit::SomeUnreadable, anyhow::anyhow!("{message}"))
}

/// Returns the error for something that failed.
pub fn failed(message: impl std::fmt::Display) -> Stop {
    Stop::new(Exit::Failed, anyhow::anyhow!("{message}"))
}
