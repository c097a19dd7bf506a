//! The command `hzn-viewer`.

use std::process::ExitCode;

use clap::Parser;
use hzn_run::terminal;

fn main() -> ExitCode {
    let args = match hzn_viewer::args::Args::try_parse() {
        Ok(args) => args,
        Err(refused) if refused.use_stderr() => {
            eprint!("{}", terminal::lines(refused));
            return ExitCode::from(2);
        }
        Err(help) => help.exit(),
    };
    match hzn_viewer::run::run(&args) {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("error: {}", terminal::lines(format_args!("{e:#}")));
            ExitCode::FAILURE
        }
    }
}
