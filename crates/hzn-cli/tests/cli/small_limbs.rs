//! `hzn simulate`, `hzn run` and `hzn evaluate` agree on which pictures show a limb, also a short one.

use std::path::Path;

/// A thermal array of 32 x 24 pixels in a low orbit: no picture has 50 px of limb.
const THERMAL: &str = r#"
name = "thermal"
utc = 2021-07-15T00:00:00Z
[capture]
to_s = 2900.0
frames = 40
[camera]
width = 32
height = 24
model = "pinhole"
fx_px = 30.0
fy_px = 30.0
cx_px = 15.5
cy_px = 11.5
[trajectory.orbit]
perigee_km = 600.0
[attitude.pointing]
off_nadir_deg = [62.0, 68.0]
azimuth_deg = [0.0, 300.0]
[world.infrared]
[detector]
psf_sigma_px = 0.6
read_noise = 0.01
bits = 16
"#;

/// The Sun with a radius of 2.7 px: its whole outline has 17 px.
const SUN: &str = r#"
name = "sun"
utc = 2019-06-13T10:30:00Z
bodies = ["sun"]
[capture]
from_s = 70.0
to_s = 420.0
frames = 12
[camera]
width = 320
height = 240
model = "equidistant"
fx_px = 580.0
fy_px = 580.0
cx_px = 159.5
cy_px = 119.5
[trajectory.rocket]
[attitude.towards]
bodies = ["sun"]
wander_deg = 6.0
[world.visible]
[detector]
psf_sigma_px = 0.9
read_noise = 0.01
"#;

/// Runs hzn in a folder and returns its stdout.
fn hzn(folder: &Path, args: &[&str]) -> String {
    let out = assert_cmd::Command::cargo_bin("hzn")
        .expect("the binary is built")
        .current_dir(folder)
        .args(args)
        .output()
        .expect("hzn starts");
    assert!(out.status.success(), "{args:?}: {}", String::from_utf8_lossy(&out.stderr));
    String::from_utf8_lossy(&out.stdout).into_owned()
}

#[test]
fn answers_to_short_limbs_are_answers_and_not_false() {
    for (name, scene, body, pictures) in [("thermal", THERMAL, "earth", 40), ("sun", SUN, "sun", 12)] {
        let dir = tempfile::tempdir().unwrap();
        let at = dir.path();
        std::fs::write(at.join("my.toml"), scene).unwrap();
        let told = hzn(at, &["simulate", "my.toml", "-o", "out", "-q"]);
        assert!(told.contains(&format!("limb of the {body} in view in {pictures}\n")), "{name}: {told}");
        let truth = hzn_files::truth::load(&at.join("out/truth.csv")).unwrap();
        assert_eq!(truth.iter().filter(|row| row.has_limb()).count(), pictures, "{name}");
        hzn(at, &["run", "out", "-o", "out.csv", "-q"]);
        let told = hzn(at, &["evaluate", "out.csv", "--truth", "out/truth.csv", "-o", "e.json"]);
        let json: serde_json::Value = serde_json::from_slice(&std::fs::read(at.join("e.json")).unwrap()).unwrap();
        let e = &json["evaluations"][0];
        assert_eq!((e["with_limb"].as_u64(), e["false_answers"].as_u64()), (Some(pictures as u64), Some(0)), "{told}");
        let answered = e["answered"].as_u64().unwrap() as usize;
        assert!(answered * 10 >= pictures * 9, "{name}: {told}");
        let worst_deg = e["errors"]["worst_deg"].as_f64().unwrap();
        assert!(worst_deg < 1.0, "{name}: {told}");
    }
}

/// A thermal camera with fine pixels sees the weather bend a short arc of the limb. While only a tilt and a bend of 1.1
/// km were expected, the mean squared error of such flights was 9 in units of the covariance, and many were refused.
#[test]
fn the_weather_that_fine_pixels_see_is_in_the_covariance() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let array = hzn(at, &["simulate", "thermal-array", "--show"]);
    let camera = [
        ("width = 32", "width = 320"),
        ("height = 24", "height = 256"),
        ("model = \"equidistant\"", "model = \"pinhole\""),
        ("fx_px = 16.67", "fx_px = 439.6"),
        ("fy_px = 16.67", "fy_px = 439.6"),
        ("cx_px = 15.5", "cx_px = 159.5"),
        ("cy_px = 11.5", "cy_px = 127.5"),
        ("read_noise = 0.0026", "read_noise = 0.001"),
        ("halves = \"chess\"\nhalves_s = 0.25\n", ""),
    ];
    let fine = camera.iter().fold(array, |scene, (from, to)| {
        assert!(scene.contains(from), "{from}");
        scene.replace(&format!("\n{from}"), &format!("\n{to}"))
    });
    std::fs::write(at.join("fine.toml"), fine).unwrap();
    hzn(at, &["simulate", "fine.toml", "-o", "fine", "--frames", "40", "--seed", "31", "--no-noise", "-q"]);
    hzn(at, &["run", "fine", "-o", "fine.csv", "-q"]);
    let told = hzn(at, &["evaluate", "fine.csv", "--truth", "fine/truth.csv", "-o", "fine.json"]);
    let json: serde_json::Value = serde_json::from_slice(&std::fs::read(at.join("fine.json")).unwrap()).unwrap();
    let e = &json["evaluations"][0];
    assert!(e["answered"].as_u64().unwrap() >= 39, "{told}");
    let (rms_deg, nees) = (e["errors"]["rms_deg"].as_f64().unwrap(), e["honesty"]["nees"].as_f64().unwrap());
    assert!(rms_deg < 0.25 && (0.3..3.0).contains(&nees), "{told}");
    assert!(hzn(at, &["explain", "fine/thermal-array-00000.png"]).contains("the weather along the limb"));
}

/// Before the floors of the noise kept their angle in wide pixels, the error was 0.53 to 0.63 degrees.
#[test]
fn a_thermal_array_is_as_sure_as_it_is_right() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    for (name, seed) in [("a", "21"), ("b", "22")] {
        let (truth, json) = (format!("{name}/truth.csv"), format!("{name}.json"));
        hzn(at, &["simulate", "thermal-array", "--frames", "60", "--seed", seed, "--no-noise", "-o", name, "-q"]);
        hzn(at, &["run", name, "-o", &format!("{name}.csv"), "-q"]);
        let told = hzn(at, &["evaluate", &format!("{name}.csv"), "--truth", &truth, "-o", &json]);
        let json: serde_json::Value = serde_json::from_slice(&std::fs::read(at.join(json)).unwrap()).unwrap();
        let e = &json["evaluations"][0];
        assert!(e["answered"].as_u64().unwrap() >= 57, "{told}");
        let (rms_deg, nees) = (e["errors"]["rms_deg"].as_f64().unwrap(), e["honesty"]["nees"].as_f64().unwrap());
        assert!(rms_deg < 0.4 && (0.3..3.0).contains(&nees), "{told}");
    }
}
