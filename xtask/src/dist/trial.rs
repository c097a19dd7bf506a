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
/// Most processor time from a file to its first answer, s. Wall time is printed, too, but it depends on what else the
/// machine does.
const LIMIT_S: f64 = 60.0;
/// Uses the library, and reads the licences: a link that was packed as a file has only a few bytes.
const IMPORT: &str = "\
import hzn, importlib.metadata
print(hzn.simulate('rocket-clean', frames=2)[1].image.shape, hzn.__version__)
texts = [file.read_text() for file in importlib.metadata.files('hzn-sensor') if 'LICENSE' in file.name]
assert len(texts) >= 2 and min(map(len, texts)) > 1000, [len(text) for text in texts]
[parts] = [file.read_text() for file in importlib.metadata.files('hzn-sensor') if 'THIRD-PARTY' in file.name]
assert 'pyo3' in parts and 'clap' in parts";
/// The licences, manual pages and completions of a package have at least this many bytes.
const TEXT_BYTES: u64 = 1000;

impl Dist {
    /// Runs the archive in an empty root folder, looks into the Debian package, and runs the wheel. A program for
    /// another processor runs in an emulator, and must give the rows of the program for this one.
    pub(super) fn try_files(&self) -> Outcome {
        if !self.is_linux() {
            self.need_own_processor()?;
            self.check_sums()?;
            let unpacked = fresh(&self.work().join("empty"))?;
            steps::run(self.tool("python").args(["-m", "zipfile", "-e"]).arg(self.archive()).arg(&unpacked))?;
            let alone = unpacked.join(self.name());
            let program = alone.join(self.built()?.file_name().unwrap_or_default());
            make_executable(&program)?;
            timed("the archive", LIMIT_S, || steps::run(Command::new(&program).arg("demo").current_dir(&alone)))?;
            return self.try_wheel();
        }
        self.check_sums()?;
        let flight = self.try_archive()?;
        self.try_deb()?;
        if self.has_own_processor() {
            self.try_wheel()?;
            return self.try_musl_wheel();
        }
        let ours = fresh(&self.work().join("ours"))?;
        steps::run(Command::new(self.own_program()?).arg("demo").current_dir(&ours))?;
        let mut compare = self.tool("python");
        compare.arg("xtask/same_rows.py").arg(ours.join("hzn-demo/flight.csv")).arg(flight);
        steps::run(&mut compare)?;
        println!("the wheel for {} is not run here; its own machine in the workflow `release` does", self.processor());
        self.try_musl_wheel()
    }

    fn has_own_processor(&self) -> bool {
        Some(self.processor()) == self.host.split('-').next()
    }

    fn need_own_processor(&self) -> Outcome {
        let why = || Trouble::Missing(format!("these files run only on {}", self.processor()));
        self.has_own_processor().then_some(()).ok_or_else(why)
    }

    /// Compares the checksums with the files, if they are written already.
    fn check_sums(&self) -> Outcome {
        let sums = self.out().join("SHA256SUMS");
        if sums.is_file() { self.pack("check-sums", &[&self.out()]) } else { Ok(()) }
    }

    /// Unpacks the archive, and runs its program where nothing else is. Returns the table that it writes.
    fn try_archive(&self) -> Result<PathBuf, Trouble> {
        let archive = self.archive();
        if !archive.is_file() {
            return Err(Trouble::Missing(format!("needs: cargo xtask dist --target {} archive", self.triple)));
        }
        let unpacked = fresh(&self.work().join("empty").join(&self.triple))?;
        steps::run(self.tool("python").args(["-m", "tarfile", "-e"]).arg(&archive).arg(&unpacked))?;
        let alone = unpacked.join(self.name());
        for text in ["LICENSE-MIT", "LICENSE-APACHE", "THIRD-PARTY.txt", "man/hzn-run.1", "completions/hzn.bash"] {
            need_text(&alone.join(text))?;
        }
        let mut run = self.command_alone(&alone)?;
        let (how, limit_s) = if self.has_own_processor() { ("", LIMIT_S) } else { (", emulated", f64::INFINITY) };
        let what = format!("the archive, in an empty root folder{how}");
        timed(&what, limit_s, || steps::run(run.arg("demo")))?;
        Ok(alone.join("hzn-demo/flight.csv"))
    }

