//! `hzn calibrate sky` and `hzn calibrate check`, from beginning to end through the binary.

use crate::common::{Place, assert_provenance};

const FLIGHT: &str = r#"
name = "small"
utc = 2019-06-13T10:30:00Z
seed = 61
[capture]
from_s = 90.0
to_s = 400.0
frames = 20
[camera]
width = 480
height = 360
model = "pinhole"
fx_px = 240.0
fy_px = 240.0
cx_px = 241.5
cy_px = 178.0
[trajectory.rocket]
[attitude.pointing]
off_nadir_deg = [66.0, 80.0]
azimuth_deg = [0.0, 200.0]
[world.visible]
sun_in_view = false
[detector]
read_noise = 0.02
"#;

const SUN: &str = r#"
name = "sun"
utc = 2024-03-19T12:00:00Z
bodies = ["sun"]
seed = 5
[capture]
from_s = 0.0
to_s = 600.0
frames = 24
[camera]
width = 384
height = 288
model = "pinhole"
fx_px = 1500.0
fy_px = 1500.0
cx_px = 191.5
cy_px = 143.5
[trajectory.orbit]
perigee_km = 700.0
inclination_deg = 98.2
node_deg = 270.0
[attitude.towards]
bodies = ["sun"]
wander_deg = 4.0
[world.visible]
[exposure]
gain = 2.0
[detector]
read_noise = 0.01
[known]
attitude_sigma_deg = 0.005
"#;

/// Renders a scene into the folder `flight`, and writes a sensor of a user who knows only the camera: its focal length
/// is `percent` too long.
fn render(place: &Place, scene: &str, percent: f64, body: &str) {
    place.write("scene.toml", scene.as_bytes());
    place.run(&["simulate", "scene.toml", "-o", "flight", "-q"]).expect(0);
    let camera = scene.split("[camera]").nth(1).unwrap().split("\n[").next().unwrap();
    let focal: f64 = camera.split("fx_px = ").nth(1).unwrap().split_whitespace().next().unwrap().parse().unwrap();
    let old = format!("f{{}}_px = {focal:.1}");
    let new = format!("f{{}}_px = {}", focal * (1.0 + 0.01 * percent));
    let camera = ["x", "y"].iter().fold(camera.to_owned(), |text, axis| {
        let line = |template: &str| template.replace("{}", axis);
        text.replace(&line(&old), &line(&new))
    });
    place.write("mine.toml", format!("# my camera\n[camera]{camera}\n{body}").as_bytes());
}

/// Returns the number after a key of the sensor.toml.
fn value(text: &str, key: &str) -> f64 {
    let line = text.lines().find(|l| l.starts_with(&format!("{key} = "))).unwrap_or_else(|| panic!("{key} in {text}"));
    line.split(" = ").nth(1).unwrap().split_whitespace().next().unwrap().parse().unwrap()
}

#[test]
fn the_lens_comes_from_the_limb_and_is_checked() {
    let place = Place::new();
    render(&place, FLIGHT, 8.0, "");
    let sky = ["calibrate", "sky", "flight", "-s", "mine.toml", "-q"];
    let ran = place.run(&[&sky[..], &["-o", "new.toml", "-o", "new.html"]].concat()).expect(0);
    assert!(ran.out.contains("focal length") && ran.out.contains("observability"), "{}", ran.out);
    let text = place.read("new.toml");
    assert!(text.starts_with("# my camera") && text.contains("by `hzn calibrate sky`; it was 259.2"), "{text}");
    let focal = value(&text, "fx_px");
    let sigma: f64 = ran.out.split("fx = ").nth(1).unwrap().split(' ').nth(3).unwrap().parse().unwrap();
    assert!(sigma < 6.0 && (focal - 240.0).abs() < 3.0 * sigma, "{}", ran.out);
    assert!(place.read("new.html").contains("<svg"));
    assert_provenance(&place.read("new.html"), true, "hzn calibrate sky");
    // The file works, and the calibration that it holds is not rejected by the flight.
    place.run(&["camera", "show", "new.toml"]).expect(0);
    let check = place.run(&["calibrate", "check", "flight", "-s", "new.toml", "-q"]).expect(0);
    assert!(!check.out.contains("does not hold"), "{}", check.out);
    // The wrong lens is.
    let wrong = place.run(&["calibrate", "check", "flight", "-s", "mine.toml", "-q"]).expect(1);
    assert!(
        wrong.out.starts_with("verdict        does not hold: the focal length is smaller in flight"),
        "{}",
        wrong.out
    );
    // Files are not replaced.
    place.run(&[&sky[..], &["-o", "new.toml"]].concat()).expect(2).says("exists already");
    place.run(&[&sky[..], &["-o", "new.csv"]].concat()).expect(2).says("a sensor ends in .toml");
    // Without altitudes nothing is known.
    place.write("none.csv", b"file\n");
    let none = place.run(&[&sky[..], &["--frames", "none.csv"]].concat());
    none.expect(2).says("altitude");
    // The mount needs attitudes.
    let mount = place.run(&[&sky[..], &["--mount", "-o", "mount.toml"]].concat()).expect(1);
    mount.says("--mount: 0 pictures have a limb, a position");
    assert!(!place.path("mount.toml").exists());
    place.run(&["calibrate", "check", "flight", "-s", "mine.toml", "--detect-percent", "0"]).expect(2).says("above 0");
}

#[test]
fn few_pictures_of_the_limb_write_nothing() {
    let place = Place::new();
    render(&place, &FLIGHT.replace("frames = 20", "frames = 2"), 0.0, "[camera2]\n");
    place.run(&["calibrate", "sky", "flight", "-s", "mine.toml", "-q"]).expect(2).says("camera2");
    let camera = place.read("mine.toml").replace("[camera2]\n", "focal_sigma_percent = 0.02\ncentre_sigma_px = 0.1\n");
    place.write("mine.toml", camera.as_bytes());
    let ran = place.run(&["calibrate", "sky", "flight", "-s", "mine.toml", "-q", "-o", "new.toml"]).expect(1);
    assert!(ran.out.contains("not determined"), "{}", ran.out);
    ran.says("no sensor.toml is written: the flight gives the focal length to");
    assert!(!place.path("new.toml").exists());
    let check = place.run(&["calibrate", "check", "flight", "-s", "mine.toml", "-q"]).expect(0);
    assert!(check.out.starts_with("verdict        cannot tell"), "{}", check.out);
    place
        .run(&["calibrate", "sky", "flight", "-s", "mine.toml", "-q", "--free-limb-height"])
        .expect(1)
        .says("at least 12");
}

#[test]
fn the_lens_comes_from_the_sun() {
    let place = Place::new();
    render(&place, SUN, 2.0, "[body]\nkind = \"sun\"\n");
    let sky = ["calibrate", "sky", "flight", "-s", "mine.toml", "-q"];
    let ran = place.run(&[&sky[..], &["--mount", "-o", "new.toml"]].concat()).expect(0);
    assert!(ran.out.contains("discs with a direction"), "{}", ran.out);
    let text = place.read("new.toml");
    assert!((value(&text, "fx_px") / 1500.0 - 1.0).abs() < 0.002, "{}", ran.out);
    assert!(text.contains("q_vehicle_from_camera_wxyz") && text.contains("discs of Sun or Moon in flight"), "{text}");
    place.run(&["calibrate", "check", "flight", "-s", "mine.toml", "-q"]).expect(2).says("only for Sun and Moon");
    place.write("none.csv", b"file\n");
    place
        .run(&[&sky[..], &["--frames", "none.csv"]].concat())
        .expect(1)
        .says("0 pictures have an answer and a direction");
}
