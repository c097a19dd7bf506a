//! Compares the answers of other processors, under emulation, with those of this machine, bit by bit.
//!
//! Debian's Rust builds the standard library for them from its sources. s390x is left out: QEMU 7.2 computes a wrong
//! sine there (`libm::sincosf(0.1)` gives 0.1 and 1).

use std::path::Path;
use std::process::Command;

use crate::machine::{apt_install, output, root, target};
use crate::steps::{self, Outcome, Trouble, cargo};

/// Processor, its emulator, and the order of the bytes of a number.
const PROCESSORS: [(&str, &str, &str); 2] =
    [("aarch64", "qemu-aarch64", "little-endian"), ("powerpc64", "qemu-ppc64", "big-endian")];
const EXAMPLE: [&str; 6] = ["--package", "hzn-core", "--features", "_programs", "--example", "digest"];

/// Runs the example `digest` of hzn-core over `pictures` on every processor.
pub(crate) fn compare(pictures: u64) -> Outcome {
    let debian = ["rustc-web", "cargo-web", "rust-web-src"];
    let emulator = [
        "qemu-user",
        "gcc-aarch64-linux-gnu",
        "libc6-dev-arm64-cross",
        "gcc-powerpc64-linux-gnu",
        "libc6-dev-ppc64-cross",
    ];
    apt_install(&[&debian[..], &emulator[..]].concat())?;
    let pictures = pictures.to_string();
    let mut here = cargo(&["run", "--release", "--quiet"]);
    let here = output(here.args(EXAMPLE).args(["--", &pictures]));
    let here = here.ok_or_else(|| Trouble::Failed("the example `digest` does not run here".into()))?;
    println!("this machine: {}", here.trim());
    let dir = target().join("processors");
    for (name, qemu, order) in PROCESSORS {
        let triple = format!("{name}-unknown-linux-gnu");
        let mut build = Command::new("/usr/bin/cargo");
        build.current_dir(root()).args(["build", "--release", "--locked", "-Zbuild-std=std,panic_unwind"]);
        build.args(["--target", &triple, "--target-dir"]).arg(&dir).args(EXAMPLE);
        build.env("RUSTC", "/usr/bin/rustc").env("RUSTC_BOOTSTRAP", "1").env_remove("RUSTUP_TOOLCHAIN");
        let linker = format!("CARGO_TARGET_{}_UNKNOWN_LINUX_GNU_LINKER", name.to_uppercase());
        steps::run(build.env(linker, format!("{name}-linux-gnu-gcc")))?;
        let program = dir.join(&triple).join("release/examples/digest");
        let libraries = Path::new("/usr").join(format!("{name}-linux-gnu"));
        let there = output(Command::new(qemu).arg("-L").arg(libraries).arg(program).arg(&pictures));
        let there = there.ok_or_else(|| Trouble::Failed(format!("{qemu} does not run the example `digest`")))?;
        println!("{name} ({order}): {}", there.trim());
        if there != here {
            return Err(Trouble::Failed(format!("{name} has other answers")));
        }
    }
    Ok(())
}
