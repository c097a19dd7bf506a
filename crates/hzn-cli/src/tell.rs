//! Output to the user: results on stdout, messages on stderr.
//!
//! This is the only place of the program that writes to a terminal. Messages contain texts from files, names and
//! recordings. Each function therefore makes control characters visible ([`hzn_run::terminal`]).
//!
//! Unlike `println!` and `eprintln!`, nothing here panics if the other end is closed.

use std::fmt::Display;
use std::io::{self, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

use hzn_fly::tell::Tell;
pub(crate) use hzn_run::terminal::one_line;
use hzn_run::terminal::{FileOnStdout, lines};

/// Prints a result of several lines to stdout. A name in it must be [`one_line`], or its line breaks are those of the
/// result.
///
/// # Errors
/// stdout is closed or its disk is full.
pub(crate) fn result(text: impl Display) -> io::Result<()> {
    bytes(lines(text).as_bytes())
}

/// Prints the report of a command that also writes files or has a verdict as its exit code. If the reader stops
/// (`hzn calibrate sky ... | head`), the work goes on, so that files and exit code stay the same.
///
/// # Errors
/// The disk of stdout is full.
pub(crate) fn report(text: impl Display) -> io::Result<()> {
    match result(text) {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        done => done,
    }
}

/// Prints the content of a file to stdout. It stays as it is, unless stdout is a terminal.
///
/// # Errors
/// stdout is closed or its disk is full.
pub(crate) fn file(text: impl Display) -> io::Result<()> {
    let mut out = FileOnStdout::new();
    out.write_all(text.to_string().as_bytes())?;
    out.flush()
}

/// Prints bytes to stdout that this program has made itself, unchanged.
///
/// # Errors
/// stdout is closed or its disk is full.
pub(crate) fn bytes(bytes: &[u8]) -> io::Result<()> {
    let mut out = io::stdout().lock();
    out.write_all(bytes)?;
    out.flush()
}

/// Prints a line to stderr. If stderr is closed, the message is lost and the work goes on.
pub(crate) fn line(text: impl Display) {
    let _ = writeln!(io::stderr().lock(), "{}", one_line(text));
}

/// How much is said about the work: 0 what the user must know, 1 also which files and settings are used, 2 also each
/// picture.
static LEVEL: AtomicU8 = AtomicU8::new(0);

/// The variable that sets the level where -v is not given.
const VARIABLE: &str = "HZN_LOG";

/// Sets the level from the number of -v, or else from the variable.
///
/// # Errors
/// The variable has an unknown value.
pub(crate) fn set_level(verbose: u8) -> Result<(), String> {
    let level = match (verbose, std::env::var(VARIABLE).unwrap_or_default().as_str()) {
        (0, "" | "warn") => 0,
        (0, "info") => 1,
        (0, "debug") => 2,
        (0, other) => return Err(format!("{VARIABLE}={other}: the levels are warn, info and debug")),
        (n, _) => n,
    };
    LEVEL.store(level, Ordering::Relaxed);
    Ok(())
}

/// Prints a line about files and settings to stderr, from level 1 on.
pub(crate) fn detail(text: impl FnOnce() -> String) {
    if LEVEL.load(Ordering::Relaxed) >= 1 {
        line(text());
    }
}

/// Returns whether each picture is told.
pub(crate) fn tells_pictures() -> bool {
    LEVEL.load(Ordering::Relaxed) >= 2
}

/// Returns what shows the lines of a library on stderr, from any thread.
pub(crate) fn to_stderr() -> Tell {
    Arc::new(|text: &str| line(text))
}

/// Prints a warning to stderr. It stops nothing, but the user should read it.
pub(crate) fn warning(text: impl Display) {
    line(format_args!("warning: {text}"));
}
