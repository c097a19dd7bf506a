//! Makes the documents' pictures with overlays and the map of a lens with the present program.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::machine::{has, root, target};
use crate::steps::{self, Trouble};
use crate::test_build::build_tests;

/// The photograph of the demo with its sensor, whose printed answer stands below the picture on the first page.
const FIRST: [&str; 2] = ["crates/hzn-cli/assets/iss-limb-2020-11-20.jpg", "crates/hzn-cli/assets/iss.toml"];

/// Photographs in tests/data/real, and the pictures in book/images that are made from them.
const PHOTOGRAPHS: [(&str, &str); 7] = [
    ("iss064e002941-solar-array.jpg", "gallery/solar-array"),
    ("opssat-2020-08-16.png", "gallery/ops-sat"),
    ("jupiter/jupiter-cassini-n1352037683.png", "gallery/jupiter"),
    ("pluto-pia19948.jpg", "gallery/pluto"),
    ("sun-hmi-continuum-2023-01-31.png", "gallery/sun"),
    ("iss073e0293986-aurora.jpg", "gallery/aurora"),
    ("iss030e102170-night.jpg", "gallery/night"),
];

/// Scenes of `hzn simulate` with further options, the index of the picture that is shown, and the picture in
/// book/images.
const SCENES: [(&str, &[&str], &str, &str); 5] = [
    ("rocket", &["--frames", "6"], "5", "gallery/rocket"),
    ("full-disc", &["--frames", "4"], "1", "gallery/full-disc"),
    ("leo-infrared", &["--frames", "4"], "1", "gallery/infrared"),
    ("sun-moon", &["--frames", "4"], "1", "gallery/sun-moon"),
    ("saturn", &["--frames", "12", "--no-noise"], "9", "gallery/saturn"),
];

/// Width of the pictures in the documents, in pixels: the caption stays readable.
const WIDTH: &str = "720";

/// `cargo xtask pictures`: makes the pictures again.
pub(crate) fn run() -> Result<(), String> {
    std::env::set_current_dir(root()).map_err(|e| e.to_string())?;
    make().map_err(Trouble::into_message)
}

fn make() -> Result<(), Trouble> {
    if !has("ffmpeg") {
        return Err(Trouble::Failed("the pictures are reduced with ffmpeg: install it".into()));
    }
    build_tests()?;
    let folder = target().join("xtask").join("pictures");
    fs::create_dir_all(&folder)?;
    photograph(&folder, FIRST.map(Path::new), "iss-limb")?;
    for (file, name) in PHOTOGRAPHS {
        let file = Path::new("tests/data/real").join(file);
        let beside = file.with_file_name("sensor.toml");
        let sensor = if beside.exists() { beside } else { file.with_extension("toml") };
        photograph(&folder, [&file, &sensor], name)?;
    }
    for (scene, options, index, name) in SCENES {
        let flight = folder.join(scene);
        if !flight.exists() {
            let mut command = Command::new(target().join("debug/hzn"));
            command.current_dir(&folder).args(["simulate", scene, "-q", "-o", scene]).args(options);
            steps::run(&mut command)?;
        }
        hzn(&folder, &["explain", scene, "--index", index], name)?;
    }
    let mut command = Command::new(target().join("debug/hzn"));
    command.current_dir(&folder).args(["camera", "show", "leo-infrared/sensor.toml"]);
    steps::run(command.args(["--picture", "camera-map.png", "--force"]).stdout(Stdio::null()))?;
    reduce(&folder.join("camera-map.png"), "camera-map")
}

/// Copies a photograph, its sensor, and the table of altitudes and attitudes beside it below the folder, and draws its
/// picture there.
fn photograph(folder: &Path, files: [&Path; 2], name: &str) -> Result<(), Trouble> {
    let table = files[0].with_file_name("frames.csv");
    for file in files.into_iter().chain(table.exists().then_some(table.as_path())) {
        let copy = folder.join(file);
        fs::create_dir_all(copy.parent().unwrap_or(folder))?;
        fs::copy(file, copy)?;
    }
    let [picture, sensor] = files.map(Path::to_string_lossy);
    hzn(folder, &["explain", &picture, "--sensor", &sensor], name)
}

/// Draws a picture with `hzn`, and writes it reduced into book/images. The command runs in the folder of the pictures,
/// because the caption has the command, and no path of this machine belongs into the documents.
fn hzn(folder: &Path, args: &[&str], name: &str) -> Result<(), Trouble> {
    let file = format!("{}.png", name.rsplit('/').next().unwrap_or(name));
    let drawn = folder.join(&file);
    let mut command = Command::new(target().join("debug/hzn"));
    command.current_dir(folder).args(args).args(["--overlay", &file]).arg("--force").stdout(Stdio::null());
    // A picture that was processed and refused has an overlay and no error. One that lacks an altitude is an error.
    steps::run(&mut command)?;
    reduce(&drawn, name)
}

/// Writes a picture into book/images, not wider than [`WIDTH`].
fn reduce(drawn: &Path, name: &str) -> Result<(), Trouble> {
    let kept = format!("book/images/{name}.jpg");
    let filter = format!("scale='min({WIDTH},iw)':-1:flags=area");
    let mut reduce = Command::new("ffmpeg");
    reduce.args(["-v", "error", "-y", "-i"]).arg(drawn).args(["-vf", &filter, "-q:v", "4", &kept]);
    steps::run(&mut reduce)?;
    println!("written: {kept}");
    Ok(())
}
