//! `hzn init`: a sensor.toml to start from.

use std::path::PathBuf;

use crate::exit::{Exit, Outcome, usage};
use crate::output;
use crate::tell;

/// Write a commented sensor.toml to start from
///
/// Every key stands in it with its default, so that only the camera must be filled in.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The file to write
    #[arg(default_value = "sensor.toml")]
    file: PathBuf,
    /// Replace a file that exists
    #[arg(long)]
    force: bool,
}

pub(super) fn run(args: &Args) -> Outcome {
    let name = args.file.display();
    if args.file.exists() && !args.force {
        return Err(usage(format!("{name}: exists already; choose another name, or --force replaces it")));
    }
    std::fs::write(&args.file, hzn_calib::template::SENSOR_TOML).map_err(|e| output::cannot(&args.file, &e))?;
    tell::line(format_args!("{name} written; fill in [camera], then look at it with  hzn camera show {name}"));
    Ok(Exit::Done)
}
