//! `hzn calibrate noise`, from beginning to end through the binary.

use std::path::Path;

use crate::common::assert_provenance;

const SCENE: &str = r#"
name = "small"
utc = 2019-06-13T10:30:00Z
[capture]
from_s = 90.0
to_s = 400.0
frames = 16
[camera]
width = 384
height = 256
model = "pinhole"
fx_px = 200.0
fy_px = 200.0
cx_px = 191.5
cy_px = 127.5
[trajectory.rocket]
[attitude.pointing]
off_nadir_deg = [72.0, 78.0]
azimuth_deg = [0.0, 200.0]
[world.visible]
[detector]
read_noise = 0.02
"#;

/// Runs hzn in a folder. Returns exit code, stdout, stderr.
fn hzn(folder: &Path, args: &[&str]) -> (i32, String, String) {
    let out = assert_cmd::Command::cargo_bin("hzn")
        .expect("the binary is built")
        .current_dir(folder)
        .args(args)
        .output()
        .expect("hzn starts");
    let text = |b: &[u8]| String::from_utf8_lossy(b).into_owned();
    (out.status.code().unwrap_or(-1), text(&out.stdout), text(&out.stderr))
}

/// Returns the number after a key in the text of a sensor.toml.
fn value(text: &str, key: &str) -> f64 {
    let line = text.lines().find(|l| l.starts_with(&format!("{key} = "))).unwrap_or_else(|| panic!("{key} in {text}"));
    line.split(" = ").nth(1).unwrap().split_whitespace().next().unwrap().parse().unwrap()
}

/// Renders a flight, and writes mine.toml, the sensor of a user who knows only the camera. Returns the text of the
/// sensor.toml that fits the scene.
fn render_flight(at: &Path) -> String {
    std::fs::write(at.join("my.toml"), SCENE).unwrap();
    let (code, _, stderr) = hzn(at, &["simulate", "my.toml", "-o", "flight", "-q"]);
    assert_eq!(code, 0, "{stderr}");
    let sensor = std::fs::read_to_string(at.join("flight/sensor.toml")).unwrap();
    let (_, camera) = sensor.split_once("[camera]").unwrap();
    let camera = camera.split("\n[").next().unwrap();
    std::fs::write(at.join("mine.toml"), format!("# my camera\n[camera]{camera}\n")).unwrap();
    sensor
}

/// Writes wrong.csv: the table of the flight with altitudes that are alternately 10 km too low and too high.
fn write_wrong_altitudes(at: &Path) {
    let mut rows = csv::Reader::from_path(at.join("flight/frames.csv")).unwrap();
    let column = rows.headers().unwrap().iter().position(|h| h == "altitude_km").unwrap();
    let mut wrong = String::from("file,altitude_km\n");
    for (i, row) in rows.records().enumerate() {
        let row = row.unwrap();
        let altitude_km: f64 = row[column].parse().unwrap();
        wrong += &format!("{},{}\n", &row[0], altitude_km + if i % 2 == 0 { 10.0 } else { -10.0 });
    }
    std::fs::write(at.join("wrong.csv"), wrong).unwrap();
}

#[test]
fn a_flight_gives_limb_height_and_noise_or_the_reason_why_not() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let rendered = render_flight(at);
    let calibrate = ["calibrate", "noise", "flight", "--sensor", "mine.toml"];
    let outputs = ["-o", "out.toml", "-o", "out.html"];
    let (code, stdout, stderr) = hzn(at, &[&calibrate[..], &outputs].concat());
    assert_eq!(code, 0, "{stdout}{stderr}");
    for what in ["limb height", "edge noise", "chi-square", "focal length", "[body] limb_height_km = "] {
        assert!(stdout.contains(what), "{what} in {stdout}");
    }
    let text = std::fs::read_to_string(at.join("out.toml")).unwrap();
    assert!(text.starts_with("# my camera\n") && text.contains("# calibrated: measured on "), "{text}");
    let (km, sigma) = (value(&text, "limb_height_km"), value(&text, "limb_height_sigma_km"));
    // The truth is the height that `hzn simulate` measured on other pictures of the scene.
    let true_km = value(&rendered, "limb_height_km");
    // A pixel is 7 km wide here, so blur bends the edge of the air. The limb height is 2 to 3 km too low in this scene.
    assert!((km - true_km).abs() < 3.0 * sigma && sigma < 3.5, "{km} ± {sigma}, {true_km}");
    let html = std::fs::read_to_string(at.join("out.html")).unwrap();
    assert_eq!(html.matches("<svg").count(), 2);
    assert_provenance(&html, true, "hzn calibrate noise");
    assert!(html.contains("Correlation of the residuals"));

    // The new sensor answers.
    let (code, _, stderr) = hzn(at, &["run", "flight", "--sensor", "out.toml", "-o", "out.csv", "-q"]);
    assert_eq!(code, 0, "{stderr}");

    // Outputs are not replaced without --force, and their ending must be of a known kind.
    let (code, _, stderr) = hzn(at, &[&calibrate[..], &outputs].concat());
    assert!(code == 2 && stderr.contains("exists already"), "{stderr}");
    let (code, _, stderr) = hzn(at, &[&calibrate[..], &["-o", "out.csv"]].concat());
    assert!(code == 2 && stderr.contains("a sensor ends in .toml"), "{stderr}");

    // The flight has too few pictures.
    let few: Vec<String> = (0..5).map(|i| format!("flight/small-{i:05}.png")).collect();
    let few: Vec<&str> = few.iter().map(String::as_str).collect();
    let (code, stdout, stderr) =
        hzn(at, &[&["calibrate", "noise"], &few[..], &["--sensor", "mine.toml", "-o", "few.toml", "-q"]].concat());
    assert_eq!(code, 1, "{stdout}{stderr}");
    assert!(stderr.contains("5 pictures have an answer, but at least 12 are needed"), "{stderr}");

    // The altitudes contradict each other.
    write_wrong_altitudes(at);
    let (code, stdout, stderr) =
        hzn(at, &[&calibrate[..], &["--frames", "wrong.csv", "-o", "wrong.toml", "-q"]].concat());
    assert_eq!(code, 1, "{stdout}{stderr}");
    assert!(stderr.contains("scatter more than their errors allow"), "{stderr}");
    assert!(!at.join("few.toml").exists() && !at.join("wrong.toml").exists());
}

