//! Builds the images of `firmware/` for the emulated boards, inspects them and runs them in QEMU.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::flight_build::Toolchain;
use crate::machine::{apt_install, output, root, target};
use crate::soft_double;
use crate::steps::{self, Outcome, Steps, Trouble, cargo};
use crate::test_build::build_tests;

/// A board that QEMU emulates.
struct Board {
    name: &'static str,
    package: &'static str,
    /// Flags of the compiler for the core.
    flags: &'static str,
    images: &'static [&'static str],
}
const BOARDS: [Board; 3] = [
    Board { name: "an386", package: "hzn-mps2", flags: "", images: &IMAGES },
    Board { name: M7, package: "hzn-mps2", flags: M7_FLAGS, images: &IMAGES },
    Board { name: "stm32f405", package: "hzn-stm32f405", flags: "", images: &["example", "flight"] },
];
const M7: &str = "an500";
const M7_FLAGS: &str = "-C target-cpu=cortex-m7";
/// Images of the boards with memory for pictures.
const IMAGES: [&str; 6] = ["chain", "flight", "line", "measure", "nav", "rows"];
/// Folder of the port with a hardware library.
const VENDOR_PORT: &str = "firmware/stm32h743";
/// Document with the costs.
const COSTS: &str = "book/results/firmware-cost.md";

impl Board {
    /// Builds the images in a clone of this repository, or runs another verb of cargo with further arguments. Returns
    /// the folder of the images.
    fn build(
        &self,
        toolchain: Toolchain,
        verb: &str,
        dir: &str,
        clone: &Path,
        more: &[&str],
    ) -> Result<PathBuf, Trouble> {
        let features = if self.package == "hzn-mps2" { &["--features", self.name][..] } else { &[] };
        let args = [&["--package", self.package], features, more].concat();
        let (mut command, built) = toolchain.cargo(verb, dir, &args);
        steps::run(configure_for_firmware(&mut command, self.flags).current_dir(clone.join("firmware")))?;
        Ok(built)
    }
}

/// Builds every image and puts it where the tests find it: `target/firmware/BOARD/images`.
pub(crate) fn build() -> Outcome {
    apt_install(&["qemu-system-arm", "binutils-arm-none-eabi", "gcc-arm-none-eabi"])?;
    let toolchain = Toolchain::find()?;
    for board in BOARDS {
        let built = board.build(toolchain, "build", &format!("firmware/{}", board.name), &root(), &[])?;
        let images = images(board.name);
        fs::create_dir_all(&images)?;
        for image in board.images {
            fs::copy(built.join(image), images.join(image))?;
            check_no_panics(board.name, image)?;
        }
    }
    Ok(())
}

/// Builds the images of a clone of this repository, and compares their bytes with the images here.
pub(crate) fn is_the_same_elsewhere(clone: &Path) -> Outcome {
    build()?;
    for board in BOARDS {
        let dir = format!("xtask/elsewhere/{}", board.name);
        let built = board.build(Toolchain::find()?, "build", &dir, clone, &[])?;
        for image in board.images {
            steps::compare_bytes(
                &format!("{} {image}", board.name),
                &images(board.name).join(image),
                &built.join(image),
            )?;
        }
    }
    let here = build_vendor_port(VENDOR_PORT, &root())?;
    let there = build_vendor_port("xtask/elsewhere/stm32h743", clone)?;
    steps::compare_bytes("stm32h743 flight", &here, &there)
}

/// Builds what the image tests need, then runs the tests and checks the costs and the C interface.
pub(crate) fn test(steps: &mut Steps) -> Outcome {
    build()?;
    soft_double::check(&images("an386").join("measure"))?;
    build_flight_image(METHODS)?;
    let vendor_port = build_vendor_port(VENDOR_PORT, &root())?;
    lint_and_document()?;
    build_tests()?;
    steps::run(Command::new(target().join("debug/examples/stack_bound")).arg(vendor_port))?;
    // Without a package's name nothing is built again with other features.
    let names = ["firmware", "line_cost", "navigation", "recovery", "silence"];
    let tests: Vec<&str> = names.iter().flat_map(|name| ["--test", name]).collect();
    steps.cargo_test(&[&tests[..], &["--", "--ignored"]].concat())?;
    steps::run(Command::new(target().join("debug/examples/firmware_cost")).args(["--check", COSTS]))?;
    check_c_interface()
}

