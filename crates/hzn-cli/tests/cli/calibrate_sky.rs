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
    place.run(&["simulate", "scene.toml", "-o", "flight", "-q", "--no-noise"]).expect(0);
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
    // A reader that stops reading the report costs no file.
    let mut piped = place.command(&[&sky[..], &["-o", "piped.toml"]].concat());
    let mut piped = piped.stdout(std::process::Stdio::piped()).spawn().unwrap();
    drop(piped.stdout.take());
    assert_eq!(piped.wait().unwrap().code(), Some(0));
    assert_eq!(value(&place.read("piped.toml"), "fx_px"), focal);
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

/// Returns the number after a word of the report and the one behind its ±.
fn number(report: &str, after: &str) -> [f64; 2] {
    let mut words = report.split(after).nth(1).unwrap().split_whitespace();
    let mut next = || words.find_map(|word| word.parse().ok()).unwrap();
    [next(), next()]
}

/// One after the other, limb and Sun are one adjustment, because the covariance of the lens goes from one to the other.
/// The lens of both is that of the Sun, in either order, and with it the limb gives a better height.
#[test]
fn limb_and_sun_follow_each_other() {
    let place = Place::new();
    let camera = FLIGHT.split("[camera]").nth(1).unwrap().split("\n[").next().unwrap();
    let own = SUN.split("[camera]").nth(1).unwrap().split("\n[").next().unwrap();
    let sun = SUN.replace(own, camera).replace("wander_deg = 4.0", "wander_deg = 25.0");
    let known = "focal_sigma_percent = 5.0\ncentre_sigma_px = 8.0\n";
    render(&place, &sun, 3.0, known);
    std::fs::rename(place.path("flight"), place.path("sun")).unwrap();
    render(&place, &FLIGHT.replace("frames = 20", "frames = 40"), 3.0, known);
    let of_sun = |text: &str| format!("{text}\n[body]\nkind = \"sun\"\n");
    let sky =
        |pictures: &str, from: &str, to: &str| place.run(&["calibrate", "sky", pictures, "-s", from, "-q", "-o", to]);
    place.write("mine-sun.toml", of_sun(&place.read("mine.toml")).as_bytes());
    sky("sun", "mine-sun.toml", "by-sun.toml").expect(0);
    let alone = sky("flight", "mine.toml", "by-limb.toml").expect(0);
    place.write("by-limb-sun.toml", of_sun(&place.read("by-limb.toml")).as_bytes());
    let both = sky("sun", "by-limb-sun.toml", "by-both.toml").expect(0);
    let [_, sigma_px] = number(&both.out, "fx_px          ");
    for key in ["fx_px", "cx_px", "cy_px"] {
        let [first, last] = ["by-sun.toml", "by-both.toml"].map(|file| value(&place.read(file), key));
        assert!((first - last).abs() < 0.5 * sigma_px, "{key}: {first} {last}");
    }
    // The limb cannot halve the sigmas that the Sun has left, so nothing is written; the report has the height.
    place.write("by-sun-limb.toml", place.read("by-sun.toml").replace("kind = \"sun\"", "").as_bytes());
    let after = sky("flight", "by-sun-limb.toml", "no.toml").expect(1);
    let [[_, before_km], [_, after_km]] = [&alone.out, &after.out].map(|report| number(report, "limb height    "));
    println!("{}\n{}\n{}", alone.out, both.out, after.out);
    assert!(after_km < 0.7 * before_km, "{before_km} {after_km}");
}
