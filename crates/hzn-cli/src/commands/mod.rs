//! The commands, one file for each.

mod calibrate;
mod camera;
mod completions;
#[cfg(feature = "simulator")]
mod demo;
mod evaluate;
mod examples;
mod explain;
mod export;
mod export_instruments;
mod export_pictures;
#[cfg(target_os = "linux")]
mod fly;
mod fuse;
mod ground;
mod info;
mod init;
mod init_rig;
mod key;
mod lens_model;
mod man;
mod migrate;
mod prepare;
mod recover;
mod resume;
mod run;
mod schema;
#[cfg(feature = "simulator")]
mod sensitivity;
#[cfg(feature = "simulator")]
mod simulate;
mod telecommand;
mod telemetry;
mod view;

use clap::{CommandFactory, Parser, Subcommand};

use crate::exit::{Outcome, usage};
use crate::tell;

/// The version with what is needed to build the same program again. The methods are features of `hzn-core` that the
/// manifest of this crate turns on; a test compares them.
const LONG_VERSION: &str = concat!(
    env!("CARGO_PKG_VERSION"),
    "\ncommit   ",
    env!("HZN_BUILD_COMMIT"),
    "\ntarget   ",
    env!("HZN_BUILD_TARGET"),
    "\nprofile  ",
    env!("HZN_BUILD_PROFILE"),
    "\nfeatures dlr, erf, horace, position, reml, zju"
);

/// Find the limb of a planet in pictures, and measure the direction to the body with its covariance.
///
/// Exit codes: 0 every picture was read and processed; 1 failed; 2 wrong usage or configuration; 3 finished, but some
/// pictures could not be read or had no altitude; 130 interrupted (the output is valid and can be continued with
/// --resume).
#[derive(Debug, Parser)]
#[command(name = "hzn", version, long_version = LONG_VERSION, max_term_width = 100)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Say which files and settings are used; twice, also the result of each picture. HZN_LOG=info and HZN_LOG=debug do
    /// the same
    #[arg(short, long, global = true, action = clap::ArgAction::Count)]
    verbose: u8,
}

#[derive(Debug, Subcommand)]
enum Command {
    #[cfg(feature = "simulator")]
    Demo(demo::Args),
    Run(Box<run::Args>),
    Explain(explain::Args),
    Info(info::Args),
    Export(export::Args),
    Recover(recover::Args),
    Fuse(Box<fuse::Args>),
    #[cfg(feature = "simulator")]
    Simulate(simulate::Args),
    Init(init::Args),
    Migrate(migrate::Args),
    Prepare(prepare::Args),
    Evaluate(evaluate::Args),
    #[cfg(feature = "simulator")]
    Sensitivity(Box<sensitivity::Args>),
    Calibrate(calibrate::Args),
    Camera(camera::Args),
    #[cfg(target_os = "linux")]
    Fly(fly::Args),
    Key(key::Args),
    Telemetry(telemetry::Args),
    Telecommand(telecommand::Args),
    View(view::Args),
    Schema(schema::Args),
    Completions(completions::Args),
    Man(man::Args),
}

/// Returns the whole command line, with the examples of each command.
pub fn command() -> clap::Command {
    examples::add(with_negative_numbers(Cli::command()))
}

/// Returns a command whose options take a negative number as their value. Without this, clap takes `-1` after `--jobs`
/// for another option, and the message does not name the number as the fault.
fn with_negative_numbers(command: clap::Command) -> clap::Command {
    let takes_value = |arg: &clap::Arg| !arg.is_positional() && arg.get_action().takes_values();
    let command = command.mut_args(|arg| if takes_value(&arg) { arg.allow_negative_numbers(true) } else { arg });
    command.mut_subcommands(with_negative_numbers)
}

/// Runs one command.
///
/// # Errors
/// The error, with its exit code.
pub fn run(cli: Cli) -> Outcome {
    tell::set_level(cli.verbose).map_err(usage)?;
    match cli.command {
        #[cfg(feature = "simulator")]
        Command::Demo(args) => demo::run(&args),
        Command::Run(args) => run::run(*args),
        Command::Explain(args) => explain::run(&args),
        Command::Info(args) => info::run(&args),
        Command::Export(args) => export::run(&args),
        Command::Recover(args) => recover::run(&args),
        Command::Fuse(args) => fuse::run(&args),
        #[cfg(feature = "simulator")]
        Command::Simulate(args) => simulate::run(&args),
        Command::Init(args) => init::run(&args),
        Command::Migrate(args) => migrate::run(&args),
        Command::Prepare(args) => prepare::run(&args),
        Command::Evaluate(args) => evaluate::run(&args),
        #[cfg(feature = "simulator")]
        Command::Sensitivity(args) => sensitivity::run(&args),
        Command::Calibrate(args) => calibrate::run(&args),
        Command::Camera(args) => camera::run(&args),
        #[cfg(target_os = "linux")]
        Command::Fly(args) => fly::run(args),
        Command::Key(args) => key::run(&args),
        Command::Telemetry(args) => telemetry::run(&args),
        Command::Telecommand(args) => telecommand::run(&args),
        Command::View(args) => view::run(&args),
        Command::Schema(args) => schema::run(&args),
        Command::Completions(args) => completions::run(&args, command()),
        Command::Man(args) => man::run(&args, command()),
    }
}
