//! hzn-core beside the OpenCV recipe, `hzn run` beside decoding alone, samplers of outliers beside each other, and what
//! Python costs beside the sensor.

use std::path::Path;
use std::process::Command;

use crate::machine::{root, target};
use crate::python;
use crate::steps::{self, Trouble, cargo};
use crate::wheel;

/// Prepares both programs and runs them in one go; `args` go to the harness.
pub(crate) fn run(args: &[String]) -> Result<(), String> {
    let go = || -> Result<(), Trouble> {
        std::env::set_current_dir(root())?;
        if let Some((first, rest)) = args.split_first()
            && first == "run"
        {
            return sequence(rest);
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
        let python = python::environment("benches", Path::new("benches/requirements.txt"))?;
        let mut harness = cargo(&["run", "--quiet", "--release", "--package", "hzn-benches"]);
        steps::run(harness.args(["--", "--python"]).arg(python).args(args))
    };
    go().map_err(|(Trouble::Failed(why) | Trouble::Missing(why))| why)
}

/// `hzn run` on a sequence of PNGs beside nothing but decoding them.
fn sequence(args: &[String]) -> Result<(), Trouble> {
    steps::run(&mut cargo(&["build", "--quiet", "--release", "--package", "hzn-cli", "--package", "hzn-benches"]))?;
    let release = target().join("release");
    steps::run(Command::new(release.join("sequence")).arg("--hzn").arg(release.join("hzn")).args(args))
}
