//! Runs tests in Miri, an interpreter that finds undefined behaviour: those of hzn-twice, which has unsafe code, and
//! with `--all` those of the core's numbers, which other targets compute in other ways.
//!
//! Only rustup has Miri, with its nightly toolchain, and rustup's server is not always reachable. Therefore nothing is
//! installed here, and a machine without Miri passes with a message, with `CI=true`, too.

use std::path::Path;
use std::process::Command;

use crate::machine::{self, output};
use crate::steps::{self, Outcome, Trouble};

/// The tests of hzn-core that Miri runs in about half a minute, by parts of their names. All others take hours.
const CORE: &[&str] = &[
    "base::linalg",
    "base::real",
    "geometry::cone",
    "geometry::ellipsoid",
    "geometry::frames",
    "stages::contour::marks",
    "an_open_edge",
    "row_stream",
    "gates::circle",
    "bins_widen",
    "model::status",
];

/// The modules of hzn-flight that have tests.
const FLIGHT: &[&str] = &[
    "answer::",
    "attitude::",
    "authentication::",
    "cuc::",
    "flight::",
    "messages::",
    "operations::",
    "packet::",
    "parameters::",
    "table::",
    "view::",
];

/// Tests of hzn-flight that flip bits of its memory and expect that this is noticed. In Miri only the tests of
/// hzn-twice compare the two copies, see `barrier`.
const FLIPS: [&str; 4] = ["--skip", "flight::memory::", "--skip", "a_flipped_bit_costs_the_epoch"];

/// Miri cannot run the square root of libm for x86-64, which is assembly; this feature of libm takes the portable one.
const PORTABLE_ROOTS: &str = "libm/force-soft-floats";

/// Files and the clock can be read.
const FLAGS: &str = "-Zmiri-disable-isolation";

/// A processor with the most significant byte first. Miri interprets it on any machine.
const BIG_ENDIAN: &str = "s390x-unknown-linux-gnu";

/// Runs the step. `all` adds the tests of the core.
pub(crate) fn test(all: bool) -> Outcome {
    if !has_miri() {
        println!("Miri is not installed, so undefined behaviour in hzn-twice is not looked for.");
        println!("It comes with: rustup toolchain install nightly --component miri,rust-src");
        return Ok(());
    }
    steps::run(miri(&["--package", "hzn-twice"]).env("MIRIFLAGS", format!("{FLAGS} {}", barrier()?)))?;
    if all {
        let core = ["--package", "hzn-core", "--lib", "--features", PORTABLE_ROOTS];
        steps::run(miri(&core).arg("--").args(CORE))?;
        steps::run(miri(&core).args(["--target", BIG_ENDIAN, "--"]).args(CORE))?;
    }
    Ok(())
}

/// Runs the tests of the flight software's modules, and calls the C interface with the committed inputs.
pub(crate) fn campaign() -> Outcome {
    if !has_miri() {
        return Err(Trouble::Missing("needs rustup toolchain install nightly --component miri,rust-src".into()));
    }
    // hzn-core is named for the feature of its dependency; its own tests are elsewhere.
    let with_core = |name| ["--package", name, "--package", "hzn-core", "--features", PORTABLE_ROOTS];
    steps::run(miri(&with_core("hzn-c")).args(["--test", "c", "--", "corpus"]))?;
    steps::run(miri(&with_core("hzn-flight")).args(["--lib", "--"]).args(FLIGHT).args(FLIPS))
}

/// Builds the function that hzn-twice calls in Miri, and returns the flag with which Miri finds it.
fn barrier() -> Result<String, Trouble> {
    let folder = machine::target().join("miri");
    std::fs::create_dir_all(&folder)?;
    let library = folder.join("barrier.so");
    let source = "crates/hzn-twice/miri/barrier.rs";
    steps::run(nightly(&["rustc", "--edition", "2024", "--crate-type", "cdylib", source, "-o"]).arg(&library))?;
    Ok(format!("-Zmiri-native-lib={}", library.display()))
}

/// Returns a run of tests in Miri. They may read files and the clock.
fn miri(args: &[&str]) -> Command {
    let mut command = nightly(&["cargo", "miri", "test", "--locked"]);
    // A property is tried on few inputs, because the interpreter is a thousand times as slow as the processor.
    command.args(args).env("PROPTEST_CASES", "4");
    command.env_remove("RUSTC").env("MIRIFLAGS", FLAGS);
    command
}

/// Returns whether Miri and the sources that it interprets are here. Without the sources Miri would download them. It
/// calls functions outside of the program on Unix only, and hzn-twice needs one.
fn has_miri() -> bool {
    if !cfg!(unix) {
        return false;
    }
    let sysroot = output(&mut nightly(&["rustc", "--print", "sysroot"]));
    let has_sources = sysroot.is_some_and(|path| Path::new(&path).join("lib/rustlib/src/rust/library").is_dir());
    has_sources && output(&mut nightly(&["cargo", "miri", "--version"])).is_some()
}

/// Returns a call of the nightly toolchain, which is not installed if it is missing. The cargo that runs this program
/// is no call of rustup, so it does not know `+nightly`.
fn nightly(args: &[&str]) -> Command {
    let mut command = Command::new("rustup");
    command.args(["run", "nightly"]).args(args).env("RUSTUP_AUTO_INSTALL", "0");
    command
}