/// Writes each of the first pictures of the flight several times, with its rows in frames.csv.
fn write_copies(at: &Path, folder: &str, pictures: usize, copies: usize) {
    std::fs::create_dir(at.join(folder)).unwrap();
    let table = std::fs::read_to_string(at.join("flight/frames.csv")).unwrap();
    let mut lines = table.lines().filter(|line| !line.starts_with('#'));
    let mut out = format!("{}\n", lines.next().unwrap());
    for line in lines.take(pictures) {
        let (name, rest) = line.split_once(',').unwrap();
        for copy in 0..copies {
            let other = name.replace(".png", &format!("-{copy}.png"));
            std::fs::copy(at.join("flight").join(name), at.join(folder).join(&other)).unwrap();
            out += &format!("{other},{rest}\n");
        }
    }
    std::fs::write(at.join(folder).join("frames.csv"), out).unwrap();
}

#[test]
fn a_copy_of_a_picture_says_nothing_new() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    render_flight(at);
    write_copies(at, "one", 1, 16);
    write_copies(at, "thrice", 16, 3);
    let sensor = ["--sensor", "mine.toml", "-q"];
    let run = |what: &str, folder: &str| hzn(at, &[&["calibrate", what, folder], &sensor[..]].concat());
    let (code, stdout, stderr) = run("noise", "one");
    assert!(code == 1 && stderr.contains("15 pictures are left out"), "{stdout}{stderr}");
    for what in ["noise", "sky", "check"] {
        let (once, thrice) = (run(what, "flight"), run(what, "thrice"));
        assert_eq!(once.0, thrice.0, "{what}: {} {}", once.2, thrice.2);
        let told = "32 pictures are left out: each is an earlier picture to the last bit, as small-00000-1.png is \
                    small-00000-0.png";
        assert!(!once.2.contains("left out") && thrice.2.contains(told), "{what}: {} {}", once.2, thrice.2);
        assert_eq!(thrice.2.matches("32 pictures").count(), 1, "{what}: {}", thrice.2);
        // The report is the same, but for the number of pictures.
        let rest = |text: &str| text.lines().filter(|l| !l.starts_with("pictures")).collect::<Vec<_>>().join("\n");
        let (once, thrice) = (rest(&once.1), rest(&thrice.1).replace("-0.png", ".png"));
        let [once, thrice] = [once, thrice].map(|text| text.replace("thrice", "flight"));
        assert_eq!(once, thrice, "{what}");
    }
}

#[test]
fn sun_and_moon_have_no_limb_height() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    std::fs::create_dir(at.join("in")).unwrap();
    image::GrayImage::new(64, 48).save(at.join("in/a.png")).unwrap();
    let sensor = "preset = \"sun\"\n[camera]\nwidth = 64\nheight = 48\nfx_px = 900.0\nfy_px = 900.0\ncx_px = \
    31.5\ncy_px = 23.5\n\
                  model = \"pinhole\"\n";
    std::fs::write(at.join("in/sensor.toml"), sensor).unwrap();
    let (code, _, stderr) = hzn(at, &["calibrate", "noise", "in"]);
    assert!(code == 2 && stderr.contains("no limb height to measure"), "{stderr}");
}
