//! Builds the images of `firmware/` for the emulated boards, inspects them and runs them in QEMU.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::flight_build::{TARGET, Toolchain};
use crate::machine::{apt_install, output, root, target};
use crate::soft_double;
use crate::steps::{self, Outcome, Steps, Trouble, cargo};
use crate::test_build::build_tests;

/// A core that the compiler knows. The images for it share one folder of the build, so that nothing is compiled twice.
#[derive(Clone, Copy)]
struct Core {
    target: &'static str,
    dir: &'static str,
    /// Flags of the compiler.
    flags: &'static str,
}
const M0: Core = Core { target: "thumbv6m-none-eabi", dir: "firmware/m0", flags: "" };
const M4: Core = Core { target: TARGET, dir: "firmware/m4", flags: "" };
const M7: Core = Core { target: TARGET, dir: "firmware/m7", flags: "-C target-cpu=cortex-m7" };

const RISCV: Core = Core { target: "riscv32imac-unknown-none-elf", dir: "firmware/riscv", flags: "" };

/// A board that QEMU emulates.
struct Board {
    name: &'static str,
    package: &'static str,
    features: &'static [&'static str],
    core: Core,
    images: &'static [&'static str],
    /// Images that are built and run in every check.
    always: &'static [&'static str],
}
const AN386: Board = Board {
    name: "an386",
    package: "hzn-mps2",
    features: &["--features", "an386"],
    core: M4,
    images: &IMAGES,
    always: &["chain"],
};
const AN500: Board =
    Board { name: "an500", features: &["--features", "an500"], core: M7, always: &["flight", "nav"], ..AN386 };
const BOARDS: [Board; 5] = [
    AN386,
    AN500,
    Board {
        name: "stm32f405",
        package: "hzn-stm32f405",
        features: &[],
        core: M4,
        images: &["example", "flight"],
        always: &[],
    },
    // Code for a Cortex-M0+, which the Cortex-M7 of the board runs.
    Board { name: "array", core: M0, images: &["array160", "array32"], always: &[], ..AN500 },
    Board { name: "riscv", package: "hzn-virt", features: &[], core: RISCV, images: &["array160"], always: &[] },
];
/// Images of the boards with memory for pictures.
const IMAGES: [&str; 8] = ["chain", "flight", "line", "measure", "nav", "rig", "rows", "track"];
/// Document with the costs.
const COSTS: &str = "book/results/firmware-cost.md";

impl Board {
    /// Builds these images and puts them where the tests find them: `target/firmware/BOARD/images`.
    fn build_images(&self, images: &'static [&'static str]) -> Outcome {
        if images.is_empty() {
            return Ok(());
        }
        let toolchain = Toolchain::find_for(self.core.target)?;
        let built = self.build(toolchain, "build", self.core.dir, &root(), &bins(images))?;
        let folder = images_of(self.name);
        fs::create_dir_all(&folder)?;
        for image in images {
            fs::copy(built.join(image), folder.join(image))?;
            check_no_panics(self.name, image)?;
        }
        Ok(())
    }

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
        let args = [&["--package", self.package], self.features, more].concat();
        let (mut command, built) = toolchain.cargo_for(self.core.target, "flight", verb, dir, &args);
        steps::run(configure_for_firmware(&mut command, self.core.flags).current_dir(clone.join("firmware")))?;
        Ok(built)
    }
}

/// Returns the arguments that choose images.
fn bins(images: &'static [&'static str]) -> Vec<&'static str> {
    images.iter().flat_map(|image| ["--bin", image]).collect()
}

/// Checks that hzn-core compiles without the features that the images add. They link it, so this makes no code.
pub(crate) fn check_core() -> Outcome {
    let (mut command, _) = Toolchain::find()?.cargo("check", M4.dir, &["--package", "hzn-core"]);
    steps::run(configure_for_firmware(&mut command, M4.flags))
}

/// Builds every image, or those that run in every check.
fn build(every_image: bool) -> Outcome {
    apt_install(&["qemu-system-arm", "binutils-arm-none-eabi", "gcc-arm-none-eabi"])?;
    if every_image {
        // It has the emulator of the RISC-V.
        apt_install(&["qemu-system-misc"])?;
    }
    BOARDS.iter().try_for_each(|b| b.build_images(if every_image { b.images } else { b.always }))?;
    if every_image { build_image_with_keys() } else { Ok(()) }
}