    /// Returns a call of the program `hzn` in a folder that becomes the root folder, so that the program finds nothing
    /// else. Only root can do this; for others the folder is the working directory.
    fn command_alone(&self, alone: &Path) -> Result<Command, Trouble> {
        let emulator = if self.has_own_processor() { None } else { Some(self.emulator()?) };
        let is_root = output(Command::new("id").arg("-u")).is_some_and(|id| id == "0");
        // The folder has nothing that PATH could name: PATH is only for chroot itself.
        let path = std::env::var_os("PATH").unwrap_or_default();
        let can_change_root = is_root && has("chroot");
        if !can_change_root {
            println!("not in an empty root folder: that needs root and chroot");
        }
        let mut run = match (&emulator, can_change_root) {
            (Some(emulator), true) => {
                copy(emulator, &alone.join("emulator"))?;
                let mut run = Command::new("chroot");
                run.arg(alone).args(["/emulator", "/hzn"]);
                run
            }
            (None, true) => {
                let mut run = Command::new("chroot");
                run.arg(alone).arg("/hzn");
                run
            }
            (Some(emulator), false) => {
                let mut run = Command::new(emulator);
                run.arg(alone.join("hzn"));
                run
            }
            (None, false) => Command::new(alone.join("hzn")),
        };
        run.current_dir(alone).env_clear().env("PATH", path);
        Ok(run)
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
            "usr/share/zsh/vendor-completions/_hzn",
            "usr/share/fish/vendor_completions.d/hzn.fish",
        ] {
            if !unpacked.join(part).is_file() {
                return Err(Trouble::Failed(format!("{} is without {part}", package.display())));
            }
        }
        for text in ["copyright", "THIRD-PARTY.txt"] {
            need_text(&unpacked.join("usr/share/doc/hzn").join(text))?;
        }
        steps::run(self.command_alone(&unpacked.join("usr/bin"))?.arg("--version"))
    }

    /// Runs the program of the wheel for musl. Its library needs an interpreter that was built for musl, which the
    /// workflow `release` has.
    fn try_musl_wheel(&self) -> Outcome {
        let wheel = only_file(&self.wheels("musllinux_1_2"))
            .map_err(|_| Trouble::Missing("needs: cargo xtask dist musl-wheel".into()))?;
        self.check_glibc(&wheel)?;
        let unpacked = fresh(&self.work().join("unpacked-wheel"))?;
        steps::run(self.tool("python").args(["-m", "zipfile", "-e"]).arg(&wheel).arg(&unpacked))?;
        let scripts = unpacked.join(format!("hzn_sensor-{}.data/scripts", self.version));
        make_executable(&scripts.join("hzn"))?;
        for text in ["LICENSE-MIT", "LICENSE-APACHE", "THIRD-PARTY.txt"] {
            need_text(&unpacked.join(format!("hzn_sensor-{}.dist-info/licenses", self.version)).join(text))?;
        }
        steps::run(self.command_alone(&scripts)?.arg("--version"))
    }

    fn try_wheel(&self) -> Outcome {
        let wheel = only_file(&self.wheels("manylinux2014"))
            .map_err(|_| Trouble::Missing("needs: cargo xtask dist wheel".into()))?;
        self.check_glibc(&wheel)?;
        self.try_from_empty_home(&wheel)?;
        let found = interpreters();
        for (minor, python) in &found {
            let environment = fresh(&self.work().join("venv"))?;
            steps::run(Command::new(python).args(["-m", "venv"]).arg(&environment))?;
            let bin = environment.join(if cfg!(windows) { "Scripts" } else { "bin" });
            let away = fresh(&self.work().join("away"))?;
            timed(&format!("the wheel, in a new environment of Python 3.{minor}"), LIMIT_S, || {
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

    /// Runs the wheel as someone does who has only uv, and has never used it: every folder that it could know is empty.
    fn try_from_empty_home(&self, wheel: &Path) -> Outcome {
        let home = fresh(&self.work().join("home"))?;
        let mut run = self.tool("uv");
        run.args(["tool", "run", "--from"]).arg(wheel).args(["hzn", "demo"]).current_dir(&home).env("HOME", &home);
        for name in ["XDG_CACHE_HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "UV_CACHE_DIR", "UV_TOOL_DIR"] {
            run.env(name, home.join(name));
        }
        timed("the wheel, by uv from an empty home folder", LIMIT_S, || steps::run(&mut run))
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

/// Fails if a text is missing or too short: a link that was packed as a file has only a few bytes.
fn need_text(path: &Path) -> Outcome {
    let bytes = fs::metadata(path).map_or(0, |about| about.len());
    let short = || Trouble::Failed(format!("{}: {bytes} bytes are too few", path.display()));
    (bytes > TEXT_BYTES).then_some(()).ok_or_else(short)
}

/// Lets a file be executed: `zipfile` of Python unpacks without the permissions.
fn make_executable(_path: &Path) -> Outcome {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        fs::set_permissions(_path, fs::Permissions::from_mode(0o755))?;
    }
    Ok(())
}

/// Runs the way to a first answer, prints its time, and fails if it takes more than the limit.
fn timed(what: &str, limit_s: f64, run: impl FnOnce() -> Outcome) -> Outcome {
    let (began, used) = (Instant::now(), processor_seconds());
    run()?;
    let took_s = processor_seconds().zip(used).map(|(now, then)| now - then);
    let wall_s = began.elapsed().as_secs_f64();
    println!("{what}: first answer after {wall_s:.1} s, {:.1} s of processors", took_s.unwrap_or(f64::NAN));
    if took_s.unwrap_or(wall_s) > limit_s {
        return Err(Trouble::Failed(format!("{what}: the first answer takes longer than {limit_s} s")));
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
