//! Finds out what this machine has, and installs packages.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::steps::{Outcome, Trouble, run, show};

/// Returns the root folder of the repository.
pub(crate) fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here).to_path_buf()
}

/// Returns the folder that cargo builds to.
pub(crate) fn target() -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), PathBuf::from)
}

/// Returns whether this program can be started from PATH.
pub(crate) fn has(program: &str) -> bool {
    std::env::var_os("PATH").is_some_and(|path| std::env::split_paths(&path).any(|dir| dir.join(program).is_file()))
}

/// Returns what a command prints on standard output, or `None` if the command fails.
pub(crate) fn output(command: &mut Command) -> Option<String> {
    let out = command.stdin(Stdio::null()).stderr(Stdio::null()).output().ok()?;
    out.status.success().then(|| String::from_utf8_lossy(&out.stdout).trim().to_owned())
}

/// Installs the standard library of a target, if it is missing.
pub(crate) fn need_target(triple: &str) -> Outcome {
    let library = || output(Command::new("rustc").args(["--print", "target-libdir", "--target", triple]));
    let is_there = || library().is_some_and(|path| Path::new(&path).exists());
    if is_there() {
        return Ok(());
    }
    let _ = run(Command::new("rustup").args(["target", "add", triple]));
    let missing = || Trouble::Missing(format!("needs the standard library of a target: rustup target add {triple}"));
    is_there().then_some(()).ok_or_else(missing)
}

/// Installs the missing Debian packages. Fails if apt-get is missing, the user is not root, or the installation fails.
pub(crate) fn apt_install(packages: &[&str]) -> Outcome {
    let installed = |p: &&str| {
        output(Command::new("dpkg-query").args(["-W", "-f", "${Status}", p])).is_some_and(|s| s.ends_with(" installed"))
    };
    let missing: Vec<&str> = packages.iter().copied().filter(|p| !installed(p)).collect();
    if missing.is_empty() {
        return Ok(());
    }
    let how = format!("apt-get install {}", missing.join(" "));
    let is_root = output(Command::new("id").arg("-u")).is_some_and(|id| id == "0");
    if !has("apt-get") || !is_root {
        return Err(Trouble::Missing(format!("needs the Debian packages: {how}")));
    }
    // Another apt may be running: wait for it, at most 300 s.
    let apt = || {
        let mut c = Command::new("apt-get");
        c.args(["-qq", "-o", "DPkg::Lock::Timeout=300"]).env("DEBIAN_FRONTEND", "noninteractive");
        c
    };
    let _ = run(apt().arg("update"));
    run(apt().args(["install", "-y", "--no-install-recommends"]).args(&missing))
        .map_err(|_| Trouble::Missing(format!("could not be installed: {how}")))
}

/// Runs a command for at most `limit` and then kills it. Returns true if the command succeeds in time.
pub(crate) fn run_within(command: &mut Command, limit: Duration) -> bool {
    show(command);
    let Ok(mut child) = command.stdin(Stdio::null()).spawn() else { return false };
    let start = Instant::now();
    loop {
        match child.try_wait() {
            Ok(Some(status)) => return status.success(),
            Ok(None) if start.elapsed() < limit => std::thread::sleep(Duration::from_millis(100)),
            _ => {
                let _ = child.kill();
                let _ = child.wait();
                return false;
            }
        }
    }
}
