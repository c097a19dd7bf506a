//! The command `hzn`: from a sequence of pictures to directions with covariances, in files that others can read.
//!
//! `main.rs` turns [`main`]'s answer into an exit code. Commands live in [`commands`], one file each; they are put
//! together from what `hzn-run` has. Here are the arguments, the progress bar, the exit codes ([`exit`]) and the charts
//! of reports ([`plot`]).

#![deny(clippy::print_stdout, clippy::print_stderr, reason = "they panic when nobody reads; `tell` does not")]

pub mod commands;
pub mod exit;
pub mod plot;
mod progress;
mod refusals;
mod setup;
mod tell;

use clap::Parser;

use exit::Exit;

/// Runs the command line and says how it ended. Errors are printed on stderr.
pub fn main() -> Exit {
    // clap itself prints help and usage errors, and leaves with 0 or 2.
    let cli = commands::Cli::parse();
    match commands::run(cli) {
        Ok(exit) => exit,
        Err(stop) => {
            // A reader that has seen enough (`hzn run ... | head`) is no error worth a message.
            if !is_broken_pipe(&stop.error) {
                tell::line(format_args!("error: {:#}", stop.error));
            }
            stop.exit
        }
    }
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    let broken = |e: &std::io::Error| e.kind() == std::io::ErrorKind::BrokenPipe;
    error.chain().any(|e| e.downcast_ref::<std::io::Error>().is_some_and(broken))
}
