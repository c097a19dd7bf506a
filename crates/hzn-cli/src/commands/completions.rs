//! `hzn completions`: prints completions for a shell.

use crate::exit::{Exit, Outcome};
use crate::tell;

/// Print completions for a shell
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The shell
    #[arg(value_enum)]
    shell: Shell,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Shell {
    Bash,
    Zsh,
    Fish,
    Powershell,
    Elvish,
}

/// Prints the completions of `command`.
pub(super) fn run(args: &Args, mut command: clap::Command) -> Outcome {
    let shell = match args.shell {
        Shell::Bash => clap_complete::Shell::Bash,
        Shell::Zsh => clap_complete::Shell::Zsh,
        Shell::Fish => clap_complete::Shell::Fish,
        Shell::Powershell => clap_complete::Shell::PowerShell,
        Shell::Elvish => clap_complete::Shell::Elvish,
    };
    // The text goes to memory first, because the generator panics when stdout is closed early.
    let mut text = Vec::new();
    clap_complete::generate(shell, &mut command, "hzn", &mut text);
    tell::bytes(&text)?;
    Ok(Exit::Done)
}
