//! Makes the files of a release: the program as an archive and as a Debian package, the wheel with the library and the
//! program, the lists of parts, and their checksums.

#[cfg(test)]
mod tests;
mod trial;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::machine::{need_target, output, root, target};
use crate::python;
use crate::steps::{self, Outcome, Trouble, cargo, cargo_program};

const USAGE: &str = "usage: cargo xtask dist [--target TRIPLE] [--profile NAME] [PART]...
  without PART, all of: program, archive, deb, wheel, musl-wheel, parts, sums, try; `crates` and `systems` run only if \
  they are named";

/// Makes a part.
type Make = fn(&Dist) -> Outcome;

/// Parts that run only if they are named: they make no file. `crates` compiles each published crate alone, which takes
/// long. `systems` checks that the command compiles for systems that this machine cannot make files for.
const ONLY_NAMED: &[&str] = &["crates", "systems"];

/// Systems that the command is checked for, with zig as compiler of the parts in C.
const SYSTEMS: &[&str] = &["x86_64-pc-windows-gnu", "aarch64-apple-darwin"];

/// What is made, in this order.
const PARTS: &[(&str, Make)] = &[
    ("crates", Dist::check_crates),
    ("systems", Dist::check_systems),
    ("program", Dist::build_program),
    ("archive", Dist::make_archive),
    ("deb", Dist::make_deb),
    ("wheel", Dist::make_wheel),
    ("musl-wheel", Dist::make_musl_wheel),
    ("parts", Dist::list_parts),
    ("sums", Dist::write_sums),
    ("try", Dist::try_files),
];

/// Packages that are not published.
const UNPUBLISHED: &[&str] = &[
    "hzn-py",
    "hzn-web",
    "hzn-tests",
    "hzn-fuzz",
    "hzn-reproduce",
    "hzn-benches",
    "xtask",
    "hzn-c",
    "hzn-firmware",
    "hzn-mps2",
    "hzn-setup",
    "hzn-stm32f405",
    "hzn-stm32h743",
    "hzn-supply",
    "hzn-virt",
];

/// Returns the arguments of cargo that leave out the packages that are not published.
pub(crate) fn exclude_unpublished() -> Vec<String> {
    UNPUBLISHED.iter().map(|name| format!("--exclude={name}")).collect()
}

/// A release for one kind of machine.
struct Dist {
    /// The kind of machine. On Linux the program is static (musl), so that it runs on every distribution.
    triple: String,
    /// The kind of this machine.
    host: String,
    profile: String,
    version: String,
    /// Time of the commit, which all files have.
    time: String,
    /// Python with maturin, cargo-zigbuild and zig.
    python: PathBuf,
}

/// Makes the parts that the arguments name. A part that this machine cannot make is named with what it needs.
fn make(args: &[String]) -> Outcome {
    std::env::set_current_dir(root())?;
    let wrong = |what: String| Trouble::Failed(format!("{what}\n{USAGE}"));
    let (mut triple, mut profile, mut wanted) = (None, "dist".to_owned(), Vec::new());
    let mut args = args.iter();
    while let Some(arg) = args.next() {
        let mut value = || args.next().cloned().ok_or_else(|| wrong(format!("{arg}: a value is missing")));
        match arg.as_str() {
            "--target" => triple = Some(value()?),
            "--profile" => profile = value()?,
            part if PARTS.iter().any(|(name, _)| *name == part) => wanted.push(part),
            other => return Err(wrong(format!("{other} is neither an option nor a part"))),
        }
    }
    let dist = Dist::new(triple, profile)?;
    let selected = PARTS.iter().filter(|(name, _)| match wanted.as_slice() {
        [] => !ONLY_NAMED.contains(name),
        wanted => wanted.contains(name),
    });
    let mut left_out = Vec::new();
    for (name, make) in selected {
        println!("\n== {name}");
        match make(&dist) {
            Ok(()) => {}
            Err(Trouble::Missing(why)) => left_out.push(format!("{name}: left out, {why}")),
            Err(Trouble::Failed(why)) => return Err(Trouble::Failed(format!("{name}: {why}"))),
        }
    }
    println!("\n{}", dist.out().display());
    left_out.iter().for_each(|line| println!("{line}"));
    if left_out.is_empty() { Ok(()) } else { Err(Trouble::Missing(left_out.join("; "))) }
}

