//! Loads the dictionary into Yamcs and flies with it, and checks the component for F´ with the tools of F´.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::machine::{apt_install, has, target};
use crate::python;
use crate::steps::{self, Outcome};
use crate::test_build::build_tests;

/// Runs both checks. They need packages of Python; Yamcs also needs Java 17 with its compiler.
pub(crate) fn test() -> Outcome {
    let python = python::prepare_environment("ground", Path::new("tests/yamcs/requirements.txt"))?;
    let folder = |name: &str| target().join("xtask").join(name);
    steps::run(Command::new(&python).arg("tests/python/check_component.py").arg(folder("component")))?;
    if !has("javac") {
        apt_install(&["default-jdk-headless"])?;
    }
    build_tests()?;
    if folder("yamcs").exists() {
        fs::remove_dir_all(folder("yamcs"))?;
    }
    let programs = ["debug/hzn", "debug/examples/telemetry_packets"].map(|program| target().join(program));
    steps::run(Command::new(python).arg("tests/python/yamcs_loads.py").args(programs).arg(folder("yamcs")))
}
