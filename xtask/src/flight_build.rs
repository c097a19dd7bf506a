//! hzn-core for a flight computer. The compiled core library of the target comes from one of three places, tried in
//! order: the toolchain has it; `rustup target add` fetches it (its server may be out of reach, so it gets a minute);
//! Debian's Rust builds it from Debian's copy of the sources.

use std::path::Path;
use std::process::Command;
use std::time::Duration;

use crate::machine::{apt_install, has, output, run_within, target};
use crate::steps::{Outcome, Trouble, cargo, run};

/// Cortex-M4F and M7.
pub(crate) const TARGET: &str = "thumbv7em-none-eabihf";

const BUILD: [&str; 6] = ["build", "--release", "--package", "hzn-core", "--target", TARGET];

/// Builds hzn-core without default features, by the first way that works.
pub(crate) fn run_step() -> Outcome {
    let add = || {
        has("rustup")
            && run_within(Command::new("rustup").args(["target", "add", TARGET]), Duration::from_secs(60))
            && installed()
    };
    if installed() || add() {
        return run(&mut cargo(&BUILD));
    }
    debian()
}

/// Has the toolchain on PATH a built core for the target?
fn installed() -> bool {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let dir = output(Command::new(rustc).args(["--print", "target-libdir", "--target", TARGET]));
    let entries = dir.and_then(|d| std::fs::read_dir(d).ok());
    entries.is_some_and(|mut files| {
        files.any(|f| f.is_ok_and(|f| f.file_name().to_string_lossy().starts_with("libcore-")))
    })
}

fn debian() -> Outcome {
    apt_install(&["rustc-web", "cargo-web", "rust-web-src", "rust-web-llvm"]).map_err(|trouble| match trouble {
        Trouble::Missing(how) => Trouble::Missing(format!("needs `rustup target add {TARGET}`, or {how}")),
        failed => failed,
    })?;
    let (rustc, cargo) = (Path::new("/usr/bin/rustc"), Path::new("/usr/bin/cargo"));
    if !rustc.is_file() || !cargo.is_file() {
        return Err(Trouble::Missing(format!("needs `rustup target add {TARGET}`: Debian's Rust is not there")));
    }
    // RUSTC_BOOTSTRAP lets Debian's stable compiler build core from its own sources; flags and toolchain settings of
    // the caller belong to another compiler.
    run(Command::new(cargo)
        .args(BUILD)
        .args(["-Zbuild-std=core", "--target-dir"])
        .arg(target().join("debian"))
        .env("RUSTC", rustc)
        .env("RUSTC_BOOTSTRAP", "1")
        .env_remove("RUSTFLAGS")
        .env_remove("CARGO_ENCODED_RUSTFLAGS")
        .env_remove("RUSTUP_TOOLCHAIN"))
}
