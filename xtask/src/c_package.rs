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
    check_inline_limits(source, out)?;
    run_samples(source, &prefix, out)
}

/// Checks that flags of a user, which replace those of `.cargo/config.toml`, do not replace the limits of inlining.
fn check_inline_limits(source: &Path, out: &Path) -> Outcome {
    const OWN: &str = "-Ctarget-cpu=cortex-m7";
    let build = out.join("cmake-thumb");
    let mut configure = Command::new("cmake");
    configure.arg("-S").arg(source).arg("-B").arg(&build).arg("-DHZN_TARGET=thumbv7em-none-eabihf");
    steps::run(configure.env("RUSTFLAGS", OWN))?;
    let rules = fs::read_to_string(build.join("CMakeFiles/hzn_library.dir/build.make"))?;
    let limits = fs::read_to_string(source.join("../.cargo/config.toml"))?;
    let limits: Vec<&str> = limits.split('"').filter(|part| part.starts_with("-C")).collect();
    match limits.iter().chain([&OWN]).find(|flag| !rules.contains(**flag)) {
        Some(flag) => Err(Trouble::Failed(format!("CMake builds the library without {flag}"))),
        None if limits.is_empty() => Err(Trouble::Failed("no limits in .cargo/config.toml".into())),
        None => Ok(()),
    }
}

/// Builds the samples with the flags of pkg-config, and runs them.
fn run_samples(source: &Path, prefix: &Path, out: &Path) -> Outcome {
    let pkg_config = prefix.join("lib/pkgconfig");
    let flags =
        output(Command::new("pkg-config").args(["--cflags", "--libs", "hzn"]).env("PKG_CONFIG_PATH", pkg_config))
            .ok_or_else(|| Trouble::Failed("pkg-config does not find the installed hzn".into()))?;
    let samples = source.join("samples");
    // The flags of the cFE: `arch_build_custom.cmake` of its sample mission.
    const CFE: &[&str] =
        &["-std=c99", "-pedantic", "-Wstrict-prototypes", "-Wwrite-strings", "-Wpointer-arith", "-Wcast-align"];
    let build = |compiler: &str, standard: &[&str], sources: &[&str], includes: &[&str]| {
        let program = out.join(format!("sample-{compiler}"));
        let mut command = Command::new(compiler);
        command.args(standard).args(["-O2", "-Wall", "-Wextra", "-Werror", "-I"]).arg(source.join("example"));
        for include in includes {
            command.arg("-I").arg(samples.join(include));
        }
        command.args(sources.iter().map(|file| samples.join(file)));
        command.args(flags.split_whitespace()).arg("-lm").arg("-o").arg(&program);
        steps::run(&mut command)?;
        steps::run(&mut Command::new(&program))
    };
    // It includes the application.
    build("cc", CFE, &["cfs/stubs/run.c", "cfs/hzn_app_tbl.c"], &["cfs/stubs", "cfs"])?;
    // F´ looks for headers from the root of the project on.
    let fprime = ["fprime/Components/HznSensor/HznSensor.cpp", "fprime/stubs/run.cpp"];
    build("c++", &["-std=c++14"], &fprime, &["fprime", "fprime/stubs"])
}
