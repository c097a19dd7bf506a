//! Runs the campaigns: they compare our numbers with the published ones and write book/results/reproduction.md.

use crate::machine::root;
use crate::steps::{self, Trouble, cargo};

/// Builds the campaigns and runs those that `args` names.
pub(crate) fn run(args: &[String]) -> Result<(), String> {
    let go = || -> Result<(), Trouble> {
        std::env::set_current_dir(root())?;
        let mut campaigns = cargo(&["run", "--quiet", "--release", "--package", "hzn-reproduce"]);
        steps::run(campaigns.arg("--").args(args))
    };
    go().map_err(Trouble::into_message)
}
