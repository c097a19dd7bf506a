//! Runs the tests of hzn-twice in Miri, an interpreter that finds undefined behaviour.
//!
//! Only rustup has Miri, with its nightly toolchain, and rustup's server is not always reachable. Therefore nothing is
//! installed here, and a machine without Miri passes with a message, with `CI=true`, too.

use std::path::Path;
use std::process::Command;

use crate::machine::output;
use crate::steps::{self, Outcome};

/// Runs the step.
pub(crate) fn test() -> Outcome {
    if !has_miri() {
        println!("Miri is not installed, so undefined behaviour in hzn-twice is not looked for.");
        println!("It comes with: rustup toolchain install nightly --component miri,rust-src");
        return Ok(());
    }
    steps::run(nightly(&["cargo", "miri", "test", "--locked", "--package", "hzn-twice"]).env_remove("RUSTC"))
}

/// Returns whether Miri and the sources that it interprets are here. Without the sources Miri would download them.
fn has_miri() -> bool {
    let sysroot = output(&mut nightly(&["rustc", "--print", "sysroot"]));
    let has_sources = sysroot.is_some_and(|path| Path::new(&path).join("lib/rustlib/src/rust/library").is_dir());
    has_sources && output(&mut nightly(&["cargo", "miri", "--version"])).is_some()
}

/// Returns a call of the nightly toolchain, which is not installed if it is missing. The cargo that runs this program
/// is no call of rustup, so it does not know `+nightly`.
fn nightly(args: &[&str]) -> Command {
    let mut command = Command::new("rustup");
    command.args(["run", "nightly"]).args(args).env("RUSTUP_AUTO_INSTALL", "0");
    command
}
