//! A compiler for a flight computer. The compiled core library of the target comes from one of three places, tried in
//! order: the toolchain has it; `rustup target add` fetches it (its server may be out of reach, so it gets a minute);
//! Debian's Rust builds it from Debian's copy of the sources.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use crate::machine::{apt_install, has, output, run_within, target};
use crate::steps::{Outcome, Trouble, cargo, run};

/// Cortex-M4F and M7.
pub(crate) const TARGET: &str = "thumbv7em-none-eabihf";

/// A way to build for the target.
#[derive(Clone, Copy)]
pub(crate) enum Toolchain {
    /// The one that runs this program.
    Own,
    /// Debian's, with core built from its sources.
    Debian,
}

impl Toolchain {
    /// The first that works.
    pub(crate) fn find() -> Result<Self, Trouble> {
        let add = || {
            has("rustup")
                && run_within(Command::new("rustup").args(["target", "add", TARGET]), Duration::from_secs(60))
                && installed()
        };
        if installed() || add() {
            return Ok(Self::Own);
        }
        apt_install(&["rustc-web", "cargo-web", "rust-web-src", "rust-web-llvm"]).map_err(needs)?;
        if !has_debian_rust() {
            return Err(Trouble::Missing(format!("needs `rustup target add {TARGET}`: Debian's Rust is not there")));
        }
        // The linker of bare targets is a link into a package that nothing above depends on: `lld-22` and the like.
        if !Path::new("/usr/bin/rust-lld").exists()
            && let Ok(to) = std::fs::read_link("/usr/bin/rust-lld")
            && let Some(lld) = to.file_name().and_then(|n| n.to_str()).filter(|n| n.starts_with("lld-"))
        {
            apt_install(&[lld]).map_err(needs)?;
        }
        Ok(Self::Debian)
    }

    /// `cargo build --release` (or `rustc`) for the target, and where it builds to: under `dir` of the target folder.
    pub(crate) fn cargo(self, verb: &str, dir: &str, args: &[&str]) -> (Command, PathBuf) {
        let dir = target().join(dir);
        let mut command = match self {
            Self::Own => cargo(&[verb, "--release"]),
            Self::Debian => {
                let mut command = Command::new("/usr/bin/cargo");
                command.args([verb, "--release", "--locked", "-Zbuild-std=core"]);
                // RUSTC_BOOTSTRAP lets Debian's stable compiler build core from its own sources; flags and toolchain
                // settings of the caller belong to another compiler.
                command.env("RUSTC", "/usr/bin/rustc").env("RUSTC_BOOTSTRAP", "1").env_remove("RUSTUP_TOOLCHAIN");
                command
            }
        };
        command.env_remove("RUSTFLAGS").env_remove("CARGO_ENCODED_RUSTFLAGS");
        command.args(["--target", TARGET, "--target-dir"]).arg(&dir).args(args);
        (command, dir.join(TARGET).join("release"))
    }
}

/// Builds hzn-core without default features.
pub(crate) fn run_step() -> Outcome {
    run(&mut Toolchain::find()?.cargo("build", "flight", &["--package", "hzn-core"]).0)
}

fn needs(trouble: Trouble) -> Trouble {
    match trouble {
        Trouble::Missing(how) => Trouble::Missing(format!("needs `rustup target add {TARGET}`, or {how}")),
        failed => failed,
    }
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

fn has_debian_rust() -> bool {
    ["/usr/bin/rustc", "/usr/bin/cargo"].iter().all(|p| Path::new(p).is_file())
}
