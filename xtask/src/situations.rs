//! Makes pictures of the viewer's window in all situations, sizes and themes, for people who look at them.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::display::Display;
use crate::machine::target;
use crate::steps::{self, Trouble, show};
use crate::test_build::build_tests;

/// Sizes of the window in points, and pixels in a point. The last one has 2560×1440 pixels.
const SIZES: [(&str, u32); 4] = [("720x480", 1), ("1024x768", 1), ("1440x900", 1), ("1280x720", 2)];
/// Size of the display in pixels.
const DISPLAY: &str = "2600x1500";

/// A picture to make: its name, what is opened (nothing for the welcome page), and the situation.
struct Shot {
    name: &'static str,
    open: Option<&'static str>,
    frame: &'static str,
    situation: Option<&'static str>,
}

const fn shot(name: &'static str, open: &'static str, frame: &'static str, situation: Option<&'static str>) -> Shot {
    Shot { name, open: Some(open), frame, situation }
}

const SHOTS: [Shot; 16] = [
    Shot { name: "welcome", open: None, frame: "0", situation: None },
    shot("ok", "rocket.mcap", "5", None),
    shot("refused", "discs", "1", Some("stages")),
    shot("half-angle", "wrong-focal", "5", Some("stages")),
    shot("compare", "rocket.mcap", "5", Some("compare")),
    shot("parameters", "rocket.mcap", "5", Some("parameters")),
    shot("wizard", "bare", "0", Some("wizard")),
    shot("navigation", "left.mcap", "30", Some("navigation")),
    shot("circle", "rocket.mcap", "5", Some("circle")),
    shot("replace", "rocket", "5", Some("replace")),
    shot("changed", "rocket", "5", Some("changed")),
    shot("palette", "rocket.mcap", "5", Some("palette")),
    shot("steady", "unmasked", "5", Some("stages")),
    shot("rig", "ring/rig.toml", "0", None),
    shot("space", "rocket", "5", Some("space")),
    shot("sigmas", "rocket", "5", Some("sigmas")),
];

/// Makes all pictures in target/xtask/situations.
pub(crate) fn run() -> Result<(), Trouble> {
    build_tests()?;
    let folder = target().join("xtask").join("situations");
    prepare(&folder)?;
    let display = Display::start(DISPLAY)?;
    for one in &SHOTS {
        for (size, scale) in SIZES {
            for theme in ["dark", "light"] {
                let picture = folder.join(format!("{}-{size}-{scale}-{theme}.png", one.name));
                let mut command = Command::new(target().join("debug/hzn-viewer"));
                command.current_dir(&folder).args(one.open).args(["--frame", one.frame, "--size", size]);
                command.args(one.situation.iter().flat_map(|s| ["--situation", s]));
                command.args((theme == "light").then_some("--light")).arg("--screenshot").arg(&picture);
                command.env("DISPLAY", &display.name).env("WINIT_X11_SCALE_FACTOR", scale.to_string());
                command.env("LIBGL_ALWAYS_SOFTWARE", "1").env_remove("WAYLAND_DISPLAY");
                command.stdout(Stdio::null());
                steps::run(&mut command)?;
            }
        }
    }
    println!("written: {}", folder.display());
    Ok(())
}

/// Runs hzn in a folder.
fn hzn(folder: &Path, args: &[&str]) -> Result<(), Trouble> {
    let mut command = Command::new(target().join("debug/hzn"));
    command.current_dir(folder).args(args).stdin(Stdio::null()).stdout(Stdio::null());
    show(&command);
    if command.status()?.success() { Ok(()) } else { Err(Trouble::Failed(format!("hzn {} failed", args.join(" ")))) }
}

/// Renders the flights that the pictures show. Flights of an earlier run stay.
fn prepare(folder: &Path) -> Result<(), Trouble> {
    fs::create_dir_all(folder)?;
    let missing = |name: &str| !folder.join(name).exists();
    if missing("rocket.mcap") {
        hzn(folder, &["simulate", "rocket", "-o", "rocket", "--frames", "12", "--force"])?;
        hzn(folder, &["run", "rocket", "-o", "rocket.mcap"])?;
    }
    if missing("discs") {
        hzn(folder, &["simulate", "full-disc", "-o", "discs", "--frames", "4"])?;
        change(&folder.join("discs/sensor.toml"), "[threshold]", "[threshold]\nmethod = \"fixed\"\nlevel = 0.8")?;
    }
    if missing("wrong-focal") {
        copy(&folder.join("rocket"), &folder.join("wrong-focal"), |_| true)?;
        let sensor = folder.join("wrong-focal/sensor.toml");
        let text = fs::read_to_string(&sensor)?;
        let wrong = |line: &str| match line.split_once(" = ") {
            Some((key @ ("fx_px" | "fy_px"), _)) => format!("{key} = 1650.0\n"),
            _ => format!("{line}\n"),
        };
        fs::write(&sensor, text.lines().map(wrong).collect::<String>())?;
    }
    if missing("unmasked") {
        copy(&folder.join("rocket"), &folder.join("unmasked"), |_| true)?;
        let sensor = folder.join("unmasked/sensor.toml");
        let text = fs::read_to_string(&sensor)?;
        let kept = |line: &&str| !line.trim_start().starts_with("polygons_px");
        fs::write(&sensor, text.lines().filter(kept).map(|line| format!("{line}\n")).collect::<String>())?;
    }
    if missing("ring") {
        hzn(folder, &["simulate", "ring", "-o", "ring", "--frames", "12"])?;
    }
    if missing("bare") {
        copy(&folder.join("rocket"), &folder.join("bare"), |name| name.ends_with(".jpg"))?;
    }
    if missing("nav.mcap") {
        hzn(folder, &["simulate", "atek", "-o", "atek", "--frames", "75", "--force"])?;
        for camera in ["left", "right"] {
            hzn(folder, &["run", &format!("atek/{camera}"), "-o", &format!("{camera}.mcap"), "--force"])?;
        }
        let cameras = ["--nadir", "left.mcap", "--nadir", "right.mcap"];
        let others = ["--imu", "atek/imu.csv", "--gnss", "atek/gnss.csv", "-o", "nav.mcap", "--smooth"];
        hzn(folder, &[&["fuse"][..], &cameras, &others].concat())?;
    }
    Ok(())
}

/// Replaces a text in a file, or appends the new one if the file does not have the old one.
fn change(file: &Path, old: &str, new: &str) -> Result<(), Trouble> {
    let text = fs::read_to_string(file)?;
    let text = if text.contains(old) { text.replace(old, new) } else { format!("{text}\n{new}\n") };
    Ok(fs::write(file, text)?)
}

/// Copies the files of a folder whose names `wants` accepts.
fn copy(from: &Path, to: &Path, wants: impl Fn(&str) -> bool) -> Result<(), Trouble> {
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from)? {
        let path: PathBuf = entry?.path();
        let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        if path.is_file() && wants(&name) {
            fs::copy(&path, to.join(&name))?;
        }
    }
    Ok(())
}
