//! Runs all checks, the cheapest first.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::demo::{demo_dir, find_recordings, run_demo};
use crate::machine::{apt_install, has, root, target};
use crate::steps::{self, Outcome, Steps, cargo};
use crate::test_build::build_tests;
use crate::{campaign, firmware, flight_build, miri, python, viewer, wheel};

pub(crate) fn run(only: &[String]) -> Result<(), String> {
    std::env::set_current_dir(root()).map_err(|e| e.to_string())?;
    let mut all = Steps::new(only);
    all.step("format", |_| steps::run(Command::new(steps::cargo_program()).args(["fmt", "--all", "--check"])));
    all.step("lints", |_| steps::run(cargo(&["clippy", "--all-targets"]).args(["--", "-D", "warnings"])));
    // Video input needs a decoder. Without one, its tests pass without a check, which would go unseen.
    all.step("ffmpeg", |_| if has("ffmpeg") { Ok(()) } else { apt_install(&["ffmpeg"]) });
    all.step("tests", |s| s.cargo_test(&[]));
    // A workspace build unites the features of all crates. Alone, the core is built as it flies.
    all.step("tests of hzn-core alone", |s| s.cargo_test(&["--package", "hzn-core"]));
    all.step("undefined behaviour", |_| miri::test());
    all.step("feature sets of hzn-core", |_| {
        // The tests above build it without features. A feature chooses by `cfg!`, so most code is always compiled.
        ["std,_edges", "serde", "dlr,zju,horace,erf,kalibr,position,reml"].into_iter().try_for_each(check_core_with)
    });
    all.step("documents", |_| steps::run(cargo(&["doc", "--no-deps"]).env("RUSTDOCFLAGS", "-D warnings")));
    all.step("packages", |_| check_packages());
    all.step("flight build", |_| flight_build::run_step());
    all.step("firmware", firmware::test);
    all.step("examples of hzn-core", |_| run_core_examples());
    all.step("demo", |_| run_demo());
    all.step("viewer", |_| viewer::test());
    all.step("lenses against OpenCV", |_| compare_lenses_with_opencv());
    all.step("simulator rendered again", |_| compare_simulator_with_python());
    all.step("limbs of another program", |_| check_limbs_of_another_program());
    all.step("files read by others", |_| read_files_with_other_readers());
    all.step("wheel", |_| {
        build_tests()?;
        wheel::run_step(&fs::canonicalize(target().join("debug/hzn"))?)
    });
    all.conclude()
}

/// Compiles hzn-core alone with these features.
fn check_core_with(features: &str) -> Outcome {
    let core_alone = ["check", "--quiet", "--package", "hzn-core", "--no-default-features", "--features", features];
    steps::run(&mut cargo(&core_alone))
}

/// Packs every crate that is meant to be published, without building it again.
fn check_packages() -> Outcome {
    let mut cargo = cargo(&["package", "--workspace", "--no-verify", "--allow-dirty", "--quiet"]);
    let ours = ["hzn-py", "hzn-tests", "hzn-fuzz", "hzn-reproduce", "hzn-benches", "xtask"];
    for unpublished in
        ours.iter().chain(&["hzn-c", "hzn-firmware", "hzn-mps2", "hzn-setup", "hzn-stm32f405", "hzn-stm32h743"])
    {
        cargo.args(["--exclude", unpublished]);
    }
    steps::run(&mut cargo)
}

/// Compares the lens models with those of OpenCV.
fn compare_lenses_with_opencv() -> Outcome {
    compare_in_python("check_lenses.py", "debug/examples/rays", "lenses")
}

/// Runs the examples of hzn-core; each checks its own answer.
fn run_core_examples() -> Outcome {
    build_tests()?;
    let examples = target().join("debug/examples");
    ["picture", "no_std", "rows", "own_lens"]
        .into_iter()
        .try_for_each(|example| steps::run(&mut Command::new(examples.join(example))))
}

/// Compares a simulated picture with one that NumPy and OpenCV compute from the documented model.
fn compare_simulator_with_python() -> Outcome {
    compare_in_python("check_simulator.py", "debug/hzn", "simulator")
}

/// Processes a few flights that a program in Python renders. `cargo xtask campaign pictures` takes many.
fn check_limbs_of_another_program() -> Outcome {
    build_tests()?;
    let mut campaign = campaign::limb_campaign(&target().join("debug/hzn"))?;
    steps::run(campaign.args(["--check", "--list", "--flights", "2", "--first-seed", "1"]))
}

/// Runs a script of tests/python. Its arguments are one of our programs and a folder that the script makes.
fn compare_in_python(script: &str, program: &str, folder: &str) -> Outcome {
    let python = python::prepare_environment("benches", Path::new("benches/requirements.txt"))?;
    build_tests()?;
    let dir = target().join("xtask").join(folder);
    if dir.exists() {
        fs::remove_dir_all(&dir)?;
    }
    fs::create_dir_all(target().join("xtask"))?;
    let script = Path::new("tests/python").join(script);
    steps::run(Command::new(python).arg(script).args([target().join(program), dir]))
}

/// Reads a sample and the recordings of the demo with the reference readers.
fn read_files_with_other_readers() -> Outcome {
    let python = python::prepare_environment("tests", Path::new("tests/python/requirements.txt"))?;
    let sample = target().join("xtask").join("sample.mcap");
    fs::create_dir_all(sample.parent().unwrap_or(&sample))?;
    build_tests()?;
    steps::run(Command::new(target().join("debug/examples/sample")).arg(&sample))?;
    let mut files = find_recordings(&demo_dir());
    files.push(sample);
    steps::run(Command::new(&python).arg("tests/python/check_mcap.py").args(files))?;
    let folder = target().join("xtask").join("navigation");
    let programs = ["debug/hzn", "debug/examples/flight"].map(|program| target().join(program));
    steps::run(Command::new(&python).arg("tests/python/check_nav.py").args(programs).arg(folder))?;
    let folder = target().join("xtask").join("telemetry");
    let programs = ["debug/hzn", "debug/examples/telemetry_packets"].map(|program| target().join(program));
    steps::run(Command::new(python).arg("tests/python/check_telemetry.py").args(programs).arg(folder))?;
    campaign::packets(100_000)
}
