//! Runs the viewer's real window on a virtual display.

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use crate::demo::demo_dir;
use crate::machine::{apt_install, has, root, target};
use crate::steps::{Outcome, Trouble, show};
use crate::test_build::build_tests;

/// Packages for a display without a screen, for OpenGL without a graphics card, and for the libraries that a window
/// loads when it starts.
const PACKAGES: &[&str] = &[
    "xvfb",
    "libgl1",
    "libgl1-mesa-dri",
    "libglx-mesa0",
    "libx11-6",
    "libx11-xcb1",
    "libxcursor1",
    "libxi6",
    "libxkbcommon0",
    "libxkbcommon-x11-0",
];
/// Index of the demo's picture that is shown.
const FRAME: usize = 33;

/// Display without a screen; its server ends when this value is dropped.
struct Display {
    server: Child,
    name: String,
}

impl Display {
    fn start() -> Result<Self, Trouble> {
        let mut command = Command::new("Xvfb");
        // The server chooses a free display number and prints it.
        command.args(["-displayfd", "1", "-screen", "0", "1600x1000x24", "-nolisten", "tcp"]);
        let mut server = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn()?;
        let mut number = String::new();
        if let Some(out) = server.stdout.take() {
            BufReader::new(out).read_line(&mut number)?;
        }
        let display = Self { server, name: format!(":{}", number.trim()) };
        if number.trim().is_empty() { Err(Trouble::Failed("Xvfb did not start".into())) } else { Ok(display) }
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

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
    if !has("Xvfb") {
        apt_install(PACKAGES)?;
    }
    build_tests()?;
    let (demo, picture) = (demo_dir(), target().join("xtask").join("viewer.png"));
    let (recording, table) = (demo.join("flight.mcap"), demo.join("flight.csv"));
    if !recording.exists() || !table.exists() {
        return Err(Trouble::Failed("the demo's files are missing; run `cargo xtask test demo viewer`".into()));
    }
    let _ = fs::remove_file(&picture);
    let frame = FRAME.to_string();
    let display = Display::start()?;
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

/// `cargo xtask viewer`: makes the viewer's picture in the documents again.
pub(crate) fn run() -> Result<(), String> {
    std::env::set_current_dir(root()).map_err(|e| e.to_string())?;
    let picture = take_screenshot().map_err(Trouble::into_message)?;
    let kept = Path::new("book/images/viewer.png");
    fs::copy(picture, kept).map_err(|e| e.to_string())?;
    println!("written: {}", kept.display());
    Ok(())
}
