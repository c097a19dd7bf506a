//! Measures the tests themselves: which changes of the code they notice, and which lines they run.

use std::process::Command;

use crate::machine::{has, output};
use crate::steps::{self, Outcome, Trouble};

/// The version for which a seed means the same sample. Another one lists other changes.
const VERSION: &str = "25.3.1";

/// Draws changes of the core's code and counts how many the tests notice.
pub(crate) fn run(args: &[String]) -> Outcome {
    let install = format!("cargo install cargo-mutants --version {VERSION} --locked");
    if !has("cargo-mutants") {
        return Err(Trouble::Missing(format!("needs cargo-mutants: {install}")));
    }
    let version = output(Command::new("cargo-mutants").args(["mutants", "--version"])).unwrap_or_default();
    if !version.ends_with(VERSION) {
        println!("this is {version}; a seed draws another sample than with {VERSION}: {install}");
    }
    let mut command = Command::new("python3");
    command.arg("tests/python/mutants.py").args(args);
    steps::run(&mut command)
}

/// Counts the lines and branches that the tests run. The script names the tools that are missing.
pub(crate) fn coverage(args: &[String]) -> Outcome {
    steps::run(Command::new("python3").arg("tests/python/line_coverage.py").args(args))
}