/// Makes the parts that the arguments name. With `CI=true`, nothing may be left out.
pub(crate) fn run(args: &[String]) -> Result<(), String> {
    match make(args) {
        Err(Trouble::Missing(why)) if std::env::var("CI").is_ok_and(|v| v == "true") => Err(why),
        Ok(()) | Err(Trouble::Missing(_)) => Ok(()),
        Err(Trouble::Failed(why)) => Err(why),
    }
}

/// Makes the files of a release for this machine and tries them. Then makes those for the other processor, and compares
/// the answers of its program. Last, checks the command for other systems.
pub(crate) fn try_release() -> Outcome {
    let make = |args: &[&str]| make(&args.iter().map(|arg| (*arg).to_owned()).collect::<Vec<_>>());
    make(&[])?;
    if !cfg!(all(target_os = "linux", target_arch = "x86_64")) {
        return Ok(());
    }
    make(&["--target", "aarch64-unknown-linux-musl"])?;
    make(&["systems"])
}

impl Dist {
    fn new(triple: Option<String>, profile: String) -> Result<Self, Trouble> {
        let failed = |what: &str| Trouble::Failed(what.to_owned());
        let about = output(Command::new("rustc").arg("-vV")).ok_or_else(|| failed("rustc cannot be started"))?;
        let host = about.lines().find_map(|line| line.strip_prefix("host: "));
        let host = host.ok_or_else(|| failed("rustc does not say its host"))?.to_owned();
        let manifest = fs::read_to_string("Cargo.toml")?;
        let version = manifest.lines().find_map(|line| line.strip_prefix("version = \"")?.strip_suffix('"'));
        let time = output(Command::new("git").args(["log", "-1", "--format=%ct"]));
        Ok(Self {
            triple: triple.unwrap_or_else(|| host.replace("-linux-gnu", "-linux-musl")),
            host,
            profile,
            version: version.ok_or_else(|| failed("Cargo.toml has no version"))?.to_owned(),
            time: time.unwrap_or_else(|| "315532800".to_owned()),
            python: python::prepare_environment("dist", Path::new("xtask/dist-requirements.txt"))?,
        })
    }

    fn is_linux(&self) -> bool {
        self.triple.contains("-linux-")
    }
    /// Returns the kind of processor, such as `x86_64`.
    fn processor(&self) -> &str {
        self.triple.split('-').next().unwrap_or_default()
    }
    /// Returns the folder of the finished files. `target/dist` is that of cargo for the profile `dist`.
    fn out(&self) -> PathBuf {
        target().join("release-files")
    }
    /// Returns a folder for files on the way.
    fn work(&self) -> PathBuf {
        target().join("xtask/dist")
    }
    /// Returns the name of the archive, without its ending.
    fn name(&self) -> String {
        format!("hzn-{}-{}", self.version, self.triple)
    }
    /// Returns the path of the archive.
    fn archive(&self) -> PathBuf {
        let ending = if self.is_linux() { "tar.xz" } else { "zip" };
        self.out().join(format!("{}.{ending}", self.name()))
    }

    fn program(&self, triple: &str) -> PathBuf {
        let name = if triple.contains("windows") { "hzn.exe" } else { "hzn" };
        let built = self.work().join("build").join(triple).join(&self.profile);
        built.join(name)
    }

