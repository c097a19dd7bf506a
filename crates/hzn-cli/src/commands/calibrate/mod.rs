//! `hzn calibrate`: measures values of a sensor.toml on pictures.

mod noise;
mod page;
mod text;

use crate::exit::Outcome;

/// Measure values of a sensor.toml on pictures
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
