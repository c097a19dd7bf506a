//! Builds the tests, once for all steps that need them.

use crate::machine::target;
use crate::steps::{self, Outcome, cargo};

/// Builds the tests, and with them the binaries and examples. Every step uses this same command, so nothing is built
/// twice. Another selection of packages would have other features and would build again.
pub(crate) fn build_tests() -> Outcome {
    steps::run(&mut cargo(&["test", "--no-run", "--quiet"]))?;
    if target().join("debug/hzn").exists() {
        return Ok(());
    }
    // This build makes a binary only if the tests of its own package are built.
    steps::run(&mut cargo(&["build", "--profile", "test", "--bins"]))
}
