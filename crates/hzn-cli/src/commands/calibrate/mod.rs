//! `hzn calibrate`: measures values of a sensor.toml on pictures.

mod board;
mod board_search;
mod board_size;
mod check;
mod flight;
mod lens_output;
mod lens_page;
mod lens_text;
mod mount;
mod mount_tilts;
mod noise;
mod page;
mod points;
mod rig;
mod rig_text;
mod sky;
mod sky_args;
mod sky_text;
mod text;
mod track;

use crate::exit::Outcome;

/// Measure values of a sensor.toml on pictures
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, clap::Subcommand)]
enum Command {
    Board(board::Args),
    Points(points::Args),
    Sky(sky_args::Args),
    Check(check::Args),
    Noise(noise::Args),
    Mount(mount::Args),
    Rig(rig::Args),
}

pub(super) fn run(args: &Args) -> Outcome {
    match &args.command {
        Command::Board(args) => board::run(args),
        Command::Points(args) => points::run(args),
        Command::Sky(args) => sky::run(args),
        Command::Check(args) => check::run(args),
        Command::Noise(args) => noise::run(args),
        Command::Mount(args) => mount::run(args),
        Command::Rig(args) => rig::run(args),
    }
}
