//! No command replaces a file that it reads, whatever path leads there and whether files may be replaced or not.
#![cfg(unix)]

use std::fs;
use std::os::unix::fs::symlink;

use crate::common::{Place, SENSOR, commands};

const TRUTH: &str = "file,time_s,body,limb,axis_x,axis_y,axis_z,half_angle_deg,altitude_km,sun_x,sun_y,sun_z,moon_x,\
                     moon_y,moon_z,qw,qx,qy,qz\n0000.png,0,earth-sphere,1,0,0.93,0.37,70.38,400,,,,,,,1,0,0,0\n";
const CAMERA: &str = "cam0:\n  camera_model: pinhole\n  intrinsics: [300.0, 300.0, 159.5, 119.5]\n  resolution: [320, \
                      240]\n  distortion_model: equidistant\n  distortion_coeffs: [0.01, 0.0, 0.0, 0.0]\n";

/// A file that is read, and a command that would replace it.
type Case = (&'static str, &'static [&'static str]);

/// Every command that has inputs and outputs.
const CASES: &[Case] = &[
    ("in/frames.csv", &["run", "in", "-o", "in/frames.csv", "--force"]),
    ("in/frames.csv", &["run", "in", "-o", "link/frames.csv", "--force"]),
    ("in/frames.csv", &["run", "in", "-o", "in/frames.csv", "--resume"]),
    ("f.csv", &["run", "in", "--frames", "f.csv", "-o", "f.csv", "--force"]),
    ("f.csv", &["run", "in", "--frames", "f.csv", "-o", "./f.csv", "--force"]),
    ("f.csv", &["run", "in", "--frames", "in/../f.csv", "-o", "f.csv", "--force"]),
    ("f.csv", &["run", "in", "--frames", "f.csv", "-o", "f-link.csv", "--force"]),
    ("f.csv", &["run", "in", "--frames", "f-link.csv", "-o", "f.csv", "--force"]),
    ("f.csv", &["run", "in", "--frames", "f.csv", "-o", "f-hard.csv", "--force"]),
    ("new.csv.part", &["run", "in", "--frames", "new.csv.part", "-o", "new.csv", "--force"]),
    ("new.csv.part", &["run", "in", "--frames", "new.csv.part", "-o", "new.csv", "--resume"]),
    ("new.csv.part.chain", &["run", "in", "--frames", "new.csv.part.chain", "-o", "new.csv", "--force"]),
    ("s.csv", &["run", "in", "--sensor", "s.csv", "-o", "s.csv", "--force"]),
    ("lens.csv", &["run", "in", "--sensor", "lens.toml", "-o", "lens.csv", "--force"]),
    ("a.mcap", &["run", "a.mcap", "-o", "a.mcap", "--force"]),
    ("a.mcap", &["run", "a.mcap", "-o", "./a.mcap"]),
    ("other/0001.png", &["run", "in/0000.png", "other/0001.png", "--overlay", "other", "--force"]),
    ("other/0001.png", &["run", "in/0000.png", "other/0001.png", "--mask-pictures", "other", "--force"]),
    ("other/b.fits", &["run", "a.fits", "other/b.fits", "-s", "in/sensor.toml", "--wcs", "other", "--force"]),
    ("in/0000.png", &["explain", "in", "--overlay", "in/0000.png", "--force"]),
    ("in/0001.png", &["explain", "in", "--overlay", "in/0001.png"]),
    ("f.csv", &["explain", "in", "--frames", "f.csv", "--overlay", "f-link.png", "--force"]),
    ("in/sensor.toml", &["prepare", "in/sensor.toml", "-o", "in/sensor.toml", "--force"]),
    ("a.csv", &["export", "a.csv", "-o", "a.csv", "--force"]),
    ("new.csv.part", &["export", "new.csv.part", "-o", "new.csv", "--force"]),
    ("a.mcap", &["export", "a.mcap", "--images", "links", "--force"]),
    ("a.mcap", &["export", "a.mcap", "--imu", "./a.mcap", "--force"]),
    ("a.mcap", &["export", "a.mcap", "--imu", "i.csv", "--gnss", "a.mcap", "--force"]),
    ("a.mcap", &["export", "a.mcap", "--overlay", "links", "--force"]),
    ("a.csv", &["recover", "a.csv", "-o", "a.csv", "--force"]),
    ("a.mcap", &["recover", "a.mcap", "-o", "./a.mcap", "--force"]),
    ("b.recovering.mcap", &["recover", "b.recovering.mcap", "-o", "b.mcap"]),
    ("new.csv.part", &["recover", "part-link.csv", "-o", "new.csv"]),
    ("new.csv.part", &["recover", "./new.csv.part", "-o", "new.csv"]),
    ("f.csv", &["fuse", "--nadir", "a.csv", "--imu", "f.csv", "--gnss", "g.csv", "-o", "f.csv", "--force"]),
    ("a.mcap", &["fuse", "--nadir", "a.mcap", "--imu", "f.csv", "--gnss", "g.csv", "-o", "./a.mcap", "--force"]),
    (
        "n.innovations.csv",
        &["fuse", "--nadir", "a.csv", "--imu", "f.csv", "--gnss", "n.innovations.csv", "-o", "n.csv", "--force"],
    ),
    (
        "in/truth.csv",
        &[
            "fuse",
            "--nadir",
            "a.csv",
            "--imu",
            "f.csv",
            "--gnss",
            "g.csv",
            "--truth",
            "in/truth.csv",
            "--report",
            "link/truth.csv",
            "-o",
            "n.csv",
            "--force",
        ],
    ),
    (
        "n.tf",
        &[
            "fuse",
            "--nadir",
            "a.csv",
            "--imu",
            "f.csv",
            "--gnss",
            "g.csv",
            "--mount",
            "a=n.tf",
            "--ck",
            "n.bc",
            "--utc",
            "2019-06-13T04:00:00Z",
            "-o",
            "n.csv",
            "--force",
        ],
    ),
    (
        "g.csv",
        &[
            "fuse",
            "--nadir",
            "a.csv",
            "--imu",
            "f.csv",
            "--gnss",
            "g.csv",
            "--write-frames",
            "a=g.csv",
            "-o",
            "n.csv",
            "--force",
        ],
    ),
    (
        "f.csv",
        &[
            "fuse",
            "--nadir",
            "a.csv",
            "--imu",
            "a.csv",
            "--gnss",
            "g.csv",
            "--attitude",
            "f.csv",
            "--aem",
            "f-hard.csv",
            "--utc",
            "2019-06-13T04:00:00Z",
            "-o",
            "n.csv",
            "--force",
        ],
    ),
    ("sim/scene.toml", &["simulate", "sim/scene.toml", "-o", "sim", "--frames", "1", "--force"]),
    ("scene.toml", &["simulate", "./scene.toml", "-o", "sim-link", "--frames", "1", "--force"]),
    ("in/0001.png", &["init", "in", "--fov", "60", "-o", "in/0001.png", "--force"]),
    ("a.mcap", &["init", "a.mcap", "--fov", "60", "-o", "a.mcap", "--force"]),
    ("a.csv", &["evaluate", "a.csv", "--truth", "in", "-o", "a-link.json", "--force"]),
    ("in/0000.png", &["evaluate", "a.csv", "--truth", "in/truth.csv", "-o", "0000-link.html", "--force"]),
    ("s.csv", &["sensitivity", "--sensor", "s.csv", "-o", "s.csv", "--force"]),
    ("lens.csv", &["sensitivity", "--sensor", "lens.toml", "-o", "lens.csv", "--force"]),
    ("f.csv", &["calibrate", "board", "in/0000.png", "f-link.png", "--board", "9x6", "-o", "f.csv", "--force"]),
    ("f.csv", &["calibrate", "points", "f.csv", "--size", "320x240", "-o", "f.csv", "--force"]),
    ("in/sensor.toml", &["calibrate", "sky", "in", "-o", "in/sensor.toml", "--force"]),
    ("in/sensor.toml", &["calibrate", "noise", "in", "-o", "link/sensor.toml", "--force"]),
    ("in/sensor.toml", &["calibrate", "noise", "in", "-o", "in/sensor.toml"]),
    (
        "in/sensor.toml",
        &["calibrate", "mount", "flight", "f.csv", "--told", "in/sensor.toml", "-o", "link/sensor.toml", "--force"],
    ),
    ("in/sensor.toml", &["calibrate", "rig", "in/sensor.toml", "-o", "link/sensor.toml", "--force"]),
    ("lens.toml", &["calibrate", "mount", "kalibr", "lens.toml", "--fuse", "lens.toml", "--force"]),
    ("in/sensor.toml", &["camera", "convert", "in/sensor.toml", "-o", "in/sensor.toml", "--force"]),
    ("in/sensor.toml", &["camera", "show", "in/sensor.toml", "--picture", "sensor-link.png", "--force"]),
    ("lens.csv", &["camera", "show", "lens.toml", "--picture", "lens-link.png", "--force"]),
    ("t.bin", &["telemetry", "t.bin", "--housekeeping", "t.bin", "--force"]),
    ("f.csv", &["telemetry", "f.csv", "-o", "./f.csv", "--force"]),
    ("in/sensor.toml", &["telecommand", "load in/sensor.toml", "-o", "in/sensor.toml", "--force"]),
    ("f.csv", &["telecommand", "ping", "--key", "f.csv", "-o", "f.csv", "--force"]),
    ("f.csv", &["telemetry", "t.bin", "--key", "f.csv", "-o", "f.csv", "--force"]),
    ("lens.csv", &["telecommand", "ping", "load lens.toml", "-o", "lens.csv", "--force"]),
    #[cfg(target_os = "linux")]
    ("state/parameters-1.bin", &["fly", "-", "--sensor", "state/parameters-1.bin", "--state", "state"]),
];

/// The commands that write no file, or read none that the user names; and `migrate`, whose task is to rewrite its
/// input.
const WITHOUT: &[&str] = &["info", "view", "completions", "demo", "help", "migrate", "man", "key", "schema"];

/// Returns a dark FITS file.
fn fits() -> Vec<u8> {
    let cards = ["SIMPLE  = T", "BITPIX  = 8", "NAXIS   = 2", "NAXIS1  = 320", "NAXIS2  = 240", "END"];
    let mut bytes: Vec<u8> = cards.iter().flat_map(|card| format!("{card:<80}").into_bytes()).collect();
    bytes.resize(2880 + 320 * 240, b' ');
    bytes
}

/// Returns a folder with an input of each kind, and links to them.
fn place() -> Place {
    let place = Place::with_pictures(2);
    for folder in ["other", "links", "sim", "state"] {
        fs::create_dir(place.path(folder)).unwrap();
    }
    place.run(&["run", "in", "-o", "a.mcap", "-q"]).expect(0);
    place.run(&["export", "a.mcap", "-o", "a.csv"]).expect(0);
    let copy = |from: &str, to: &str| assert!(fs::copy(place.path(from), place.path(to)).unwrap() > 0);
    copy("in/0001.png", "other/0001.png");
    copy("a.mcap", "b.recovering.mcap");
    for name in ["a.fits", "other/b.fits"] {
        place.write(name, &fits());
    }
    for name in ["in/frames.csv", "f.csv", "g.csv", "n.innovations.csv", "new.csv.part", "new.csv.part.chain"] {
        place.write(name, b"file,altitude_km\n0000.png,400\n0001.png,400\n");
    }
    for name in ["s.csv", "state/parameters-1.bin"] {
        place.write(name, SENSOR.as_bytes());
    }
    place.write("in/truth.csv", TRUTH.as_bytes());
    place.write("lens.csv", CAMERA.as_bytes());
    place.write("lens.toml", b"[camera]\nfile = \"lens.csv\"\n[body]\naltitude_km = 400.0\n");
    place.write("n.tf", b"[mount]\nq_vehicle_from_camera_wxyz = [1.0, 0.0, 0.0, 0.0]\n");
    place.write("t.bin", b"no packet");
    let scene = place.run(&["simulate", "enceladus", "--show"]).expect(0).out;
    for name in ["scene.toml", "sim/scene.toml"] {
        place.write(name, scene.as_bytes());
    }
    fs::hard_link(place.path("f.csv"), place.path("f-hard.csv")).unwrap();
    for (to, link) in [
        ("in", "link"),
        (".", "sim-link"),
        ("f.csv", "f-link.csv"),
        ("f.csv", "f-link.png"),
        ("a.csv", "a-link.json"),
        ("in/0000.png", "0000-link.html"),
        ("in/sensor.toml", "sensor-link.png"),
        ("lens.csv", "lens-link.png"),
        ("new.csv.part", "part-link.csv"),
        ("../a.mcap", "links/0000.png"),
    ] {
        symlink(to, place.path(link)).unwrap();
    }
    place
}

/// Returns the names and bytes of all files below a folder, without following links.
fn everything(place: &Place, folder: &str) -> Vec<(String, Vec<u8>)> {
    let mut all = Vec::new();
    for entry in fs::read_dir(place.path(folder)).unwrap() {
        let entry = entry.unwrap();
        let name = format!("{folder}/{}", entry.file_name().to_str().unwrap());
        match entry.file_type().unwrap() {
            kind if kind.is_dir() => all.extend(everything(place, &name)),
            kind if kind.is_symlink() => {
                all.push((name, fs::read_link(entry.path()).unwrap().into_os_string().into_encoded_bytes()));
            }
            _ => all.push((name, fs::read(entry.path()).unwrap())),
        }
    }
    all.sort();
    all
}

#[test]
fn no_command_replaces_what_it_reads() {
    let place = place();
    let before = everything(&place, ".");
    for (input, args) in CASES {
        let ran = place.run(args);
        assert_eq!(ran.code, 2, "{args:?}: {}{}", ran.out, ran.err);
        assert!(
            ran.err.contains(": is the input ") && ran.err.contains("and would be replaced"),
            "{args:?}: {}",
            ran.err
        );
        // Nothing else is written or removed either.
        assert!(everything(&place, ".") == before, "{args:?}: {input} or another file has changed");
    }
}

#[test]
fn every_command_is_in_the_table() {
    let place = Place::new();
    let listed = |words: &[&str]| CASES.iter().any(|(_, args)| args.starts_with(words));
    let all = commands(&place, &["--help"]);
    assert!(all.len() > 15, "{all:?}");
    for name in all {
        assert!(listed(&[&name]) != WITHOUT.contains(&name.as_str()), "{name}");
    }
    for name in commands(&place, &["calibrate", "--help"]) {
        // `check` only prints.
        assert!(listed(&["calibrate", &name]) != ["check", "help"].contains(&name.as_str()), "calibrate {name}");
    }
}

#[test]
fn what_is_not_read_may_be_replaced() {
    let place = place();
    for args in [
        // Next to the pictures, under the name of another camera's sensor, over an earlier result.
        ["run", "in", "-o", "in/out.csv", "--force"],
        ["run", "in", "-o", "f.csv", "--force"],
        ["export", "a.mcap", "-o", "a.csv", "--force"],
        ["export", "a.mcap", "--images", "in", "--force"],
        ["camera", "convert", "in/sensor.toml", "-o", "lens.toml"],
    ] {
        let args = if args[0] == "camera" { [&args[..], &["--force"]].concat() } else { args.to_vec() };
        place.run(&args).expect(0);
    }
    // A scene in its own folder is known to be the same when its rendering is continued.
    place.run(&["simulate", "enceladus", "-o", "saturn", "--frames", "1", "-q"]).expect(0);
    let scene = place.read("saturn/scene.toml");
    fs::remove_file(place.path("saturn/enceladus-00000.png")).unwrap();
    place.run(&["simulate", "saturn/scene.toml", "-o", "saturn", "--resume", "-q"]).expect(0);
    assert_eq!(place.read("saturn/scene.toml"), scene);
    assert!(place.path("saturn/enceladus-00000.png").exists());
    // An unfinished table is finished in place.
    let rows = place.read("a.csv");
    place.write("cut.csv.part", &rows.as_bytes()[..rows.len() - 5]);
    place.run(&["recover", "cut.csv.part", "-o", "cut.csv"]).expect(0).says("1 row kept");
}
