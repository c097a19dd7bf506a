//! `hzn man`: the help of the commands as manual pages.

use std::path::PathBuf;

use clap::Command;
use clap_mangen::Man;
use hzn_run::disk;

use crate::exit::{Exit, Outcome, Stop, usage};
use crate::files;
use crate::tell;

/// Print a manual page, or write those of all commands
///
/// The pages have the same text as --help. They are in the format of man(1).
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The words of a command, such as `run` or `calibrate sky`; without them, the page of `hzn`
    #[arg(value_name = "COMMAND")]
    command: Vec<String>,
    /// Write the pages of all commands into this folder: hzn.1, hzn-run.1, ...
    #[arg(short, long, value_name = "DIR", conflicts_with = "command")]
    output: Option<PathBuf>,
    /// Replace pages that exist
    #[arg(long, requires = "output")]
    force: bool,
}

/// Prints the pages of `command`, or writes them.
pub(super) fn run(args: &Args, command: Command) -> Outcome {
    let mut command = command.disable_help_subcommand(true);
    // The names of the pages, such as hzn-run, are known after this.
    command.build();
    let Some(folder) = &args.output else {
        tell::bytes(&page(find(command, &args.command)?)?.1)?;
        return Ok(Exit::Done);
    };
    let mut commands = Vec::new();
    collect(command, &mut commands);
    let pages = commands.into_iter().map(page).collect::<Result<Vec<_>, _>>()?;
    std::fs::create_dir_all(folder).map_err(|e| disk::cannot_write(folder, &e))?;
    let paths: Vec<PathBuf> = pages.iter().map(|(name, _)| folder.join(name)).collect();
    files::check_outputs(&[], &paths, args.force)?;
    for (path, (_, text)) in paths.iter().zip(pages) {
        disk::write(path, text)?;
    }
    Ok(Exit::Done)
}

/// Returns the subcommand with these words.
fn find(command: Command, words: &[String]) -> Result<Command, Stop> {
    words.iter().try_fold(command, |command, word| match command.find_subcommand(word) {
        Some(found) => Ok(found.clone()),
        None => {
            let names: Vec<&str> = command.get_subcommands().map(Command::get_name).collect();
            let known = if names.is_empty() { "it has no commands".to_owned() } else { names.join(", ") };
            Err(usage(format!("{} has no command \"{word}\": {known}", command.get_name())))
        }
    })
}

/// Adds the command and all of its subcommands.
fn collect(command: Command, all: &mut Vec<Command>) {
    let inner: Vec<Command> = command.get_subcommands().cloned().collect();
    all.push(command);
    inner.into_iter().for_each(|command| collect(command, all));
}

/// Returns the file name of a page, and its text.
fn page(command: Command) -> Result<(String, Vec<u8>), Stop> {
    let man = Man::new(command);
    // The text goes to memory first, because stdout may be closed early.
    let mut text = Vec::new();
    man.render(&mut text)?;
    Ok((man.get_filename(), text))
}