/// Builds the images of a clone of this repository, and compares their bytes with the images here.
pub(crate) fn is_the_same_elsewhere(clone: &Path) -> Outcome {
    build(true)?;
    for board in BOARDS {
        let dir = format!("xtask/elsewhere/{}", board.name);
        let toolchain = Toolchain::find_for(board.core.target)?;
        let built = board.build(toolchain, "build", &dir, clone, &bins(board.images))?;
        for image in board.images {
            steps::compare_bytes(
                &format!("{} {image}", board.name),
                &images_of(board.name).join(image),
                &built.join(image),
            )?;
        }
    }
    let here = build_vendor_port(M7.dir, &root())?;
    let there = build_vendor_port("xtask/elsewhere/stm32h743", clone)?;
    steps::compare_bytes("stm32h743 flight", &here, &there)
}

/// Builds what the image tests need, then runs the tests. With `--all` there are also the other images, the costs, the
/// project of the guide, and the package for C.
pub(crate) fn test(steps: &mut Steps) -> Outcome {
    steps.images.wait();
    build(steps.all)?;
    soft_double::check(&images_of(AN386.name).join("chain"))?;
    lint(steps.all)?;
    build_tests()?;
    if steps.all {
        test_every_image(steps)?;
        run_own_firmware()?;
        check_c_interface()
    } else {
        test_images_once(steps)?;
        own_firmware("check").map(|_| ())
    }
}

/// The project that the guide builds from nothing.
const OWN_FIRMWARE: &str = "examples/own-firmware";

/// Builds the project of the guide as a user does, with its own profile, flags and lock, or only checks it. Returns the
/// image.
fn own_firmware(verb: &str) -> Result<PathBuf, Trouble> {
    let (mut command, built) = Toolchain::find()?.cargo_with_profile("release", verb, "firmware/own", &[]);
    steps::run(command.current_dir(root().join(OWN_FIRMWARE)))?;
    Ok(built.join("own-firmware"))
}

/// Runs the project of the guide in QEMU. Its output must be the one that the guide shows. Its linker script has
/// 192 KiB of RAM.
fn run_own_firmware() -> Outcome {
    let image = own_firmware("build")?;
    steps::run(Command::new("arm-none-eabi-size").arg(&image))?;
    let mut qemu = Command::new("timeout");
    qemu.args(["60", "qemu-system-arm", "-M", "mps2-an386", "-display", "none", "-monitor", "none", "-serial", "null"])
        .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
        .arg(&image);
    let answer = output_of(&mut qemu)?;
    let guide = fs::read_to_string(root().join("book/guide/own-firmware.md"))?;
    let shown = answer.lines().find(|line| line.starts_with("nadir in the camera"));
    match shown {
        Some(line) if guide.contains(line) => Ok(()),
        _ => Err(Trouble::Failed(format!("book/guide/own-firmware.md does not show the output:\n{answer}"))),
    }
}

/// Runs the flight image and the navigation on one board, and the sensor alone on the other.
fn test_images_once(steps: &mut Steps) -> Outcome {
    let alone = "firmware::the_sensor_alone";
    run_image_tests(steps, AN386.name, &[alone])?;
    // These need other images.
    let other = ["firmware::same_bits", "rows_image::", "small_board", "example_of_the_documents"];
    let skipped = other.iter().chain([&alone]).flat_map(|name| ["--skip", name]);
    let files = ["firmware::", "navigation::", "recovery::", "silence::"];
    run_image_tests(steps, AN500.name, &files.into_iter().chain(skipped).collect::<Vec<_>>())?;
    compare_costs("--check-sizes")
}

/// Runs every image, builds those that no emulator can run, and compares the costs with those of the page.
fn test_every_image(steps: &mut Steps) -> Outcome {
    soft_double::check(&images_of(AN386.name).join("measure"))?;
    build_flight_image(&core_features(METHODS))?;
    let vendor_port = build_vendor_port(M7.dir, &root())?;
    steps::run(Command::new(target().join("debug/examples/stack_bound")).arg(vendor_port))?;
    run_image_tests(
        steps,
        "",
        &[
            "arrays::",
            "authenticated::",
            "firmware::",
            "line_cost::",
            "navigation::",
            "recovery::",
            "rig_image::",
            "rows_image::",
            "silence::",
        ],
    )?;
    compare_costs("--check")
}

