//! `hzn calibrate`: numbers of a sensor.toml from pictures.

mod noise;
mod page;
mod text;

use crate::exit::Outcome;

/// Measure what a sensor.toml says, from pictures
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, clap::Subcommand)]
enum Command {
    Noise(noise::Args),
}

pub(super) fn run(args: &Args) -> Outcome {
    match &args.command {
        Command::Noise(args) => noise::run(args),
    }
}
