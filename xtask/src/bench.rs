//! Runs the benchmarks: hzn-core against the OpenCV recipe, `hzn run` against decoding alone, samplers of outliers
//! against each other, and the cost of Python compared with the sensor.

use std::path::Path;
use std::process::Command;

use crate::machine::{root, target};
use crate::python;
use crate::steps::{self, Trouble, cargo};
use crate::wheel;

/// Runs the benchmark `run`, `python` or `ransac` if `args` begins with that word. Otherwise compares hzn-core with the
/// OpenCV recipe. The remaining arguments go to the harness.
pub(crate) fn run(args: &[String]) -> Result<(), String> {
    let go = || -> Result<(), Trouble> {
        std::env::set_current_dir(root())?;
        if let Some((first, rest)) = args.split_first()
            && first == "run"
        {
            return compare_sequence(rest);
        }
        if let Some((first, rest)) = args.split_first()
            && first == "python"
        {
            return wheel::measure(rest);
        }
        if let Some((first, rest)) = args.split_first()
            && first == "ransac"
        {
            let mut samplers =
                cargo(&["run", "--quiet", "--release", "--package", "hzn-benches", "--bin", "ransac", "--"]);
            return steps::run(samplers.args(rest));
        }
        let python = python::prepare_environment("benches", Path::new("benches/requirements.txt"))?;
        // The profile in which the programs are shipped.
        let build = ["--profile", "dist", "--package", "hzn-benches", "--no-default-features"];
        let mut harness = cargo(&["run", "--quiet"]);
        harness.args(build).args(["--bin", "hzn-benches"]);
        steps::run(harness.args(["--", "--python"]).arg(python).args(args))
    };
    go().map_err(Trouble::into_message)
}

/// Compares `hzn run` on sequences with decoding alone.
fn compare_sequence(args: &[String]) -> Result<(), Trouble> {
    steps::run(&mut cargo(&["build", "--quiet", "--release", "--package", "hzn-cli", "--package", "hzn-benches"]))?;
    let release = target().join("release");
    steps::run(Command::new(release.join("sequence")).arg("--hzn").arg(release.join("hzn")).args(args))
}
