//! Everything that must hold, in the order in which it is cheapest to find out.

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
    // Video input needs a decoder; its tests pass over it where there is none, which would go unseen.
    all.step("ffmpeg", |_| if has("ffmpeg") { Ok(()) } else { apt_install(&["ffmpeg"]) });
    all.step("tests", |s| s.cargo_test(&["--workspace"]));
    // Features add up over a workspace: alone, the core is built as it flies.
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
    all.step("lenses beside OpenCV", |_| lenses_beside_opencv());
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

/// Binaries and examples come out of the build of the tests. The same command again builds nothing a second time, as
/// another selection of packages, with other features, would.
pub(crate) fn built_with_the_tests() -> Outcome {
    run_cargo(&["test", "--workspace", "--no-run", "--quiet"])?;
    if target().join("debug/hzn").exists() {
        return Ok(());
    }
    // Only a package's own tests bring its binary along.
    run_cargo(&["build", "--profile", "test", "--workspace", "--bins"])
}

/// Where the demo's files go.
pub(crate) fn demo_dir() -> PathBuf {
    target().join("xtask").join("hzn-demo")
}

/// `hzn demo`, by the binary that the tests have built.
fn demo() -> Outcome {
    built_with_the_tests()?;
    let dir = demo_dir();
    if dir.exists() {
        fs::remove_dir_all(&dir)?;
    }
    fs::create_dir_all(dir.parent().unwrap_or(&dir))?;
    steps::run(Command::new(target().join("debug/hzn")).arg("demo").arg(&dir))?;
    if recordings(&dir).is_empty() {
        return Err(Trouble::Failed(format!("the demo left no .mcap in {}", dir.display())));
    }
    Ok(())
}

/// The lens models beside OpenCV's.
fn lenses_beside_opencv() -> Outcome {
    compared_in_python("check_lenses.py", "debug/examples/rays", "lenses")
}

/// A simulated picture beside what NumPy and OpenCV make of the documented model.
fn simulator_rendered_again() -> Outcome {
    compared_in_python("check_simulator.py", "debug/hzn", "simulator")
}

/// A script of tests/python that is given one of our programs and a folder to make.
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

/// The reference readers on a sample and on what the demo has written.
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

/// The recordings in a folder and those below it.
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
