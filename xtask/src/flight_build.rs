//! Finds a compiler for a flight computer. The target needs a compiled core library, which comes from one of three
//! places. They are tried in this order: the toolchain has the library; `rustup target add` fetches it (within one
//! minute, because its server may be out of reach); Debian's Rust builds it from Debian's copy of the sources.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use crate::machine::{apt_install, has, output, run_within, target};
use crate::steps::{Trouble, cargo};

/// Target of the Cortex-M4F and the Cortex-M7.
pub(crate) const TARGET: &str = "thumbv7em-none-eabihf";

/// Toolchain that builds for the target.
#[derive(Clone, Copy)]
pub(crate) enum Toolchain {
    /// Toolchain that runs this program.
    Own,
    /// Debian's toolchain, which builds core from its sources.
    Debian,
}

impl Toolchain {
    /// Returns the first toolchain that works for [`TARGET`].
    pub(crate) fn find() -> Result<Self, Trouble> {
        Self::find_for(TARGET)
    }

    /// Returns the first toolchain that works for a target.
    pub(crate) fn find_for(target: &str) -> Result<Self, Trouble> {
        let add = || {
            has("rustup")
                && run_within(Command::new("rustup").args(["target", "add", target]), Duration::from_secs(60))
                && has_core_library(target)
        };
        if has_core_library(target) || add() {
            return Ok(Self::Own);
        }
        apt_install(&["rustc-web", "cargo-web", "rust-web-src", "rust-web-llvm"])
            .map_err(|trouble| with_rustup_hint(trouble, target))?;
        if !has_debian_rust() {
            return Err(Trouble::Missing(format!(
                "needs `rustup target add {target}`: Debian's Rust is not installed"
            )));
        }
        // The linker of bare targets, `rust-lld`, is a symbolic link into a package like `lld-22`. None of the packages
        // above depends on that package.
        if !Path::new("/usr/bin/rust-lld").exists()
            && let Ok(to) = std::fs::read_link("/usr/bin/rust-lld")
            && let Some(lld) = to.file_name().and_then(|n| n.to_str()).filter(|n| n.starts_with("lld-"))
        {
            apt_install(&[lld]).map_err(|trouble| with_rustup_hint(trouble, target))?;
        }
        Ok(Self::Debian)
    }

    /// Returns `cargo build --profile flight` (or another verb, for example `rustc`) for the target, and the folder
    /// that it builds to. This folder is under `dir` of the target folder.
    pub(crate) fn cargo(self, verb: &str, dir: &str, args: &[&str]) -> (Command, PathBuf) {
        self.cargo_with_profile("flight", verb, dir, args)
    }

    /// Returns the same as [`Self::cargo`], with another profile.
    pub(crate) fn cargo_with_profile(self, profile: &str, verb: &str, dir: &str, args: &[&str]) -> (Command, PathBuf) {
        self.cargo_for(TARGET, profile, verb, dir, args)
    }

    /// Returns the same as [`Self::cargo_with_profile`], for another target.
    pub(crate) fn cargo_for(
        self,
        chosen: &str,
        profile: &str,
        verb: &str,
        dir: &str,
        args: &[&str],
    ) -> (Command, PathBuf) {
        let dir = target().join(dir);
        let mut command = match self {
            Self::Own => cargo(&[verb, "--profile", profile]),
            Self::Debian => {
                let mut command = Command::new("/usr/bin/cargo");
                command.args([verb, "--profile", profile, "--locked", "-Zbuild-std=core"]);
                // RUSTC_BOOTSTRAP lets Debian's stable compiler build core from its own sources. The caller's flags and
                // toolchain settings belong to another compiler, so they are removed.
                command.env("RUSTC", "/usr/bin/rustc").env("RUSTC_BOOTSTRAP", "1").env_remove("RUSTUP_TOOLCHAIN");
                command
            }
        };
        command.env_remove("RUSTFLAGS").env_remove("CARGO_ENCODED_RUSTFLAGS");
        command.args(["--target", chosen, "--target-dir"]).arg(&dir).args(args);
        (command, dir.join(chosen).join(profile))
    }
}

fn with_rustup_hint(trouble: Trouble, target: &str) -> Trouble {
    match trouble {
        Trouble::Missing(how) => Trouble::Missing(format!("needs `rustup target add {target}`, or {how}")),
        failed => failed,
    }
}

/// Returns whether the toolchain on PATH has a compiled core library for the target.
fn has_core_library(target: &str) -> bool {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let dir = output(Command::new(rustc).args(["--print", "target-libdir", "--target", target]));
    let entries = dir.and_then(|d| std::fs::read_dir(d).ok());
    entries.is_some_and(|mut files| {
        files.any(|f| f.is_ok_and(|f| f.file_name().to_string_lossy().starts_with("libcore-")))
    })
}

fn has_debian_rust() -> bool {
    ["/usr/bin/rustc", "/usr/bin/cargo"].iter().all(|p| Path::new(p).is_file())
}
