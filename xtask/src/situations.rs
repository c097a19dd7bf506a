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

const SHOTS: [Shot; 20] = [
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
    shot("ground", "rocket", "5", Some("ground")),
    shot("two-values", "two-wrong", "5", Some("stages")),
    shot("board", "rocket", "5", Some("board")),
    shot("calibrated", "rocket", "5", Some("calibrated")),
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
        make_focal_wrong(&folder.join("wrong-focal/sensor.toml"), 1.34)?;
    }
    if missing("two-wrong") {
        copy(&folder.join("rocket"), &folder.join("two-wrong"), |_| true)?;
        make_focal_wrong(&folder.join("two-wrong/sensor.toml"), 1.06)?;
        let table = folder.join("two-wrong/frames.csv");
        fs::write(&table, with_altitudes(&fs::read_to_string(&table)?, 30.0))?;
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

/// Makes the focal lengths in a sensor.toml longer by a factor.
fn make_focal_wrong(sensor: &Path, factor: f64) -> Result<(), Trouble> {
    let wrong = |line: &str| match line.split_once(" = ") {
        Some((key @ ("fx_px" | "fy_px"), value)) => match value.parse::<f64>() {
            Ok(px) => format!("{key} = {:.1}\n", factor * px),
            Err(_) => format!("{line}\n"),
        },
        _ => format!("{line}\n"),
    };
    let text: String = fs::read_to_string(sensor)?.lines().map(wrong).collect();
    Ok(fs::write(sensor, text)?)
}

/// Returns a frames.csv with file, time and altitude alone, all altitudes higher by some kilometres. With a position, a
/// picture has a second source of its altitude.
fn with_altitudes(table: &str, by_km: f64) -> String {
    let mut rows = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = rows.next().unwrap_or_default();
    let at = |name: &str| header.iter().position(|column| *column == name);
    let mut out = "file,time_s,altitude_km\n".to_owned();
    for row in rows {
        let cell = |name: &str| at(name).and_then(|n| row.get(n).copied()).unwrap_or_default();
        let altitude_km =
            cell("altitude_km").parse::<f64>().map_or_else(|_| String::new(), |km| (km + by_km).to_string());
        out += &format!("{},{},{altitude_km}\n", cell("file"), cell("time_s"));
    }
    out
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_of_altitudes_has_no_positions() {
        let table = "file,time_s,utc,altitude_km,x_km\na.jpg,1.5,,200.5,6000\n";
        assert_eq!(with_altitudes(table, 30.0), "file,time_s,altitude_km\na.jpg,1.5,230.5\n");
    }
}
