//! The command `hzn`: it turns a sequence of pictures into directions with covariances, in files that other programs
//! can read.
//!
//! `main.rs` turns the result of [`main`] into an exit code. Each command has one file in [`commands`] and is built
//! from the parts of `hzn-run`. This crate has the arguments, the progress bar, the exit codes ([`exit`]) and the
//! reports.

#![deny(clippy::print_stdout, clippy::print_stderr, reason = "they panic when the output is closed; `tell` does not")]

mod apid;
pub mod commands;
mod doubts;
pub mod exit;
mod files;
mod html;
mod kind_of_file;
mod limbs_of_rig;
mod origin;
mod progress;
mod refusals;
#[cfg(feature = "simulator")]
mod rendered;
mod setup;
mod tell;
mod what_fits;

use std::ffi::OsString;

use clap::FromArgMatches;
use clap::error::{ContextKind, ContextValue, ErrorKind};

use exit::Exit;

/// Runs the command line and returns how it ended. Errors are printed on stderr.
pub fn main() -> Exit {
    report_file_size_limit();
    match commands::run(parse()) {
        Ok(exit) => exit,
        Err(stop) => {
            // A reader that has read enough (`hzn run ... | head`) is not an error worth a message.
            if !is_broken_pipe(&stop.error) {
                tell::line(format_args!("error: {:#}", stop.error));
                stop.details.iter().for_each(tell::line);
            }
            stop.exit
        }
    }
}

/// Parses the command line. clap itself prints help and usage errors, and exits with 0 or 2.
fn parse() -> commands::Cli {
    read(std::env::args_os()).unwrap_or_else(|error| {
        // clap prints refused arguments as they are, so it gets them once more without control characters.
        let shown = std::env::args_os().map(|word| tell::one_line(word.to_string_lossy()).into());
        let mut error = read(shown).err().unwrap_or(error);
        name_commands(&mut error);
        error.exit()
    })
}

/// Reads the words of a command line.
fn read(words: impl Iterator<Item = OsString>) -> Result<commands::Cli, clap::Error> {
    let mut command = commands::command();
    let matches = command.try_get_matches_from_mut(words)?;
    commands::Cli::from_arg_matches(&matches).map_err(|e| e.format(&mut command))
}

/// Adds the list of commands to the error about an unknown one, unless the error has a suggestion.
fn name_commands(error: &mut clap::Error) {
    if error.kind() != ErrorKind::InvalidSubcommand || error.get(ContextKind::SuggestedSubcommand).is_some() {
        return;
    }
    let command = commands::command();
    let names: Vec<String> = command.get_subcommands().map(|c| c.get_name().to_owned()).collect();
    let tip = format!("the commands are {}", names.join(", "));
    error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip.into()]));
}

/// Makes a write beyond the limit of the file size (`ulimit -f`) an error with a message. Without this, a signal ends
/// the program without a word. The threads that are started later inherit the setting.
fn report_file_size_limit() {
    #[cfg(unix)]
    {
        use nix::sys::signal::{SigSet, Signal};
        // If it fails, the program ends by the signal as before.
        let _ = SigSet::from(Signal::SIGXFSZ).thread_block();
    }
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    let broken = |e: &std::io::Error| e.kind() == std::io::ErrorKind::BrokenPipe;
    error.chain().any(|e| e.downcast_ref::<std::io::Error>().is_some_and(broken))
}
