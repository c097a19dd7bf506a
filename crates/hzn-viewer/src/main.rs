//! The command `hzn-viewer`.

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    match hzn_viewer::run::run(&hzn_viewer::args::Args::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("error: {e:#}");
            ExitCode::FAILURE
        }
    }
}
