//! Runs the files of a release as their users do: the program in an empty root folder, the wheel in a new environment
//! of each Python that this machine has.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use super::{Dist, copy, fresh, only_file};
use crate::machine::{apt_install, has, output};
use crate::steps::{self, Outcome, Trouble, processor_seconds};

/// The versions of Python 3 that the wheel is tried with.
const MINORS: std::ops::RangeInclusive<u32> = 10..=14;
/// Most processor time from a file to its first answer, s. Wall time would depend on what else the machine does.
const LIMIT_S: f64 = 60.0;
const IMPORT: &str = "import hzn; print(hzn.simulate('rocket-clean', frames=2)[1].image.shape, hzn.__version__)";

impl Dist {
    /// Runs the archive in an empty root folder, looks into the Debian package, and runs the wheel. A program for
    /// another processor runs in an emulator, and must give the rows of the program for this one.
    pub(super) fn try_files(&self) -> Outcome {
        if !self.is_linux() {
            self.need_own_processor()?;
            let empty = fresh(&self.work().join("empty"))?;
            return steps::run(Command::new(self.built()?).arg("demo").current_dir(&empty))
                .and_then(|()| self.try_wheel());
        }
        let flight = self.try_archive()?;
        if self.has_own_processor() {
            self.try_deb()?;
            return self.try_wheel();
        }
        let ours = fresh(&self.work().join("ours"))?;
        steps::run(Command::new(self.own_program()?).arg("demo").current_dir(&ours))?;
        let mut compare = self.tool("python");
        compare.arg("xtask/same_rows.py").arg(ours.join("hzn-demo/flight.csv")).arg(flight);
        steps::run(&mut compare)?;
        println!("the wheel for {} is not run here; its own machine in the workflow `release` does", self.processor());
        Ok(())
    }

    fn has_own_processor(&self) -> bool {
        Some(self.processor()) == self.host.split('-').next()
    }

    fn need_own_processor(&self) -> Outcome {
        let why = || Trouble::Missing(format!("these files run only on {}", self.processor()));
        self.has_own_processor().then_some(()).ok_or_else(why)
    }

    /// Unpacks the archive, and runs its program where nothing else is. Returns the table that it writes.
    fn try_archive(&self) -> Result<PathBuf, Trouble> {
        let archive = self.out().join(format!("{}.tar.xz", self.name()));
        if !archive.is_file() {
            return Err(Trouble::Missing(format!("needs: cargo xtask dist --target {} archive", self.triple)));
        }
        let unpacked = fresh(&self.work().join("empty").join(&self.triple))?;
        steps::run(self.tool("python").args(["-m", "tarfile", "-e"]).arg(&archive).arg(&unpacked))?;
        let alone = unpacked.join(self.name());
        let emulator = if self.has_own_processor() { None } else { Some(self.emulator()?) };
        let is_root = output(Command::new("id").arg("-u")).is_some_and(|id| id == "0");
        // The folder has nothing that PATH could name: PATH is only for chroot itself.
        let path = std::env::var_os("PATH").unwrap_or_default();
        let mut run = match (&emulator, is_root && has("chroot")) {
            (Some(emulator), true) => {
                copy(emulator, &alone.join("emulator"))?;
                let mut run = Command::new("chroot");
                run.arg(&alone).args(["/emulator", "/hzn"]);
                run
            }
            (None, true) => {
                let mut run = Command::new("chroot");
                run.arg(&alone).arg("/hzn");
                run
            }
            (Some(emulator), false) => {
                let mut run = Command::new(emulator);
                run.arg(alone.join("hzn"));
                run
            }
            (None, false) => Command::new(alone.join("hzn")),
        };
        run.arg("demo").current_dir(&alone).env_clear().env("PATH", path);
        let first = || steps::run(&mut run);
        if emulator.is_none() {
            timed("the archive, in an empty root folder", first)?
        } else {
            steps::run(&mut run)?
        }
        Ok(alone.join("hzn-demo/flight.csv"))
    }

    /// Returns the program that runs programs of the other processor. It is static, so it runs in an empty folder, too.
    fn emulator(&self) -> Result<PathBuf, Trouble> {
        let name = format!("qemu-{}-static", self.processor());
        if !has(&name) {
            apt_install(&["qemu-user-static"])?;
        }
        let paths = std::env::var_os("PATH").unwrap_or_default();
        let found = std::env::split_paths(&paths).map(|dir| dir.join(&name)).find(|path| path.is_file());
        found.ok_or_else(|| Trouble::Missing(format!("needs {name}")))
    }

