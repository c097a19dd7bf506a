//! Output to the user: results on stdout, messages on stderr.
//!
//! Unlike `println!` and `eprintln!`, nothing here panics if the other end is closed.

use std::fmt::Display;
use std::io::{self, Write};

/// Prints a result to stdout, unchanged.
///
/// # Errors
/// stdout is closed or its disk is full.
pub(crate) fn result(text: impl Display) -> io::Result<()> {
    let mut out = io::stdout().lock();
    write!(out, "{text}")?;
    out.flush()
}

/// Prints a line to stderr. If stderr is closed, the message is lost and the work goes on.
pub(crate) fn line(text: impl Display) {
    let _ = writeln!(io::stderr().lock(), "{text}");
}

/// Prints a warning to stderr. It stops nothing, but the user should read it.
pub(crate) fn warning(text: impl Display) {
    line(format_args!("warning: {text}"));
}
