//! Builds and runs the samples in the cFS and in F´, where these are on this machine.
//!
//! They are no part of the repository, and nothing here gets or builds them: variables name the folders in which a user
//! has built them. The stubs of `c_package` stand for them in every other check.

use std::env;
use std::process::Command;

use crate::firmware::build_c_library;
use crate::machine::target;
use crate::python;
use crate::steps::{self, Outcome};

/// A framework.
struct Framework {
    /// Its name in the script.
    name: &'static str,
    /// The variable that names its folder.
    variable: &'static str,
    /// What is in that folder.
    folder: &'static str,
}

const FRAMEWORKS: [Framework; 2] = [
    Framework { name: "cfs", variable: "HZN_CFS", folder: "a built mission of the cFS" },
    Framework { name: "fprime", variable: "HZN_FPRIME", folder: "a built project of F´" },
];

/// Tries the samples in the frameworks that are named. Without one it says how to name it, and passes, because no
/// registry has the frameworks.
pub(crate) fn test() -> Outcome {
    for Framework { name, variable, folder } in FRAMEWORKS {
        let Some(path) = env::var_os(variable) else {
            println!("The sample is not tried in {folder}. {variable}=FOLDER names one that has it.");
            println!("The guide book/guide/porting.md, section From C, says how to put it there.");
            continue;
        };
        let library = build_c_library()?;
        let mut script = Command::new(python::SYSTEM);
        script.arg("tests/python/samples_in_frameworks.py").arg(name).arg(path).arg(library);
        steps::run(script.arg(target().join("xtask").join(name)))?;
    }
    Ok(())
}
