//! Output to the user: results on stdout, messages on stderr.
//!
//! This is the only place of the program that writes to a terminal. Messages contain texts from files, names and
//! recordings. Each function therefore makes control characters visible ([`hzn_run::terminal`]).
//!
//! Unlike `println!` and `eprintln!`, nothing here panics if the other end is closed.

use std::fmt::Display;
use std::io::{self, Write};
use std::sync::Arc;

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

/// Returns what shows the lines of a library on stderr, from any thread.
pub(crate) fn to_stderr() -> Tell {
    Arc::new(|text: &str| line(text))
}

/// Prints a warning to stderr. It stops nothing, but the user should read it.
pub(crate) fn warning(text: impl Display) {
    line(format_args!("warning: {text}"));
}