/// Runs the lints, the documentation build and the tests of the firmware workspace. A test checks that the C header
/// agrees with the library.
fn lint_and_document() -> Outcome {
    let dir = target().join("firmware/host");
    let here = ["--package", "hzn-c"];
    let on_this_machine = |verb: &str| {
        let mut command = cargo(&[verb]);
        command.arg("--target-dir").arg(&dir).args(here);
        command
    };
    steps::run(configure_for_firmware(on_this_machine("test").arg("--quiet"), ""))?;
    steps::run(configure_for_firmware(on_this_machine("clippy").args(["--all-targets", "--", "-D", "warnings"]), ""))?;
    steps::run(configure_for_firmware(on_this_machine("doc").arg("--no-deps").env("RUSTDOCFLAGS", "-D warnings"), ""))?;
    let toolchain = Toolchain::find()?;
    if matches!(toolchain, Toolchain::Debian) {
        println!("lints of the images are skipped: Debian's Rust has no clippy for the target");
        return Ok(());
    }
    for board in BOARDS {
        board.build(toolchain, "clippy", &format!("firmware/{}", board.name), &root(), &["--", "-D", "warnings"])?;
    }
    Ok(())
}

/// Every feature that adds methods to hzn-core.
const METHODS: &[&str] = &["dlr", "zju", "horace", "erf"];

/// Builds the flight image of an M7 with features of hzn-core. The linker shows that none of its methods can panic.
fn build_flight_image(features: &[&str]) -> Result<PathBuf, Trouble> {
    let chosen: Vec<String> = features.iter().map(|f| format!("hzn-core/{f}")).chain([M7.to_owned()]).collect();
    let args = ["--package", "hzn-mps2", "--bin", "flight", "--features", &chosen.join(",")];
    let (mut command, built) = Toolchain::find()?.cargo("build", &format!("firmware/{M7}"), &args);
    steps::run(configure_for_firmware(&mut command, M7_FLAGS))?;
    Ok(built.join("flight"))
}

/// Builds the port for the STM32H743, prints its size, and returns the image. No emulator has this part, so it does not
/// run. Its hardware library can panic, so panics are not looked for.
fn build_vendor_port(dir: &str, clone: &Path) -> Result<PathBuf, Trouble> {
    let (mut command, built) = Toolchain::find()?.cargo("build", dir, &["--package", "hzn-stm32h743"]);
    steps::run(configure_for_firmware(&mut command, M7_FLAGS).current_dir(clone.join("firmware")))?;
    steps::run(Command::new("arm-none-eabi-size").arg(built.join("flight")))?;
    Ok(built.join("flight"))
}

/// Prints how much flash the methods of published systems take, as the table of book/theory/methods.md.
fn print_flash_by_feature() -> Outcome {
    let mut table = "| features of hzn-core | flash, bytes |\n|---|---:|\n".to_owned();
    let each = METHODS.iter().map(core::slice::from_ref);
    for features in core::iter::once(&[][..]).chain(each).chain([METHODS]) {
        let named: Vec<String> = features.iter().map(|f| format!("`{f}`")).collect();
        let size = output_of(Command::new("arm-none-eabi-size").arg(build_flight_image(features)?))?;
        let numbers = size.lines().nth(1).unwrap_or_default().split_whitespace().take(2);
        let flash: u64 = numbers.filter_map(|n| n.parse::<u64>().ok()).sum();
        let name = if named.is_empty() { "none: the `hzn` chain".to_owned() } else { named.join(", ") };
        table += &format!("| {name} | {flash} |\n");
    }
    println!("{table}");
    Ok(())
}

/// `cargo xtask firmware [--write | --by-feature]`: builds the images and measures what they cost.
pub(crate) fn run(args: &[String]) -> Result<(), String> {
    let go = || -> Outcome {
        std::env::set_current_dir(root())?;
        if args.iter().any(|a| a == "--by-feature") {
            return print_flash_by_feature();
        }
        build()?;
        let mut table = cargo(&["run", "--quiet", "--release", "--package", "hzn-tests", "--example", "firmware_cost"]);
        let write: &[&str] = if args.iter().any(|a| a == "--write") { &["--write", COSTS] } else { &[] };
        steps::run(table.arg("--").args(write))
    };
    go().map_err(Trouble::into_message)
}

