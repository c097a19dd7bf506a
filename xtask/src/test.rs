//! Runs all checks, the cheapest first.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::machine::{apt_install, has, root, target};
use crate::steps::{self, Outcome, Steps, Trouble, cargo};
use crate::{firmware, flight_build, python, viewer, wheel};

pub(crate) fn run(only: &[String]) -> Result<(), String> {
    std::env::set_current_dir(root()).map_err(|e| e.to_string())?;
    let mut all = Steps::new(only);
    all.step("format", |_| steps::run(Command::new(cargo_program()).args(["fmt", "--all", "--check"])));
    all.step("lints", |_| {
        steps::run(cargo(&["clippy", "--workspace", "--all-targets"]).args(["--", "-D", "warnings"]))
    });
    // Video input needs a decoder. Without one, its tests pass without a check, which would go unseen.
    all.step("ffmpeg", |_| if has("ffmpeg") { Ok(()) } else { apt_install(&["ffmpeg"]) });
    all.step("tests", |s| s.cargo_test(&["--workspace"]));
    // A workspace build unites the features of all crates. Alone, the core is built as it flies.
    all.step("tests of hzn-core alone", |s| s.cargo_test(&["--package", "hzn-core"]));
    all.step("feature sets of hzn-core", |_| {
        ["std", "serde", "std,serde", "dlr", "zju", "horace", "erf", "_edges", "dlr,zju,horace,erf"]
            .into_iter()
            .try_for_each(|features| {
                run_cargo(&[
                    "check",
                    "--quiet",
                    "--package",
                    "hzn-core",
                    "--no-default-features",
                    "--features",
                    features,
                ])
            })
    });
    all.step("documents", |_| {
        steps::run(cargo(&["doc", "--workspace", "--no-deps"]).env("RUSTDOCFLAGS", "-D warnings"))
    });
    all.step("flight build", |_| flight_build::run_step());
    all.step("firmware", firmware::test);
    all.step("demo", |_| demo());
    all.step("viewer", |_| viewer::test());
    all.step("lenses against OpenCV", |_| lenses_beside_opencv());
    all.step("simulator rendered again", |_| simulator_rendered_again());
    all.step("files read by others", |_| files_read_by_others());
    all.step("wheel", |_| {
        built_with_the_tests()?;
        wheel::run_step(&fs::canonicalize(target().join("debug/hzn"))?)
    });
    all.conclude()
}

fn cargo_program() -> std::ffi::OsString {
    std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into())
}

fn run_cargo(args: &[&str]) -> Outcome {
    steps::run(&mut cargo(args))
}

/// Builds the tests, and with them the binaries and examples. Every step uses this same command, so nothing is built
/// twice. Another selection of packages would have other features and would build again.
pub(crate) fn built_with_the_tests() -> Outcome {
    run_cargo(&["test", "--workspace", "--no-run", "--quiet"])?;
    if target().join("debug/hzn").exists() {
        return Ok(());
    }
    // This build makes a binary only if the tests of its own package are built.
    run_cargo(&["build", "--profile", "test", "--workspace", "--bins"])
}

/// Returns the folder for the demo's files.
pub(crate) fn demo_dir() -> PathBuf {
    target().join("xtask").join("hzn-demo")
}

/// Runs `hzn demo` with the binary that the test build has made.
fn demo() -> Outcome {
    built_with_the_tests()?;
    let dir = demo_dir();
    if dir.exists() {
        fs::remove_dir_all(&dir)?;
    }
    fs::create_dir_all(dir.parent().unwrap_or(&dir))?;
    steps::run(Command::new(target().join("debug/hzn")).arg("demo").arg(&dir))?;
    if recordings(&dir).is_empty() {
        return Err(Trouble::Failed(format!("the demo has written no .mcap file into {}", dir.display())));
    }
    Ok(())
}

/// Compares the lens models with those of OpenCV.
fn lenses_beside_opencv() -> Outcome {
    compared_in_python("check_lenses.py", "debug/examples/rays", "lenses")
}

/// Compares a simulated picture with one that NumPy and OpenCV compute from the documented model.
fn simulator_rendered_again() -> Outcome {
    compared_in_python("check_simulator.py", "debug/hzn", "simulator")
}

/// Runs a script of tests/python. Its arguments are one of our programs and a folder that the script makes.
fn compared_in_python(script: &str, program: &str, folder: &str) -> Outcome {
    let python = python::environment("benches", Path::new("benches/requirements.txt"))?;
    built_with_the_tests()?;
    let dir = target().join("xtask").join(folder);
    if dir.exists() {
        fs::remove_dir_all(&dir)?;
    }
    fs::create_dir_all(target().join("xtask"))?;
    let script = Path::new("tests/python").join(script);
    steps::run(Command::new(python).arg(script).args([target().join(program), dir]))
}

/// Reads a sample and the recordings of the demo with the reference readers.
fn files_read_by_others() -> Outcome {
    let python = python::environment("tests", Path::new("tests/python/requirements.txt"))?;
    let sample = target().join("xtask").join("sample.mcap");
    fs::create_dir_all(sample.parent().unwrap_or(&sample))?;
    built_with_the_tests()?;
    steps::run(Command::new(target().join("debug/examples/sample")).arg(&sample))?;
    let mut files = recordings(&demo_dir());
    files.push(sample);
    steps::run(Command::new(python).arg("tests/python/check_mcap.py").args(files))
}

/// Returns the recordings in a folder and its subfolders.
fn recordings(dir: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(dir).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            found.append(&mut recordings(&path));
        } else if path.extension().is_some_and(|e| e == "mcap") {
            found.push(path);
        }
    }
    found.sort();
    found
}
