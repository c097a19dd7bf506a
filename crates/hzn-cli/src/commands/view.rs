//! `hzn view`: starts the viewer.

use std::ffi::OsString;
use std::process::Command;

use crate::exit::{Exit, Outcome, failed};

/// Show what the sensor saw, and tune it live
///
/// Starts `hzn-viewer`, which must be next to `hzn` or on PATH. Arguments are those of `hzn-viewer --help`.
#[derive(Debug, clap::Args)]
#[command(disable_help_flag = true)]
pub(super) struct Args {
    /// A recording, a folder, pictures, a video or a rig.toml, and options of `hzn-viewer`
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, value_name = "ARGUMENTS")]
    arguments: Vec<OsString>,
}

pub(super) fn run(args: &Args) -> Outcome {
    let name = format!("hzn-viewer{}", std::env::consts::EXE_SUFFIX);
    let neighbour = std::env::current_exe().ok().map(|own| own.with_file_name(&name)).filter(|p| p.is_file());
    let program = neighbour.unwrap_or_else(|| name.into());
    let status = Command::new(&program).args(&args.arguments).status().map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => failed(
            "`hzn-viewer` is neither next to `hzn` nor on PATH; `cargo install --path crates/hzn-viewer` installs it",
        ),
        _ => failed(format!("{} cannot be started: {e}", program.display())),
    })?;
    // The viewer has already printed the reason.
    Ok(match status.code() {
        Some(0) => Exit::Done,
        Some(2) => Exit::Usage,
        _ => Exit::Failed,
    })
}
