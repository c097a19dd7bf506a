//! What is said to the user: results on stdout, messages on stderr.
//!
//! Nothing here panics, as `println!` and `eprintln!` do, when the other end is closed.

use std::fmt::Display;
use std::io::{self, Write};

/// A result, to stdout, as it stands.
///
/// # Errors
/// stdout is closed or its disk is full.
pub(crate) fn result(text: impl Display) -> io::Result<()> {
    let mut out = io::stdout().lock();
    write!(out, "{text}")?;
    out.flush()
}

/// A line to stderr. Where stderr is closed there is nobody left to tell, and the work goes on.
pub(crate) fn line(text: impl Display) {
    let _ = writeln!(io::stderr().lock(), "{text}");
}

/// A line to stderr about something that stops nothing but that the user should look at.
pub(crate) fn warning(text: impl Display) {
    line(format_args!("warning: {text}"));
}