    /// Returns a program that runs here, for its completions and manual pages, which are the same on every machine.
    fn own_program(&self) -> Result<PathBuf, Trouble> {
        let own = self.program(&self.host.replace("-linux-gnu", "-linux-musl"));
        let needs = || Trouble::Missing("needs the program for this machine: cargo xtask dist program".into());
        own.is_file().then_some(own).ok_or_else(needs)
    }

    fn built(&self) -> Result<PathBuf, Trouble> {
        let program = self.program(&self.triple);
        let needs = || Trouble::Missing(format!("needs: cargo xtask dist --target {} program", self.triple));
        program.is_file().then_some(program).ok_or_else(needs)
    }

    /// Returns a call of a tool of the environment, which finds zig.
    fn tool(&self, name: &str) -> Command {
        let bin = self.python.parent().unwrap_or(Path::new("")).to_path_buf();
        let mut command = Command::new(bin.join(name));
        let path = std::env::var_os("PATH").unwrap_or_default();
        let all = std::iter::once(bin).chain(std::env::split_paths(&path));
        command.env("PATH", std::env::join_paths(all).unwrap_or(path.clone()));
        command.env("CARGO_INCREMENTAL", "0").env("SOURCE_DATE_EPOCH", &self.time);
        command
    }

    fn pack(&self, what: &str, paths: &[&Path]) -> Outcome {
        steps::run(self.tool("python").arg("xtask/pack.py").arg(what).args(paths))
    }

    /// Compiles each published crate from its package, in the order of their dependencies.
    fn check_crates(&self) -> Outcome {
        let mut publish = cargo(&["publish", "--workspace", "--dry-run"]);
        publish.args(exclude_unpublished());
        steps::run(publish.arg("--target-dir").arg(self.work().join("crates")))
    }

    /// Checks that the command compiles for other systems. It is not linked, because that needs their libraries.
    fn check_systems(&self) -> Outcome {
        for triple in SYSTEMS {
            need_target(triple)?;
            let mut check = self.tool("cargo-zigbuild");
            check.args(["check", "--locked", "--package", "hzn-cli", "--target", triple]);
            steps::run(check.arg("--target-dir").arg(self.work().join("systems")))?;
        }
        Ok(())
    }

    fn build_program(&self) -> Outcome {
        need_target(&self.triple)?;
        let mut build = if self.is_linux() {
            let mut zig = self.tool("cargo-zigbuild");
            zig.arg("zigbuild");
            zig
        } else {
            let mut native = Command::new(cargo_program());
            native.arg("build").env("CARGO_INCREMENTAL", "0");
            native
        };
        build.args(["--locked", "--profile", &self.profile, "--target", &self.triple]);
        build.args(["--package", "hzn-cli", "--bin", "hzn", "--target-dir"]).arg(self.work().join("build"));
        steps::run(&mut build)
    }

    /// Writes completions into a folder, and manual pages where `hzn` has them.
    fn write_helps(&self, bash: &Path, zsh: &Path, fish: &Path, man: &Path) -> Outcome {
        let own = self.own_program()?;
        for (shell, path) in [("bash", bash), ("zsh", zsh), ("fish", fish)] {
            let made = Command::new(&own).args(["completions", shell]).output()?;
            if !made.status.success() {
                return Err(Trouble::Failed(format!("hzn completions {shell} ended with {}", made.status)));
            }
            write(path, &made.stdout)?;
        }
        fs::create_dir_all(man)?;
        if output(Command::new(&own).args(["man", "--help"])).is_none() {
            println!("no manual pages: this hzn has no command `man`");
            return Ok(());
        }
        steps::run(Command::new(&own).args(["man", "--force", "--output"]).arg(man))
    }

