//! Installs the C library with CMake, and builds and runs the samples of cFS and F´ against stubs, as a user's build
//! does.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::machine::{apt_install, has, output};
use crate::steps::{self, Outcome, Trouble};

/// Checks the package of `source`. cargo has built the library in `cargo_dir`; `out` takes what is made here.
pub(crate) fn check(source: &Path, cargo_dir: &Path, out: &Path) -> Outcome {
    if !["cmake", "pkg-config", "c++"].iter().all(|program| has(program)) {
        apt_install(&["cmake", "pkg-config", "g++"])?;
    }
    let (build, prefix) = (out.join("cmake"), out.join("installed"));
    for folder in [&build, &prefix] {
        if folder.exists() {
            fs::remove_dir_all(folder)?;
        }
    }
    let cmake = |args: &[&str], folder: &Path| {
        let mut command = Command::new("cmake");
        command.args(args).arg(folder);
        command
    };
    let define = |name: &str, value: &Path| format!("-D{name}={}", value.display());
    steps::run(cmake(&["-S"], source).arg("-B").arg(&build).args([
        define("CMAKE_INSTALL_PREFIX", &prefix),
        define("HZN_CARGO_DIR", cargo_dir),
        "-DCMAKE_INSTALL_LIBDIR=lib".to_owned(),
    ]))?;
    steps::run(&mut cmake(&["--build"], &build))?;
    steps::run(&mut cmake(&["--install"], &build))?;
    run_samples(source, &prefix, out)
}

/// Builds the samples with the flags of pkg-config, and runs them.
fn run_samples(source: &Path, prefix: &Path, out: &Path) -> Outcome {
    let pkg_config = prefix.join("lib/pkgconfig");
    let flags =
        output(Command::new("pkg-config").args(["--cflags", "--libs", "hzn"]).env("PKG_CONFIG_PATH", pkg_config))
            .ok_or_else(|| Trouble::Failed("pkg-config does not find the installed hzn".into()))?;
    let samples = source.join("samples");
    let cfs = ["cc", "-std=c11", "cfs/hzn_app.c", "cfs/stubs/run.c", "cfs/stubs"];
    let fprime = ["c++", "-std=c++14", "fprime/HznSensor.cpp", "fprime/stubs/run.cpp", "fprime/stubs"];
    for [compiler, standard, sample, run, stubs] in [cfs, fprime] {
        let program = out.join(format!("sample-{compiler}"));
        let mut command = Command::new(compiler);
        command.args([standard, "-O2", "-Wall", "-Wextra", "-Werror", "-I"]).arg(samples.join(stubs));
        command.arg("-I").arg(source.join("example")).arg(samples.join(sample)).arg(samples.join(run));
        command.args(flags.split_whitespace()).arg("-lm").arg("-o").arg(&program);
        steps::run(&mut command)?;
        steps::run(&mut Command::new(&program))?;
    }
    Ok(())
}