fn configure_for_firmware<'a>(command: &'a mut Command, flags: &str) -> &'a mut Command {
    command.current_dir(root().join("firmware"));
    if !flags.is_empty() {
        // This variable adds to the flags of `firmware/.cargo/config.toml`; RUSTFLAGS would replace them.
        command.env("CARGO_TARGET_THUMBV7EM_NONE_EABIHF_RUSTFLAGS", flags);
    }
    command
}

fn images(board: &str) -> PathBuf {
    target().join("firmware").join(board).join("images")
}

/// Checks that nothing in an image can panic, and prints the size of the image. The linker ensures this already,
/// because the panic handler calls a function that does not exist. The symbols must not contain a panic path either.
fn check_no_panics(board: &str, image: &str) -> Outcome {
    let path = images(board).join(image);
    let symbols = output(Command::new("arm-none-eabi-nm").arg(&path))
        .ok_or_else(|| Trouble::Failed(format!("{}: nm cannot read the symbols", path.display())))?;
    let panics: Vec<&str> = symbols.lines().filter(|l| l.contains("panicking")).collect();
    if !panics.is_empty() {
        return Err(Trouble::Failed(format!("{board} {image}: a panic path is linked: {}", panics.join(", "))));
    }
    steps::run(Command::new("arm-none-eabi-size").arg(&path))
}

/// Checks that the C example gives the same bits on this machine and in QEMU.
fn check_c_interface() -> Outcome {
    let toolchain = Toolchain::find()?;
    let library = ["--package", "hzn-c", "--lib", "--crate-type", "staticlib", "--features", "standalone"];
    let (mut command, there) = toolchain.cargo("rustc", &format!("firmware/{M7}"), &library);
    steps::run(configure_for_firmware(&mut command, M7_FLAGS))?;
    let here = target().join("firmware/host");
    let mut command = cargo(&["rustc", "--profile", "flight"]);
    steps::run(configure_for_firmware(command.arg("--target-dir").arg(&here).args(library), ""))?;

    let c = root().join("firmware/hzn-c");
    let (example, include) = (c.join("example"), format!("-I{}", c.join("include").display()));
    let out = target().join("firmware/c");
    fs::create_dir_all(&out)?;
    let flags = ["-std=c11", "-O2", "-Wall", "-Wextra", "-Werror", &include];
    steps::run(
        Command::new("cc")
            .args(flags)
            .args([example.join("example.c"), example.join("host.c"), here.join("flight/libhzn.a")])
            .arg("-o")
            .arg(out.join("host")),
    )?;
    steps::run(
        Command::new("arm-none-eabi-gcc")
            .args(flags)
            .args([
                "-mcpu=cortex-m7",
                "-mfloat-abi=hard",
                "-mfpu=fpv5-d16",
                "-mthumb",
                "-ffreestanding",
                "-nostdlib",
                "-Wl,-z,noexecstack",
            ])
            .arg(format!("-T{}", example.join("an500.ld").display()))
            .args([example.join("example.c"), example.join("startup.c"), there.join("libhzn.a")])
            .args(["-lgcc", "-o"])
            .arg(out.join("an500")),
    )?;
    let host = output_of(&mut Command::new(out.join("host")))?;
    let mut qemu = Command::new("timeout");
    qemu.args(["60", "qemu-system-arm", "-M", "mps2-an500", "-display", "none", "-monitor", "none", "-serial", "null"])
        .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
        .arg(out.join("an500"));
    let emulated = output_of(&mut qemu)?;
    println!("{host}");
    if host != emulated {
        return Err(Trouble::Failed(format!("the C example prints another result in QEMU:\n{emulated}")));
    }
    crate::c_package::check(&c, &here, &out)
}

/// Returns what a program prints on both streams; an error if the program fails.
fn output_of(command: &mut Command) -> Result<String, Trouble> {
    steps::show(command);
    let out = command.stdin(std::process::Stdio::null()).output()?;
    let text = [out.stdout, out.stderr].concat();
    let text = String::from_utf8_lossy(&text).into_owned();
    let program = Path::new(command.get_program()).display().to_string();
    if out.status.success() { Ok(text) } else { Err(Trouble::Failed(format!("{program}: {}\n{text}", out.status))) }
}