    fn make_archive(&self) -> Outcome {
        let program = self.built()?;
        let folder = fresh(&self.work().join(self.name()))?;
        copy(&program, &folder.join(program.file_name().unwrap_or_default()))?;
        for text in ["README.md", "CHANGELOG.md", "LICENSE-MIT", "LICENSE-APACHE"] {
            copy(Path::new(text), &folder.join(text))?;
        }
        copy(&self.supply(&self.triple)?.join("THIRD-PARTY.txt"), &folder.join("THIRD-PARTY.txt"))?;
        let shells = folder.join("completions");
        let [bash, zsh, fish] = ["hzn.bash", "_hzn", "hzn.fish"].map(|name| shells.join(name));
        self.write_helps(&bash, &zsh, &fish, &folder.join("man"))?;
        fs::create_dir_all(self.out())?;
        self.pack("archive", &[&folder, &self.archive()])
    }

    /// Returns Debian's name of the processor.
    fn debian_processor(&self) -> Result<&'static str, Trouble> {
        match (self.is_linux(), self.processor()) {
            (true, "x86_64") => Ok("amd64"),
            (true, "aarch64") => Ok("arm64"),
            _ => Err(Trouble::Missing("it is only for Linux on x86_64 and aarch64".into())),
        }
    }

    /// Returns the path of the Debian package.
    fn deb(&self) -> Result<PathBuf, Trouble> {
        Ok(self.out().join(format!("hzn_{}_{}.deb", self.version, self.debian_processor()?)))
    }

    fn make_deb(&self) -> Outcome {
        let processor = self.debian_processor()?;
        let program = self.built()?;
        let folder = fresh(&self.work().join("deb"))?;
        let usr = folder.join("root/usr");
        copy(&program, &usr.join("bin/hzn"))?;
        let share = usr.join("share");
        self.write_helps(
            &share.join("bash-completion/completions/hzn"),
            &share.join("zsh/vendor-completions/_hzn"),
            &share.join("fish/vendor_completions.d/hzn.fish"),
            &share.join("man/man1"),
        )?;
        let licences = ["LICENSE-MIT", "LICENSE-APACHE"].map(fs::read_to_string);
        let [mit, apache] = licences;
        let rights = format!(
            "hzn is licensed under MIT or Apache-2.0, at your choice. THIRD-PARTY.txt has the licences of its \
             parts.\n\n{}\n\n{}",
            mit?, apache?
        );
        write(&share.join("doc/hzn/copyright"), rights.as_bytes())?;
        copy(&self.supply(&self.triple)?.join("THIRD-PARTY.txt"), &share.join("doc/hzn/THIRD-PARTY.txt"))?;
        let kilobytes = bytes_in(&folder.join("root"))? / 1024;
        let control = format!(
            "Package: hzn\nVersion: {}\nArchitecture: {processor}\nMaintainer: the hzn project <hzn@localhost>\n\
             Installed-Size: {kilobytes}\nRecommends: ffmpeg\nSection: science\nPriority: optional\n\
             Description: horizon sensor\n From a picture of a planet's limb to the direction of the planet, with a \
             covariance\n that a navigation filter can use.\n",
            self.version
        );
        write(&folder.join("debian/control"), control.as_bytes())?;
        fs::create_dir_all(self.out())?;
        self.pack("deb", &[&folder, &self.deb()?])
    }

    /// Returns the folder of a finished wheel.
    fn wheels(&self, standard: &str) -> PathBuf {
        self.work().join("wheels").join(self.processor()).join(standard)
    }

    /// Makes the wheel. On Linux its library needs only the GLIBC of manylinux2014, and the program is the static one.
    fn make_wheel(&self) -> Outcome {
        self.make_wheel_for(&self.triple.replace("-linux-musl", "-linux-gnu"), "manylinux2014")
    }

    /// Makes the wheel for systems whose C library is musl, such as Alpine.
    fn make_musl_wheel(&self) -> Outcome {
        if !self.is_linux() {
            return Err(Trouble::Missing("it is only for Linux".into()));
        }
        self.make_wheel_for(&self.triple.replace("-linux-gnu", "-linux-musl"), "musllinux_1_2")
    }

    fn make_wheel_for(&self, triple: &str, standard: &str) -> Outcome {
        let program = self.built()?;
        let wheels = fresh(&self.wheels(standard))?;
        need_target(triple)?;
        let mut maturin = self.tool("python");
        maturin.args(["-m", "maturin", "build", "--locked", "--profile", &self.profile, "--target", triple]);
        maturin.args(["--manifest-path", "crates/hzn-py/Cargo.toml", "--out"]).arg(&wheels);
        // A library for musl is not linked as the static program is: neither replaces what the other has compiled.
        let folder = if standard.starts_with("musl") { "build-musl-wheel" } else { "build" };
        maturin.arg("--target-dir").arg(self.work().join(folder));
        if self.is_linux() {
            maturin.args(["--zig", "--compatibility", standard]);
        }
        steps::run(&mut maturin)?;
        let wheel = only_file(&wheels)?;
        // The notices are those of program and library.
        self.pack("wheel", &[&wheel, &program, &self.supply(triple)?.join("THIRD-PARTY.txt")])?;
        self.check_glibc(&wheel)?;
        copy(&wheel, &self.out().join(wheel.file_name().unwrap_or_default()))
    }

    /// Returns the folder with the lists of parts and the notices of their licences: each system has parts of its own.
    fn supply(&self, triple: &str) -> Result<PathBuf, Trouble> {
        let lists = self.work().join("sbom").join(triple);
        steps::run(cargo(&["run", "--quiet", "--package", "hzn-supply", "--"]).arg(&lists).arg(triple))?;
        Ok(lists)
    }

    /// Writes the lists of parts. The library in a wheel for glibc has parts of another system than the static program.
    fn list_parts(&self) -> Outcome {
        let glibc = self.triple.replace("-linux-musl", "-linux-gnu");
        let mut wanted = vec![("hzn-cli", &self.triple), ("hzn-py", &self.triple)];
        if glibc != self.triple {
            wanted.push(("hzn-py", &glibc));
        }
        for (product, triple) in wanted {
            let name = format!("{product}-{}-{triple}.cdx.json", self.version);
            copy(&self.supply(triple)?.join(format!("{product}.cdx.json")), &self.out().join(name))?;
        }
        Ok(())
    }

    /// Writes the checksums of all files of this version. Files of other versions are removed.
    fn write_sums(&self) -> Outcome {
        for path in fs::read_dir(self.out())?.flatten().map(|entry| entry.path()) {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            if path.is_file() && name != "SHA256SUMS" && !name.contains(&self.version) {
                fs::remove_file(&path)?;
            }
        }
        self.pack("sums", &[&self.out()])
    }
}

