//! `hzn schema`: prints the JSON schema of a file.

use crate::exit::{Exit, Outcome};
use crate::tell;

/// Print the JSON schema of a file, with which an editor completes its keys and marks wrong values
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The file
    #[arg(value_enum)]
    file: File,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum File {
    /// A sensor
    #[value(name = "sensor.toml")]
    Sensor,
    /// A scene of the simulator
    #[cfg(feature = "simulator")]
    #[value(name = "scene.toml")]
    Scene,
    /// One row of the table of the pictures; an empty cell is null
    #[value(name = "frames.csv")]
    Frames,
}

/// Prints the schema.
pub(super) fn run(args: &Args) -> Outcome {
    let text = |schema| serde_json::to_string_pretty(&schema).map(|text| text + "\n").map_err(anyhow::Error::from);
    let text = match args.file {
        File::Sensor => text(hzn_files::keys::schema::json())?,
        #[cfg(feature = "simulator")]
        File::Scene => hzn_sim::scenario::SCHEMA.to_owned(),
        File::Frames => text(hzn_files::frames::schema())?,
    };
    tell::bytes(text.as_bytes())?;
    Ok(Exit::Done)
}