/// Compares costs with those of the page. None of them may grow by more than 5 %.
fn compare_costs(how: &str) -> Outcome {
    steps::run(Command::new(target().join("debug/examples/firmware_cost")).args([how, COSTS]))
}

/// Runs the tests of images that `filters` name, on one board or, with an empty name, on all of them.
fn run_image_tests(steps: &mut Steps, board: &str, filters: &[&str]) -> Outcome {
    // Without a package's name nothing is built again with other features.
    let mut command = cargo(&["test", "--no-fail-fast", "--test", "chain", "--", "--ignored"]);
    steps.count_tests(command.args(filters).env("HZN_BOARD", board))
}

/// Runs the lints of the images, or of those that every check runs. The steps of the whole workspace have those of
/// hzn-c.
fn lint(every_image: bool) -> Outcome {
    for board in BOARDS {
        // The images for a Cortex-M0+ are among those of another board.
        if board.core.target == M0.target || !every_image && board.always.is_empty() {
            continue;
        }
        let toolchain = Toolchain::find_for(board.core.target)?;
        if matches!(toolchain, Toolchain::Debian) {
            println!("lints of the images are skipped: Debian's Rust has no clippy for the target");
            return Ok(());
        }
        // The core changes no lint, so boards of the same target are checked as one core.
        let core = if board.core.target == TARGET { M4 } else { board.core };
        let board = Board { core, ..board };
        board.build(toolchain, "clippy", core.dir, &root(), &["--", "-D", "warnings"])?;
    }
    Ok(())
}

/// Every feature that adds methods to hzn-core.
const METHODS: &[&str] = &["dlr", "zju", "horace", "erf"];

/// Returns features of hzn-core, as the images name them.
fn core_features(features: &[&str]) -> Vec<String> {
    features.iter().map(|feature| format!("hzn-core/{feature}")).collect()
}

/// Builds the flight image of an M7 whose telecommands need a key. It has the name `flight-keys`.
fn build_image_with_keys() -> Outcome {
    let built = build_flight_image(&["keys".to_owned()])?;
    fs::copy(built, images_of(AN500.name).join("flight-keys"))?;
    check_no_panics(AN500.name, "flight-keys")
}

/// Builds the flight image of an M7 with more features. The linker shows that nothing in it can panic.
fn build_flight_image(features: &[String]) -> Result<PathBuf, Trouble> {
    let chosen = [&[AN500.name.to_owned()], features].concat();
    let args = ["--package", "hzn-mps2", "--bin", "flight", "--features", &chosen.join(",")];
    let (mut command, built) = Toolchain::find()?.cargo("build", M7.dir, &args);
    steps::run(configure_for_firmware(&mut command, M7.flags))?;
    Ok(built.join("flight"))
}

/// Builds the port for the STM32H743, prints its size, and returns the image. No emulator has this part, so it does not
/// run. Its hardware library can panic, so panics are not looked for.
fn build_vendor_port(dir: &str, clone: &Path) -> Result<PathBuf, Trouble> {
    let (mut command, built) = Toolchain::find()?.cargo("build", dir, &["--package", "hzn-stm32h743"]);
    steps::run(configure_for_firmware(&mut command, M7.flags).current_dir(clone.join("firmware")))?;
    steps::run(Command::new("arm-none-eabi-size").arg(built.join("flight")))?;
    Ok(built.join("flight"))
}

/// Prints how much flash the methods of published systems take, as the table of book/theory/methods.md.
fn print_flash_by_feature() -> Outcome {
    let mut table = "| features of hzn-core | flash, bytes |\n|---|---:|\n".to_owned();
    let each = METHODS.iter().map(core::slice::from_ref);
    for features in core::iter::once(&[][..]).chain(each).chain([METHODS]) {
        let named: Vec<String> = features.iter().map(|f| format!("`{f}`")).collect();
        let size = output_of(Command::new("arm-none-eabi-size").arg(build_flight_image(&core_features(features))?))?;
        let numbers = size.lines().nth(1).unwrap_or_default().split_whitespace().take(2);
        let flash: u64 = numbers.filter_map(|n| n.parse::<u64>().ok()).sum();
        let name = if named.is_empty() { "none: the `hzn` chain".to_owned() } else { named.join(", ") };
        table += &format!("| {name} | {flash} |\n");
    }
    println!("{table}");
    Ok(())
}