    /// Unpacks the Debian package without installing it, and looks for what it should have.
    fn try_deb(&self) -> Outcome {
        let package = self.deb()?;
        if !package.is_file() {
            return Err(Trouble::Missing("needs: cargo xtask dist deb".into()));
        }
        if !has("dpkg-deb") {
            println!("{} is not unpacked: there is no dpkg-deb", package.display());
            return Ok(());
        }
        steps::run(Command::new("dpkg-deb").arg("--info").arg(&package))?;
        let unpacked = fresh(&self.work().join("unpacked"))?;
        steps::run(Command::new("dpkg-deb").arg("--extract").arg(&package).arg(&unpacked))?;
        for part in [
            "usr/share/man/man1/hzn.1.gz",
            "usr/share/man/man1/hzn-run.1.gz",
            "usr/share/bash-completion/completions/hzn",
            "usr/share/doc/hzn/copyright",
        ] {
            if !unpacked.join(part).is_file() {
                return Err(Trouble::Failed(format!("{} is without {part}", package.display())));
            }
        }
        steps::run(Command::new(unpacked.join("usr/bin/hzn")).arg("--version"))
    }

    fn try_wheel(&self) -> Outcome {
        let wheel = only_file(&self.wheels("manylinux2014"))
            .map_err(|_| Trouble::Missing("needs: cargo xtask dist wheel".into()))?;
        self.check_glibc(&wheel)?;
        let found = interpreters();
        for (minor, python) in &found {
            let environment = fresh(&self.work().join("venv"))?;
            steps::run(Command::new(python).args(["-m", "venv"]).arg(&environment))?;
            let bin = environment.join(if cfg!(windows) { "Scripts" } else { "bin" });
            let away = fresh(&self.work().join("away"))?;
            timed(&format!("the wheel, in a new environment of Python 3.{minor}"), || {
                let pip = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check"];
                steps::run(Command::new(bin.join("python")).args(pip).arg(&wheel))?;
                steps::run(Command::new(bin.join("hzn")).arg("demo").current_dir(&away))
            })?;
            steps::run(Command::new(bin.join("python")).args(["-c", IMPORT]).current_dir(&away))?;
        }
        let missing = MINORS.filter(|minor| !found.iter().any(|(have, _)| have == minor));
        missing.for_each(|minor| println!("Python 3.{minor}: not run here; the workflow `release` runs it"));
        if found.is_empty() { Err(Trouble::Missing("needs Python 3.10 or later".into())) } else { Ok(()) }
    }

    /// Fails if a wheel needs a newer glibc than that of manylinux2014, or if one for musl needs any.
    pub(super) fn check_glibc(&self, wheel: &Path) -> Outcome {
        if !self.is_linux() {
            return Ok(());
        }
        let newest = output(self.tool("python").args(["xtask/pack.py", "glibc"]).arg(wheel)).unwrap_or_default();
        println!("{} needs GLIBC {newest}", wheel.display());
        let is_musl = wheel.to_string_lossy().contains("musllinux");
        let minor = newest.strip_prefix("2.").and_then(|rest| rest.split('.').next()?.parse::<u32>().ok());
        if if is_musl { newest == "none" } else { minor.is_some_and(|minor| minor <= 17) } {
            return Ok(());
        }
        Err(Trouble::Failed(format!("the wheel needs GLIBC {newest}; manylinux2014 has 2.17, and musllinux has none")))
    }
}

/// Runs the way to a first answer, prints its time, and fails if it takes too long.
fn timed(what: &str, run: impl FnOnce() -> Outcome) -> Outcome {
    let (began, used) = (Instant::now(), processor_seconds());
    run()?;
    let took_s = processor_seconds().zip(used).map(|(now, then)| now - then);
    let wall_s = began.elapsed().as_secs_f64();
    println!("{what}: first answer after {wall_s:.1} s, {:.1} s of processors", took_s.unwrap_or(f64::NAN));
    if took_s.unwrap_or(wall_s) > LIMIT_S {
        return Err(Trouble::Failed(format!("{what}: the first answer takes longer than {LIMIT_S} s")));
    }
    Ok(())
}

/// Returns each version of Python 3 that this machine has, with its program: those on PATH, and those of pyenv.
fn interpreters() -> Vec<(u32, PathBuf)> {
    let home = std::env::var_os("HOME").or_else(|| std::env::var_os("USERPROFILE")).unwrap_or_default();
    let pyenv = std::env::var_os("PYENV_ROOT").map_or_else(|| Path::new(&home).join(".pyenv"), PathBuf::from);
    let installed = fs::read_dir(pyenv.join("versions")).into_iter().flatten().flatten();
    let mut candidates: Vec<PathBuf> = MINORS.map(|minor| format!("python3.{minor}").into()).collect();
    candidates.extend(installed.map(|entry| entry.path().join("bin/python")));
    candidates.extend(["python3", "python"].map(PathBuf::from));
    let mut found: Vec<(u32, PathBuf)> = Vec::new();
    for python in candidates {
        let version = "import ensurepip, sys, venv; assert sys.version_info[0] == 3; print(sys.version_info[1])";
        let minor = output(Command::new(&python).args(["-c", version])).and_then(|minor| minor.parse().ok());
        if let Some(minor) = minor.filter(|minor| *minor >= *MINORS.start() && !found.iter().any(|(m, _)| m == minor)) {
            found.push((minor, python));
        }
    }
    found.sort();
    found
}
