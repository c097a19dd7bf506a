//! Every command that a document shows works as it is written there.

use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::{env, fs};

use image::ImageEncoder;

use crate::common::{Place, SENSOR, limb};

/// Commands that are only parsed, by their beginning, and the reason.
const ONLY_PARSED: &[(&str, &str)] = &[
    ("hzn demo", "commands.rs runs it"),
    ("hzn fly", "needs a camera; fly.rs runs it"),
    ("hzn telemetry", "needs a line; fly.rs runs it"),
    ("hzn telecommand", "needs a line; fly.rs runs it"),
    ("hzn calibrate", "needs targets or a long flight; calibrate*.rs run it"),
    ("hzn fuse", "needs a long flight; fuse.rs runs it"),
    ("hzn info bag", "needs the bag of a ROS system; tests of hzn-mcap read its messages"),
    ("hzn init bag", "needs the same"),
    ("hzn run bag", "needs the same"),
    ("hzn init flight.mp4", "needs a video; gopro.rs runs it"),
    ("hzn run flight.mp4", "needs the same"),
    ("hzn export flight.mp4", "needs the same"),
    ("hzn run many", "needs the many pictures of a benchmark"),
    ("hzn run some", "needs a part of the same"),
    ("hzn run atek", "needs the flight of minutes before it"),
    ("hzn simulate atek", "takes minutes"),
    ("hzn simulate ring", "takes a minute; rig.rs runs a smaller one"),
    ("hzn run ring", "needs the flight before it; rig.rs runs one"),
    ("hzn evaluate ring", "needs the same"),
    ("hzn sensitivity visibility", "sensitivity.rs runs it"),
    ("hzn sensitivity spherical-earth", "sensitivity.rs runs it"),
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn collect_pages(dir: &Path, out: &mut Vec<PathBuf>) {
    for path in fs::read_dir(dir).unwrap().map(|entry| entry.unwrap().path()) {
        match path.is_dir() {
            true => collect_pages(&path, out),
            false if path.extension().is_some_and(|e| e == "md") => out.push(path),
            false => {}
        }
    }
}

/// Returns the commands of `hzn` in the blocks of shell code, without comments.
fn find_commands(text: &str) -> Vec<String> {
    let mut shell = false;
    let mut code = String::new();
    for line in text.lines() {
        if let Some(kind) = line.trim_start().strip_prefix("```") {
            shell = !shell && matches!(kind.trim(), "sh" | "bash" | "console");
        } else if shell {
            let line = line.split(" #").next().unwrap_or_default().trim();
            match line.strip_suffix('\\') {
                Some(part) => code.push_str(part),
                None => code.push_str(&format!("{line}\n")),
            }
        }
    }
    let commands = code.lines().flat_map(|line| line.split("&&")).map(|command| command.trim().to_owned());
    // The viewer opens a window, and is another program.
    commands.filter(|command| command.starts_with("hzn ") && !command.starts_with("hzn view")).collect()
}

/// Splits a command into its words, as a shell does, without the program.
fn split(command: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut quoted = false;
    for c in command.chars() {
        match c {
            '"' => quoted = !quoted,
            ' ' if !quoted => words.push(String::new()),
            c => words.last_mut().unwrap().push(c),
        }
    }
    words.into_iter().filter(|word| !word.is_empty()).skip(1).collect()
}

/// Returns EXIF with the focal length of the limb's pictures, 34 mm on 35 mm film.
fn exif_with_focal_length() -> Vec<u8> {
    let entry = |tag: u16, kind: u16, value: u32| {
        [&tag.to_le_bytes()[..], &kind.to_le_bytes(), &1u32.to_le_bytes(), &value.to_le_bytes()].concat()
    };
    let directory = |entry: Vec<u8>| [&1u16.to_le_bytes()[..], &entry, &0u32.to_le_bytes()].concat();
    let head = [b"II*\0".as_slice(), &8u32.to_le_bytes()].concat();
    [head, directory(entry(0x8769, 4, 26)), directory(entry(0xa405, 3, 34))].concat()
}

/// Returns a folder with what the documents assume: pictures of a flight with altitudes and truth, and a sensor.toml.
fn folder() -> Place {
    let place = Place::with_pictures(2);
    for i in 0..2 {
        let mut bytes = Vec::new();
        let mut encoder = image::codecs::png::PngEncoder::new(&mut bytes);
        encoder.set_exif_metadata(exif_with_focal_length()).unwrap();
        limb(320, 240, f64::from(i)).write_with_encoder(encoder).unwrap();
        place.write(&format!("in/000{i}.png"), &bytes);
    }
    fs::rename(place.path("in"), place.path("flight")).unwrap();
    // `hzn calibrate noise` would write the second one.
    for name in ["sensor.toml", "sensor-calibrated.toml"] {
        place.write(name, SENSOR.as_bytes());
    }
    place.write("flight/frames.csv", b"file,altitude_km\n0000.png,400\n0001.png,400\n");
    let columns = "file,time_s,body,limb,axis_x,axis_y,axis_z,half_angle_deg,altitude_km,sun_x,sun_y,sun_z,moon_x,\
                   moon_y,moon_z,qw,qx,qy,qz\n";
    let row = |i: u32| format!("000{i}.png,{i},earth-sphere,1,0,0.927184,0.374607,70.38,400,,,,,,,1,0,0,0\n");
    let truth = format!("{columns}{}{}", row(0), row(1));
    place.write("flight/truth.csv", truth.as_bytes());
    // `hzn init` writes a sensor for the Earth.
    place.write("truth.csv", truth.replace("earth-sphere", "earth").as_bytes());
    fs::create_dir_all(place.path("flight-2")).unwrap();
    for file in ["0000.png", "0001.png", "frames.csv"] {
        fs::copy(place.path(&format!("flight/{file}")), place.path(&format!("flight-2/{file}"))).unwrap();
    }
    // Some commands are for the root of the repository.
    for folder in ["tests/data/real", "tests/data/real/jupiter"] {
        fs::create_dir_all(place.path(folder)).unwrap();
        for path in fs::read_dir(root().join(folder)).unwrap().map(|entry| entry.unwrap().path()) {
            if path.is_file() {
                fs::copy(&path, place.path(folder).join(path.file_name().unwrap())).unwrap();
            }
        }
    }
    place
}

/// Runs a command in the folder; a flight is simulated with two pictures. What it writes may be there already, as it is
/// for a reader who repeats a chapter.
fn run(place: &Place, command: &str) -> Result<(), String> {
    let (command, file) = command.split_once(" > ").map_or((command, None), |(c, file)| (c, Some(file.trim())));
    let mut words = split(command);
    let is_simulated = words[0] == "simulate" && !words.contains(&"--show".to_owned());
    if is_simulated {
        words.retain(|word| word.parse::<u32>().is_err() && word != "--frames" && word != "--no-noise");
        words.extend(["--frames", "2", "--no-noise", "--force"].map(str::to_owned));
    } else if words[0] == "run" || words[0] == "init" {
        words.push("--force".to_owned());
    }
    if words[..] == ["init", "--force"] {
        // The lines after it use the sensor.toml of the line before.
        words.extend(["-o", "all.toml"].map(str::to_owned));
    }
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let output = place.command(&words).stdin(Stdio::null()).output().unwrap();
    if let Some(file) = file {
        place.write(file, &output.stdout);
    }
    if output.status.success() { Ok(()) } else { Err(String::from_utf8_lossy(&output.stderr).into_owned()) }
}

/// Returns an error if the program does not know an option of the command, or its value is wrong.
fn parse(place: &Place, command: &str) -> Result<(), String> {
    let mut words = split(command);
    words.push("--help".to_owned());
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let output = place.command(&words).output().unwrap();
    if output.status.success() { Ok(()) } else { Err(String::from_utf8_lossy(&output.stderr).into_owned()) }
}

#[test]
fn every_command_of_the_documents_runs() {
    let mut pages = vec![root().join("README.md"), root().join("crates/hzn-cli/README.md")];
    collect_pages(&root().join("book"), &mut pages);
    pages.sort();
    let (mut ran, mut failed) = (0, Vec::new());
    for page in pages {
        let commands = find_commands(&fs::read_to_string(&page).unwrap());
        let place = folder();
        for command in commands {
            let only_parsed = ONLY_PARSED.iter().any(|(beginning, _)| command.starts_with(beginning));
            let done = if only_parsed { parse(&place, &command) } else { run(&place, &command) };
            ran += usize::from(!only_parsed);
            failed.extend(done.err().map(|why| format!("{}: {command}: {why}", page.display())));
        }
    }
    assert!(failed.is_empty(), "{failed:#?}");
    assert!(ran > 12, "only {ran} commands were found");
}

#[test]
fn commands_are_found_in_shell_code_alone() {
    let page = "hzn a\n```sh\nhzn b 1   # comment\nhzn c \\\n  --d && hzn e \"f g\"\n```\n```text\nhzn h\n```\n";
    assert_eq!(find_commands(page), ["hzn b 1", "hzn c --d", "hzn e \"f g\""]);
    assert_eq!(split("hzn e \"f g\"  h"), ["e", "f g", "h"]);
}
