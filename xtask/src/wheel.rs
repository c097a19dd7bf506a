//! Builds, installs and tests the Python package as its users have it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::machine::{root, target};
use crate::steps::{self, Outcome, Trouble};
use crate::{python, site};

const CRATE: &str = "crates/hzn-py";
/// Profile with the settings of the tests, and the feature with which their dependencies fit: what the tests have
/// compiled is not compiled again. With `--profile test`, cargo would build a test.
const AS_IN_THE_TESTS: &[&str] = &["--profile", "dev", "--features", "as-in-the-tests"];
const RELEASE: &[&str] = &["--profile", "release"];

/// Builds the wheel, installs it into a separate environment, and checks stubs, behaviour, notebooks and the site.
/// `hzn` is the program of the same build. The build of the site executes one notebook, or with `every_notebook` all.
pub(crate) fn run_step(hzn: &Path, every_notebook: bool) -> Outcome {
    let folder = Path::new(CRATE);
    let python = install_wheel(AS_IN_THE_TESTS)?;
    let scratch = make_scratch()?;
    let tests = fs::canonicalize(folder.join("tests"))?;
    let module = |args: &[&str]| {
        let mut command = Command::new(&python);
        command.arg("-m").args(args).current_dir(&scratch).env("HZN_PROGRAM", hzn);
        command
    };
    let stubs = ["mypy.stubtest", "hzn", "--concise", "--allowlist"];
    steps::run(module(&stubs).arg(tests.join("stubtest.txt")))?;
    steps::run(module(&["mypy", "--strict", "--no-error-summary"]).arg(tests.join("typed.py")))?;
    let pytest = ["pytest", "-q", "-p", "no:cacheprovider", "--durations", "10"];
    let others = ["tools", "stars"].map(|folder| format!("--ignore={}", tests.join(folder).display()));
    steps::run(module(&pytest).args(others).arg(&tests))?;
    // The site takes its reference from the docstrings. Its notebooks are executed during the build.
    site::build(&python, every_notebook)
}

/// Builds the site with all notebooks executed, and without the page of the sensor.
pub(crate) fn build_site() -> Outcome {
    site::build(&install_wheel(AS_IN_THE_TESTS)?, true)
}

/// The solver that names the stars of a picture.
const STAR_SOLVER: &str = "cedar-solve==0.5.1";

/// Runs the examples with Basilisk, Rerun and the solver of stars, and compares positions with those of Basilisk. The
/// environments are separate ones, because these need older packages.
pub(crate) fn try_other_tools() -> Outcome {
    let tests = fs::canonicalize(Path::new(CRATE).join("tests/tools"))?;
    build_wheel(AS_IN_THE_TESTS)?;
    let python = python::prepare_environment("tools", &tests.join("requirements.txt"))?;
    install(&python, &find_wheel(&wheels())?)?;
    let pytest = ["-m", "pytest", "-q", "-p", "no:cacheprovider"];
    steps::run(Command::new(&python).args(pytest).arg(tests).current_dir(make_scratch()?))?;
    // cedar-solve needs an older NumPy than Basilisk. It asks for a Pillow that has no wheel for today's interpreters,
    // but works with a newer one, so it comes without its own choice of packages.
    let tests = fs::canonicalize(Path::new(CRATE).join("tests/stars"))?;
    let python = python::prepare_environment("stars", &tests.join("requirements.txt"))?;
    let pip = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps"];
    steps::run(Command::new(&python).args(pip).arg(STAR_SOLVER))?;
    install(&python, &find_wheel(&wheels())?)?;
    steps::run(Command::new(&python).args(pytest).arg(tests).current_dir(make_scratch()?))
}

/// Measures the wheel of a release build.
pub(crate) fn measure(args: &[String]) -> Outcome {
    let folder = fs::canonicalize(CRATE)?;
    let python = install_wheel(RELEASE)?;
    let mut measure = Command::new(python);
    measure.arg(folder.join("benches/measure.py")).arg(fs::canonicalize("book/results")?.join("python-measured.md"));
    steps::run(measure.args(args).current_dir(make_scratch()?))
}

/// Returns a folder away from the sources, so that Python imports the installed package.
fn make_scratch() -> Result<PathBuf, Trouble> {
    let scratch = target().join("xtask");
    fs::create_dir_all(&scratch)?;
    Ok(fs::canonicalize(scratch)?)
}

/// Builds and installs the wheel, and returns the Python that has it.
fn install_wheel(how: &[&str]) -> Result<PathBuf, Trouble> {
    let python = build_wheel(how)?;
    install(&python, &find_wheel(&wheels())?)?;
    Ok(python)
}

/// Builds the wheel with these options of cargo, and returns the Python of the environment that has maturin.
fn build_wheel(how: &[&str]) -> Result<PathBuf, Trouble> {
    let folder = Path::new(CRATE);
    let python = python::prepare_environment("wheel", &folder.join("tests/requirements.txt"))?;
    if wheels().exists() {
        fs::remove_dir_all(wheels())?;
    }
    steps::run(&mut maturin(&python, folder, how, &wheels()))?;
    Ok(python)
}

/// Returns the folder of the wheel.
fn wheels() -> PathBuf {
    target().join("wheels")
}

/// Returns the call that builds the wheel of the package in `folder` into the folder `wheels`.
fn maturin(python: &Path, folder: &Path, how: &[&str], wheels: &Path) -> Command {
    let mut maturin = Command::new(python);
    maturin.args(["-m", "maturin", "build", "--locked"]).args(how).arg("--manifest-path");
    maturin.arg(folder.join("Cargo.toml")).arg("--out").arg(wheels).env("CARGO_INCREMENTAL", "0");
    maturin
}

/// Builds the wheel of a release here and in a clone of this repository, and compares their bytes.
pub(crate) fn is_the_same_elsewhere(clone: &Path) -> Outcome {
    let python = python::prepare_environment("wheel", &Path::new(CRATE).join("tests/requirements.txt"))?;
    let elsewhere = target().join("xtask/elsewhere");
    let build = |root: &Path, name: &str| -> Result<PathBuf, Trouble> {
        let wheels = elsewhere.join(name);
        if wheels.exists() {
            fs::remove_dir_all(&wheels)?;
        }
        let mut maturin = maturin(&python, &root.join(CRATE), RELEASE, &wheels);
        steps::run(maturin.arg("--target-dir").arg(elsewhere.join(format!("{name}-target"))))?;
        find_wheel(&wheels)
    };
    let [here, there] = [build(&root(), "wheel-here")?, build(clone, "wheel-there")?];
    let name = here.file_name().unwrap_or_default().to_string_lossy().into_owned();
    steps::compare_bytes(&name, &here, &there)
}

fn install(python: &Path, wheel: &Path) -> Outcome {
    let pip = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--force-reinstall", "--no-deps"];
    steps::run(Command::new(python).args(pip).arg(wheel))
}

fn find_wheel(folder: &Path) -> Result<PathBuf, Trouble> {
    let mut wheels = fs::read_dir(folder)?.flatten().map(|e| e.path()).filter(|p| p.extension().is_some());
    wheels.next().ok_or_else(|| Trouble::Failed(format!("maturin has built no wheel in {}", folder.display())))
}
