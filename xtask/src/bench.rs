//! hzn-core beside the OpenCV recipe.

use std::path::Path;

use crate::machine::root;
use crate::python;
use crate::steps::{self, Trouble, cargo};

/// Prepares both programs and runs them in one go; `args` go to the harness.
pub(crate) fn run(args: &[String]) -> Result<(), String> {
    let go = || -> Result<(), Trouble> {
        std::env::set_current_dir(root())?;
        let python = python::environment("benches", Path::new("benches/requirements.txt"))?;
        let mut harness = cargo(&["run", "--quiet", "--release", "--package", "hzn-benches"]);
        steps::run(harness.args(["--", "--python"]).arg(python).args(args))
    };
    go().map_err(|(Trouble::Failed(why) | Trouble::Missing(why))| why)
}
