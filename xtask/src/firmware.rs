//! The images of `firmware/`: built for both boards, looked into, and run in QEMU.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use crate::flight_build::Toolchain;
use crate::machine::{apt_install, output, root, target};
use crate::steps::{self, Outcome, Trouble, cargo};

/// A board, and the flags of its core.
const BOARDS: [(&str, &str); 2] = [("an386", ""), ("an500", "-C target-cpu=cortex-m7")];
/// The images of a board.
const IMAGES: [&str; 2] = ["flight", "measure"];

/// Builds every image and puts it where the tests find it: `target/firmware/BOARD/images`.
pub(crate) fn build() -> Outcome {
    apt_install(&["qemu-system-arm", "binutils-arm-none-eabi"])?;
    let toolchain = Toolchain::find()?;
    for (board, flags) in BOARDS {
        let (mut command, built) =
            toolchain.build(&format!("firmware/{board}"), &["--package", "hzn-mps2", "--features", board]);
        command.current_dir(root().join("firmware"));
        if !flags.is_empty() {
            command.env("RUSTFLAGS", flags);
        }
        steps::run(&mut command)?;
        let images = images(board);
        fs::create_dir_all(&images)?;
        for image in IMAGES {
            fs::copy(built.join(image), images.join(image))?;
            look_into(board, image)?;
        }
    }
    Ok(())
}

fn images(board: &str) -> PathBuf {
    target().join("firmware").join(board).join("images")
}

/// Nothing in an image can panic: the linker has seen to that (the panic handler calls a function that does not exist),
/// and no symbol says otherwise.
fn look_into(board: &str, image: &str) -> Outcome {
    let path = images(board).join(image);
    let symbols = output(Command::new("arm-none-eabi-nm").arg(&path))
        .ok_or_else(|| Trouble::Failed(format!("{}: its symbols cannot be read", path.display())))?;
    let panics: Vec<&str> = symbols.lines().filter(|l| l.contains("panicking")).collect();
    if !panics.is_empty() {
        return Err(Trouble::Failed(format!("{board} {image}: a panic path is linked: {}", panics.join(", "))));
    }
    steps::run(Command::new("arm-none-eabi-size").arg(&path))
}

/// `cargo xtask firmware`: the images, and what they cost.
pub(crate) fn run(args: &[String]) -> Result<(), String> {
    let go = || -> Outcome {
        std::env::set_current_dir(root())?;
        build()?;
        let mut table = cargo(&["run", "--quiet", "--release", "--package", "hzn-tests", "--example", "firmware_cost"]);
        steps::run(table.arg("--").args(args))
    };
    go().map_err(|(Trouble::Failed(why) | Trouble::Missing(why))| why)
}
