//! Runs the viewer's real window on a virtual display.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::demo::demo_dir;
use crate::display::Display;
use crate::machine::{root, target};
use crate::situations;
use crate::steps::{Outcome, Trouble, show};
use crate::test_build::build_tests;

/// Index of the demo's picture that is shown.
const FRAME: usize = 33;

/// Starts the window with arguments and returns what it prints.
fn run_window(display: &Display, arguments: &[&str]) -> Result<String, Trouble> {
    let mut command = Command::new(target().join("debug/hzn"));
    command.arg("view").args(arguments).stdin(Stdio::null()).stderr(Stdio::inherit());
    // With software rendering the picture is the same on every machine.
    command.env("DISPLAY", &display.name).env("LIBGL_ALWAYS_SOFTWARE", "1").env_remove("WAYLAND_DISPLAY");
    show(&command);
    let out = command.output()?;
    if !out.status.success() {
        return Err(Trouble::Failed(format!("hzn-viewer ended with {}", out.status)));
    }
    Ok(String::from_utf8_lossy(&out.stdout).trim().to_owned())
}

/// Shows the demo's recording in the window and returns the file of the screenshot. The window prints the result of the
/// picture, which must be equal to the row in the demo's table.
fn take_screenshot() -> Result<PathBuf, Trouble> {
    build_tests()?;
    let (demo, picture) = (demo_dir(), target().join("xtask").join("viewer.png"));
    let (recording, table) = (demo.join("flight.mcap"), demo.join("flight.csv"));
    if !recording.exists() || !table.exists() {
        return Err(Trouble::Failed("the demo's files are missing; run `cargo xtask test demo viewer`".into()));
    }
    let _ = fs::remove_file(&picture);
    let frame = FRAME.to_string();
    let display = Display::start("1600x1000")?;
    let arguments = [&recording.to_string_lossy(), "--frame", &frame, "--screenshot", &picture.to_string_lossy()]
        .map(str::to_owned);
    let printed = run_window(&display, &arguments.each_ref().map(String::as_str))?;
    println!("{printed}");
    let expected = expected_line(&fs::read_to_string(&table)?)
        .ok_or_else(|| Trouble::Failed("the demo's table has no row for this picture".into()))?;
    if printed != expected {
        return Err(Trouble::Failed(format!("the window must print {expected:?}")));
    }
    // A screenshot of a window without content has only a few kilobytes.
    match fs::metadata(&picture) {
        Ok(file) if file.len() > 60_000 => Ok(picture),
        _ => Err(Trouble::Failed(format!("{} is too small to be a screenshot of the window", picture.display()))),
    }
}

/// Returns what the window must print for the picture: index, file, body, status and axis from the table of the same
/// run.
fn expected_line(table: &str) -> Option<String> {
    let column = |name: &str| table.lines().next()?.split(',').position(|c| c == name);
    let row: Vec<&str> = table.lines().nth(FRAME + 1)?.split(',').collect();
    let cells: Option<Vec<&str>> = ["index", "file", "body", "status", "axis_x", "axis_y", "axis_z"]
        .into_iter()
        .map(|name| row.get(column(name)?).copied())
        .collect();
    Some(format!("frame {}", cells?.join(" ")))
}

/// Runs the check as a step of `cargo xtask test`.
pub(crate) fn test() -> Outcome {
    take_screenshot().map(|_| ())
}

/// `cargo xtask viewer`: makes the viewer's picture in the documents again. `cargo xtask viewer situations` makes
/// pictures of the window in all situations.
pub(crate) fn run(args: &[String]) -> Result<(), String> {
    std::env::set_current_dir(root()).map_err(|e| e.to_string())?;
    match args {
        [] => {}
        [word] if word == "situations" => return situations::run().map_err(Trouble::into_message),
        _ => return Err("usage: cargo xtask viewer [situations]".into()),
    }
    let picture = take_screenshot().map_err(Trouble::into_message)?;
    let kept = Path::new("book/images/viewer.png");
    fs::copy(picture, kept).map_err(|e| e.to_string())?;
    println!("written: {}", kept.display());
    Ok(())
}
