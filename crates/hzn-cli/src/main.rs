//! The command `hzn`.

use std::process::ExitCode;

fn main() -> ExitCode {
    hzn_cli::main().into()
}
