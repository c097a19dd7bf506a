//! Runs all checks, the cheapest first.
//!
//! Every check is to end in minutes, so a campaign that takes many runs a small part of itself there. `--all` runs the
//! whole.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::beside::Beside;
use crate::demo::{demo_dir, find_recordings, run_demo};
use crate::dist::{self, exclude_unpublished};
use crate::machine::{apt_install, has, root, target};
use crate::steps::{self, Outcome, Selection, Step, Steps, Tier, cargo};
use crate::test_build::build_tests;
use crate::{campaign, firmware, first_command, frameworks, ground, miri, page, python, viewer, wheel};

const fn every(name: &'static str, run: fn(&mut Steps) -> Outcome) -> Step {
    Step { name, tier: Tier::Every, run }
}

const fn long(name: &'static str, run: fn(&mut Steps) -> Outcome) -> Step {
    Step { name, tier: Tier::All, run }
}

/// The steps. Those with `steps.all` or of the tier `long` do more with `--all`.
const STEPS: &[Step] = &[
    every("format", |_| {
        let format = ["fmt", "--all", "--check"];
        steps::run(Command::new(steps::cargo_program()).args(format))?;
        // A workspace of its own.
        let own = ["--manifest-path", "examples/own-firmware/Cargo.toml"];
        steps::run(Command::new(steps::cargo_program()).args(format).args(own))
    }),
    every("lints", |_| steps::run(cargo(&["clippy", "--all-targets"]).args(["--", "-D", "warnings"]))),
    // Video input needs a decoder. Without one, its tests pass without a check, which would go unseen.
    every("ffmpeg", |_| if has("ffmpeg") { Ok(()) } else { apt_install(&["ffmpeg"]) }),
    every("tests", test_workspace),
    every("tests of hzn-core alone", test_core_alone),
    every("undefined behaviour", |steps| miri::test(steps.all)),
    every("feature sets", |_| {
        // The tests above build it without features. A feature chooses by `cfg!`, so most code is always compiled.
        ["std,_edges", "serde", "dlr,zju,horace,erf,kalibr,position,reml"].into_iter().try_for_each(check_core_with)?;
        // Two programs that no other step compiles.
        let programs = ["check", "--quiet", "--package", "hzn-core", "--features", "_programs,position", "--examples"];
        steps::run(&mut cargo(&programs))?;
        // The crates of the page, without files and threads: the workspace builds them with all features.
        steps::run(&mut cargo(&["check", "--quiet", "--package", "hzn-web"]))?;
        // A flight computer needs neither the simulator nor the solver.
        steps::run(&mut cargo(&["check", "--quiet", "--package", "hzn-cli", "--no-default-features"]))
    }),
    every("documents", |_| steps::run(cargo(&["doc", "--no-deps"]).env("RUSTDOCFLAGS", "-D warnings"))),
    every("packages", |_| check_packages()),
    every("flight build", |steps| {
        steps.images.wait();
        firmware::check_core()
    }),
    every("firmware", firmware::test),
    every("examples of hzn-core", |_| run_core_examples()),
    every("demo", |_| run_demo()),
    every("viewer", |_| viewer::test()),
    every("lenses against OpenCV", |_| compare_lenses_with_opencv()),
    every("simulator rendered again", |_| compare_simulator_with_python()),
    every("limbs of another program", check_limbs_of_another_program),
    every("files read by others", read_files_with_other_readers),
    every("wheel", |steps| {
        build_tests()?;
        wheel::run_step(&fs::canonicalize(target().join("debug/hzn"))?, steps.all)
    }),
    long("Basilisk and Rerun", |_| wheel::try_other_tools()),
    long("Yamcs and F´", |_| ground::test()),
    long("samples in cFS and F´", |_| frameworks::test()),
    long("page in the browser", |_| page::test()),
    long("files of a release", |_| dist::try_release()),
    long("first command", |_| first_command::test()),
    long("ignored tests", run_ignored_tests),
    long("killed runs", |_| campaign::kill(1000)),
    long("flipped bits", |_| campaign::flips(20_000)),
    long("power cuts", |_| campaign::cuts(12)),
    long("verdicts over flights", |_| campaign::flights(200)),
    long("calibrations over flights", |_| campaign::check(100, 910_000)),
    long("artefacts", |_| campaign::artefacts(15)),
];