/// Returns the size of all files in a folder.
fn bytes_in(folder: &Path) -> Result<u64, Trouble> {
    let mut bytes = 0;
    for entry in fs::read_dir(folder)?.flatten() {
        let path = entry.path();
        bytes += if path.is_dir() { bytes_in(&path)? } else { fs::metadata(&path)?.len() };
    }
    Ok(bytes)
}

/// Returns an empty folder with this path.
fn fresh(folder: &Path) -> Result<PathBuf, Trouble> {
    if folder.exists() {
        fs::remove_dir_all(folder)?;
    }
    fs::create_dir_all(folder)?;
    Ok(fs::canonicalize(folder)?)
}

fn copy(from: &Path, to: &Path) -> Outcome {
    to.parent().map_or(Ok(()), fs::create_dir_all)?;
    fs::copy(from, to).map_err(|e| Trouble::Failed(format!("{}: {e}", from.display())))?;
    Ok(())
}

fn write(path: &Path, contents: &[u8]) -> Outcome {
    path.parent().map_or(Ok(()), fs::create_dir_all)?;
    Ok(fs::write(path, contents)?)
}

fn only_file(folder: &Path) -> Result<PathBuf, Trouble> {
    let mut found = fs::read_dir(folder)?.flatten().map(|entry| entry.path());
    found.next().ok_or_else(|| Trouble::Failed(format!("{} is empty", folder.display())))
}
