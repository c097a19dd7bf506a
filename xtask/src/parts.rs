//! The parts that hzn is built from: their list, their licences, and what is known against them.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::machine::{has, target};
use crate::python;
use crate::steps::{self, Outcome, Trouble, cargo};

/// The lock files of the repository.
const LOCKS: &[&str] = &["Cargo.lock", "examples/own-firmware/Cargo.lock", "fuzz/Cargo.lock"];

/// Writes the lists of parts and checks the licences; with `--advisories FOLDER`, also looks for known faults.
pub(crate) fn run(args: &[String]) -> Outcome {
    let (mut folder, mut advisories) = ("target/sbom", None);
    let mut args = args.iter().map(String::as_str);
    while let Some(arg) = args.next() {
        match arg {
            "--advisories" => {
                advisories = Some(args.next().ok_or_else(|| failed("--advisories: a folder is missing"))?)
            }
            arg => folder = arg,
        }
    }
    let sbom = ["run", "--quiet", "--package", "hzn-supply"];
    steps::run(cargo(&sbom).args(["--", folder]))?;
    if has("cargo-deny") {
        steps::run(Command::new(steps::cargo_program()).args(["deny", "check", "licenses", "bans", "sources"]))?;
    } else {
        println!("cargo-deny is not installed; the test `supply` checks licences and sources");
    }
    let Some(database) = advisories else { return Ok(()) };
    list_old()?;
    audit(Path::new(database))
}

fn failed(what: impl Into<String>) -> Trouble {
    Trouble::Failed(what.into())
}

/// Looks all parts up in the database of advisories.
fn audit(database: &Path) -> Outcome {
    let repository = repository(database)?;
    let program = audit_program()?;
    for lock in LOCKS {
        // `--stale`: the database is a copy, whose age is known to whoever gives it.
        let mut audit = Command::new(&program);
        audit.args(["audit", "--no-fetch", "--stale", "--file", lock, "--db"]).arg(&repository);
        steps::run(&mut audit)?;
    }
    Ok(())
}

/// Returns cargo-audit. If it is not installed, it comes as a package of Python.
fn audit_program() -> Result<PathBuf, Trouble> {
    if has("cargo-audit") {
        return Ok("cargo-audit".into());
    }
    let python = python::prepare_environment("audit", Path::new("xtask/audit-requirements.txt"))?;
    Ok(python.with_file_name("cargo-audit"))
}

/// Returns the database as a git repository, which cargo-audit expects. The given folder is not changed.
fn repository(database: &Path) -> Result<PathBuf, Trouble> {
    if !database.join("crates").is_dir() {
        return Err(failed(format!(
            "{}: does not contain the folder crates of the database; unpack its archive first",
            database.display()
        )));
    }
    if database.join(".git").exists() {
        return Ok(database.to_owned());
    }
    let copy = target().join("xtask/advisories");
    let _ = fs::remove_dir_all(&copy);
    fs::create_dir_all(&copy)?;
    steps::run(Command::new("cp").arg("-r").arg(database.join("crates")).arg(&copy))?;
    let git = |args: &[&str]| steps::run(Command::new("git").arg("-C").arg(&copy).args(args));
    git(&["init", "--quiet"])?;
    git(&["add", "--all"])?;
    let author = ["-c", "user.name=hzn", "-c", "user.email=hzn@localhost"];
    git(&[&author[..], &["commit", "--quiet", "--message", "advisories"]].concat())?;
    Ok(copy)
}

/// Prints the parts of which the registry has a newer version. That is no fault, so nothing fails if it cannot be
/// asked. cargo-audit names the parts whose version was yanked.
fn list_old() -> Outcome {
    for lock in LOCKS {
        // Nothing is written, but `--locked` would refuse a newer version.
        let mut update = Command::new(steps::cargo_program());
        update.args(["update", "--dry-run", "--verbose", "--manifest-path"]);
        // cargo writes its list to stderr.
        let listed = update.arg(Path::new(lock).with_file_name("Cargo.toml")).output()?;
        let text = String::from_utf8_lossy(&listed.stderr);
        if !listed.status.success() {
            println!("{lock}: the registry cannot be asked for newer versions: {}", text.trim());
            continue;
        }
        let is_part =
            |line: &&str| ["Updating ", "Downgrading ", "Unchanged "].iter().any(|word| line.starts_with(word));
        let parts: Vec<&str> = text.lines().map(str::trim).filter(is_part).filter(|line| line.contains(" v")).collect();
        println!("{lock}: {} parts have a newer version:", parts.len());
        parts.iter().for_each(|part| println!("  {part}"));
    }
    Ok(())
}
