//! A virtual display for the viewer's window.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

use crate::machine::{apt_install, has};
use crate::steps::Trouble;

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
/// Display without a screen; its server ends when this value is dropped.
pub(crate) struct Display {
    server: Child,
    /// Name of the display, for the variable `DISPLAY`.
    pub(crate) name: String,
}

impl Display {
    /// Starts a display of this size in pixels, WIDTHxHEIGHT.
    pub(crate) fn start(size: &str) -> Result<Self, Trouble> {
        if !has("Xvfb") {
            apt_install(PACKAGES)?;
        }
        let mut command = Command::new("Xvfb");
        // The server chooses a free display number and prints it.
        let screen = format!("{size}x24");
        command.args(["-displayfd", "1", "-screen", "0", &screen, "-nolisten", "tcp"]);
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
