//! Makes virtual environments with pinned packages, under the target folder.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::machine::{apt_install, output, target};
use crate::steps::{Trouble, run};

/// The system's own Python.
pub(crate) const SYSTEM: &str = if cfg!(windows) { "python" } else { "python3" };

/// Returns the Python of an environment with the packages that `requirements` lists. The environment is made once, and
/// made again when the list changes.
pub(crate) fn prepare_environment(name: &str, requirements: &Path) -> Result<PathBuf, Trouble> {
    let list = fs::read_to_string(requirements)?;
    let dir = target().join("venv").join(name);
    let python = dir.join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" });
    let stamp = dir.join("requirements.txt");
    if python.exists() && fs::read_to_string(&stamp).is_ok_and(|have| have == list) {
        return Ok(python);
    }
    let usable = || output(Command::new(SYSTEM).args(["-c", "import ensurepip, venv, tomllib"])).is_some();
    if !usable() {
        apt_install(&["python3", "python3-venv"])?;
    }
    if !usable() {
        return Err(Trouble::Missing("needs python3, 3.11 or later, with its venv module".into()));
    }
    let _ = fs::remove_dir_all(&dir);
    run(Command::new(SYSTEM).args(["-m", "venv"]).arg(&dir))?;
    run(Command::new(&python)
        .args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--requirement"])
        .arg(requirements))
    .map_err(|_| Trouble::Missing(format!("needs the Python packages of {}", requirements.display())))?;
    fs::write(&stamp, list)?;
    Ok(python)
}