/// Builds all that the step `firmware` of every check runs.
fn build_ahead() -> Outcome {
    build(false)?;
    own_firmware("check").map(|_| ())
}

/// `cargo xtask firmware [--write | --build | --by-feature]`: builds the images and measures what they cost.
pub(crate) fn run(args: &[String]) -> Result<(), String> {
    let go = || -> Outcome {
        std::env::set_current_dir(root())?;
        if args.iter().any(|a| a == "--build") {
            return build_ahead();
        }
        if args.iter().any(|a| a == "--by-feature") {
            return print_flash_by_feature();
        }
        build(true)?;
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

fn images_of(board: &str) -> PathBuf {
    target().join("firmware").join(board).join("images")
}

/// Checks that nothing in an image can panic, and prints the size of the image. The linker ensures this already,
/// because the panic handler calls a function that does not exist. The symbols must not contain a panic path either.
fn check_no_panics(board: &str, image: &str) -> Outcome {
    let path = images_of(board).join(image);
    let symbols = output(Command::new("arm-none-eabi-nm").arg(&path))
        .ok_or_else(|| Trouble::Failed(format!("{}: nm cannot read the symbols", path.display())))?;
    let panics: Vec<&str> = symbols.lines().filter(|l| l.contains("panicking")).collect();
    if !panics.is_empty() {
        return Err(Trouble::Failed(format!("{board} {image}: a panic path is linked: {}", panics.join(", "))));
    }
    steps::run(Command::new("arm-none-eabi-size").arg(&path))
}

/// Features and form of the library for C.
const C_LIBRARY: [&str; 7] = ["--package", "hzn-c", "--lib", "--crate-type", "staticlib", "--features", "standalone"];

/// Builds the library for C for this machine, with the profile of the images, and returns its path.
pub(crate) fn build_c_library() -> Result<PathBuf, Trouble> {
    steps::run(cargo(&["rustc", "--profile", "flight"]).args(C_LIBRARY))?;
    Ok(target().join("flight/libhzn.a"))
}

/// Builds the C example and the package for this machine. In QEMU the example must give the same bits.
fn check_c_interface() -> Outcome {
    let library = build_c_library()?;
    let c = root().join("firmware/hzn-c");
    let (example, include) = (c.join("example"), format!("-I{}", c.join("include").display()));
    let out = target().join("firmware/c");
    fs::create_dir_all(&out)?;
    let flags = ["-std=c11", "-O2", "-Wall", "-Wextra", "-Werror", &include];
    steps::run(
        Command::new("cc")
            .args(flags)
            .args([example.join("example.c"), example.join("host.c"), library])
            .arg("-o")
            .arg(out.join("host")),
    )?;
    let host = output_of(&mut Command::new(out.join("host")))?;
    println!("{host}");
    let emulated = run_c_example_in_qemu(&example, &flags, &out)?;
    if host != emulated {
        return Err(Trouble::Failed(format!("the C example prints another result in QEMU:\n{emulated}")));
    }
    crate::c_package::check(&c, &target(), &out)
}

/// Builds the C example for the M7, and returns what it prints in QEMU.
fn run_c_example_in_qemu(example: &Path, flags: &[&str], out: &Path) -> Result<String, Trouble> {
    let (mut command, built) = Toolchain::find()?.cargo("rustc", M7.dir, &C_LIBRARY);
    steps::run(configure_for_firmware(&mut command, M7.flags))?;
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
            .args([example.join("example.c"), example.join("startup.c"), built.join("libhzn.a")])
            .args(["-lgcc", "-o"])
            .arg(out.join("an500")),
    )?;
    let mut qemu = Command::new("timeout");
    qemu.args(["60", "qemu-system-arm", "-M", "mps2-an500", "-display", "none", "-monitor", "none", "-serial", "null"])
        .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
        .arg(out.join("an500"));
    output_of(&mut qemu)
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