/// Runs the steps that the arguments select.
pub(crate) fn run(args: &[String]) -> Result<(), String> {
    std::env::set_current_dir(root()).map_err(|e| e.to_string())?;
    let selection = Selection::parse(args, STEPS)?;
    // A chosen step prints what it builds.
    let images = if selection.is_by_tier() { Beside::start(&target().join("xtask")) } else { Beside::default() };
    Steps::run(STEPS, &selection, images)
}

/// Runs the tests of the workspace. With `--all` they take the whole of what they otherwise take a part of.
fn test_workspace(steps: &mut Steps) -> Outcome {
    let mut tests = cargo(&["test", "--no-fail-fast"]);
    if steps.all {
        tests.env("HZN_ALL", "1");
    }
    steps.count_tests(&mut tests)
}

/// Runs the tests that take minutes. The step `firmware` runs those that need an image.
fn run_ignored_tests(steps: &mut Steps) -> Outcome {
    let others = ["firmware::", "line_cost::", "navigation::", "recovery::", "silence::", "damage::"];
    let skipped = others.iter().flat_map(|name| ["--skip", name]);
    steps.cargo_test(&["--tests", "--", "--ignored"].into_iter().chain(skipped).collect::<Vec<_>>())
}

/// Runs the tests of hzn-core without features. A workspace build unites the features of all crates; alone, the core is
/// built as it flies.
fn test_core_alone(steps: &mut Steps) -> Outcome {
    let alone = ["--package", "hzn-core"];
    if steps.all {
        return steps.cargo_test(&alone);
    }
    // No feature changes what these compute, and they take longest.
    let without = ["--lib", "--", "--skip", "monte_carlo::", "--skip", "reference::"];
    steps.cargo_test(&[&alone[..], &without].concat())
}

/// Compiles hzn-core alone with these features.
fn check_core_with(features: &str) -> Outcome {
    let core_alone = ["check", "--quiet", "--package", "hzn-core", "--no-default-features", "--features", features];
    steps::run(&mut cargo(&core_alone))
}

/// Packs every crate that is meant to be published, without building it again.
fn check_packages() -> Outcome {
    let mut cargo = cargo(&["package", "--workspace", "--no-verify", "--allow-dirty", "--quiet"]);
    steps::run(cargo.args(exclude_unpublished()))
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
fn check_limbs_of_another_program(steps: &mut Steps) -> Outcome {
    build_tests()?;
    let mut campaign = campaign::limb_campaign(&target().join("debug/hzn"))?;
    let flights = if steps.all { "10" } else { "1" };
    steps::run(campaign.args(["--check", "--list", "--flights", flights, "--first-seed", "1"]))?;
    let mut decoys = campaign::decoy_campaign(&target().join("debug/hzn"))?;
    steps::run(decoys.args(["--check", "--flights", flights, "--first-seed", "1"]))
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
fn read_files_with_other_readers(steps: &mut Steps) -> Outcome {
    let python = python::prepare_environment("tests", Path::new("tests/python/requirements.txt"))?;
    let sample = target().join("xtask").join("sample.mcap");
    fs::create_dir_all(sample.parent().unwrap_or(&sample))?;
    build_tests()?;
    steps::run(Command::new(target().join("debug/examples/sample")).arg(&sample))?;
    let mut files = find_recordings(&demo_dir());
    files.push(sample);
    steps::run(Command::new(&python).arg("tests/python/check_mcap.py").args(files))?;
    for (script, folder) in
        [("check_rewritten.py", "rewritten"), ("check_ros.py", "ros"), ("check_schemas.py", "schemas")]
    {
        let folder = target().join("xtask").join(folder);
        if folder.exists() {
            fs::remove_dir_all(&folder)?;
        }
        let script = Path::new("tests/python").join(script);
        steps::run(Command::new(&python).arg(script).arg(target().join("debug/hzn")).arg(folder))?;
    }
    let folder = target().join("xtask").join("navigation");
    let programs = ["debug/hzn", "debug/examples/flight"].map(|program| target().join(program));
    steps::run(Command::new(&python).arg("tests/python/check_nav.py").args(programs).arg(folder))?;
    let folder = target().join("xtask").join("telemetry");
    let programs = ["debug/hzn", "debug/examples/telemetry_packets"].map(|program| target().join(program));
    steps::run(Command::new(python).arg("tests/python/check_telemetry.py").args(programs).arg(folder))?;
    campaign::packets(if steps.all { 100_000 } else { 1000 })
}
