//! Runs tests in Miri, an interpreter that finds undefined behaviour: those of hzn-twice, which has unsafe code, and
//! with `--all` those of the core's numbers, which other targets compute in other ways.
//!
//! Only rustup has Miri, with its nightly toolchain, and rustup's server is not always reachable. Therefore nothing is
//! installed here, and a machine without Miri passes with a message, with `CI=true`, too.

use std::path::Path;
use std::process::Command;

use crate::machine::output;
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

/// Runs the step. `all` adds the tests of the core.
pub(crate) fn test(all: bool) -> Outcome {
    if !has_miri() {
        println!("Miri is not installed, so undefined behaviour in hzn-twice is not looked for.");
        println!("It comes with: rustup toolchain install nightly --component miri,rust-src");
        return Ok(());
    }
    steps::run(&mut miri(&["--package", "hzn-twice"]))?;
    if all {
        steps::run(miri(&["--package", "hzn-core", "--lib", "--"]).args(CORE))?;
    }
    Ok(())
}

/// Runs the tests of the flight software, and of the C interface with few flipped bits. This takes hours.
pub(crate) fn campaign() -> Outcome {
    if !has_miri() {
        return Err(Trouble::Missing("needs rustup toolchain install nightly --component miri,rust-src".into()));
    }
    steps::run(&mut miri(&["--package", "hzn-flight", "--lib"]))?;
    steps::run(miri(&["--package", "hzn-c", "--test", "c", "flips"]).env("HZN_FLIPS", "20"))
}

/// Returns a run of tests in Miri. They may read files and the clock.
fn miri(args: &[&str]) -> Command {
    let mut command = nightly(&["cargo", "miri", "test", "--locked"]);
    command.args(args).env_remove("RUSTC").env("MIRIFLAGS", "-Zmiri-disable-isolation");
    command
}

/// Returns whether Miri and the sources that it interprets are here. Without the sources Miri would download them.
fn has_miri() -> bool {
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
