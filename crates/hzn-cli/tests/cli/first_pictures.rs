//! The first pictures of new users: answers are right within their sigmas, and what cannot be answered is refused.
//!
//! `tests/data/field/README.md` has the origin and the right answer of each.

use std::path::{Path, PathBuf};

use crate::common::{Place, angle_deg, cell, rows};

type Row = Vec<(String, String)>;

const JUPITER: &str = "JNCE_2021052_32C00054_V01-red.png";

fn field(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/field").join(name)
}

/// Copies a folder of the data into `in`; its sensor.toml replaces that of the place, with `more` after it.
fn place_of(folder: &str, more: &str) -> Place {
    let place = Place::new();
    for entry in std::fs::read_dir(field(folder)).unwrap() {
        let path = entry.unwrap().path();
        place.write(&format!("in/{}", path.file_name().unwrap().display()), &std::fs::read(&path).unwrap());
    }
    let toml = place.read("in/sensor.toml");
    place.write("in/sensor.toml", format!("{toml}{more}").as_bytes());
    place
}

fn run(place: &Place) -> Vec<Row> {
    rows(&place.run(&["run", "in"]).expect(0).out)
}

fn number(row: &Row, name: &str) -> f64 {
    cell(row, name).parse().unwrap_or_else(|_| panic!("{name} of {row:?}"))
}

fn axis(row: &Row) -> [f64; 3] {
    ["axis_x", "axis_y", "axis_z"].map(|name| number(row, name))
}

fn unit([x, y, z]: [f64; 3]) -> [f64; 3] {
    let n = (x * x + y * y + z * z).sqrt();
    [x / n, y / n, z / n]
}

/// Asserts that a row is an answer, within three of its sigmas of the truth.
#[track_caller]
fn assert_right(row: &Row, truth: [f64; 3]) {
    assert_eq!(cell(row, "status"), "ok", "{row:?}");
    let (error, sigma) = (angle_deg(axis(row), unit(truth)), number(row, "sigma_max_deg"));
    println!("{}: {error:.4} deg, sigma {sigma:.4} deg", cell(row, "file"));
    assert!(error <= 3.0 * sigma, "{}: {error} deg with a sigma of {sigma} deg", cell(row, "file"));
}

#[test]
fn the_limb_is_answered_and_no_disc_against_the_altitude() {
    let rows = run(&place_of("altitude-gate", ""));
    assert_right(&rows[0], [0.05, -0.66, 0.75]);
    assert!((number(&rows[0], "half_angle_deg") - 33.34).abs() < 0.05);
    let (found, sigma) = (number(&rows[0], "altitude_est_km"), number(&rows[0], "altitude_est_sigma_km"));
    assert!((found - 1424.0).abs() < 3.0 * sigma && (found - 6000.0).abs() < 3.0 * 5000.0, "{found} +- {sigma} km");
    assert_eq!((cell(&rows[1], "status"), cell(&rows[1], "axis_x")), ("rejected", ""), "{:?}", rows[1]);
}

#[test]
fn discs_of_any_size_and_tone_are_answered() {
    let small = [(1137.3 - 1639.5) / 2716.33, (1789.6 - 1231.5) / 2716.33, 1.0];
    assert_right(&run(&place_of("small-disc", ""))[0], small);
    assert_right(&run(&place_of("lost-blocks", ""))[0], [-0.05, 0.02, 1.0]);
    assert_right(&run(&place_of("invert", "[input]\ninvert = true\n"))[0], [0.02, -0.01, 1.0]);
    // Without the key, nothing in the picture has the form of the body.
    let dark = place_of("invert", "");
    let row = &run(&dark)[0];
    assert_eq!((cell(row, "status"), cell(row, "axis_x")), ("rejected", ""), "{row:?}");
    let explained = dark.run(&["explain", "in/dark-disc-on-bright-sky.png"]).expect(0);
    assert!(explained.out.contains("set invert = true in [input]"), "{}", explained.out);
}

#[test]
fn a_balloon_is_answered_on_the_visible_limb() {
    let row = &run(&place_of("glow-balloon", ""))[0];
    assert_right(row, [0.36, 0.932, 0.06]);
    // The only edge of the picture is the visible limb, and all of its points lie on the fitted one.
    assert_eq!(cell(row, "inliers"), cell(row, "edge_points"), "{row:?}");
    assert!(number(row, "rms_px") < 1.0 && number(row, "p_limb") > 0.5, "{row:?}");
}

#[test]
fn the_disc_of_a_weather_satellite_is_the_axis_of_its_camera() {
    let row = &run(&place_of("geo-disc", ""))[0];
    assert_right(row, [0.0, 0.0, 1.0]);
    assert!(angle_deg(axis(row), [0.0, 0.0, 1.0]) <= 0.01, "{row:?}");
}

#[test]
fn a_dark_moon_before_the_corona_is_answered_and_no_edge_of_a_spacecraft() {
    let place = Place::new();
    let sensor = |height: u32, invert: bool| {
        let middle = f64::from(height - 1) * 0.5;
        format!(
            "[camera]\nwidth = 1920\nheight = {height}\nmodel = \"pinhole\"\nfx_px = 7200\nfy_px = 7200\n\
             cx_px = 959.5\ncy_px = {middle}\nfocal_sigma_percent = 2.0\n[input]\ninvert = {invert}\n[body]\n\
             kind = \"sphere\"\n\
             radius_km = 1737.4\naltitude_km = 42300\naltitude_sigma_km = 3000\nlimb_height_km = 0\n\
             limb_height_sigma_km = 5\n"
        )
    };
    let answer = |name: &str, height: u32, invert: bool| {
        place.write("in/sensor.toml", sensor(height, invert).as_bytes());
        let picture = field("eclipse").join(name);
        let ran = place.run(&["run", picture.to_str().unwrap(), "--sensor", "in/sensor.toml"]).expect(0);
        rows(&ran.out).remove(0)
    };
    let moon = answer("art002e009301.jpg", 1280, true);
    assert_right(&moon, [(783.0 - 959.5) / 7200.0, (646.0 - 639.5) / 7200.0, 1.0]);
    let radius_px = number(&moon, "half_angle_deg").to_radians().tan() * 7200.0;
    assert!((radius_px - 284.0).abs() < 2.0, "{radius_px} px");
    for invert in [true, false] {
        // The lens of this picture is not known; the Moon in it has another size than the expected one.
        let row = answer("art002-ship.jpg", 1440, invert);
        assert_eq!((cell(&row, "status"), cell(&row, "axis_x")), ("rejected", ""), "{row:?}");
    }
}

/// Runs the picture of Jupiter with columns of frames.csv; returns range and sigma, km, or nothing without an answer.
fn range_of_jupiter(place: &Place, columns: &str, cells: &str) -> Option<(f64, f64)> {
    place.write("in/frames.csv", format!("file,{columns}\n{JUPITER},{cells}\n").as_bytes());
    let row = &run(place)[0];
    (cell(row, "status") == "ok").then(|| {
        let centre = ["position_x_km", "position_y_km", "position_z_km"].map(|name| number(row, name));
        let [xx, xy, xz, yy, yz, zz] =
            ["xx", "xy", "xz", "yy", "yz", "zz"].map(|name| number(row, &format!("pos_cov_{name}_km2")));
        let range_km = centre.iter().map(|v| v * v).sum::<f64>().sqrt();
        let [x, y, z] = centre.map(|v| v / range_km);
        let variance = xx * x * x + yy * y * y + zz * z * z + 2.0 * (xy * x * y + xz * x * z + yz * y * z);
        (range_km, variance.sqrt())
    })
}

#[test]
fn a_half_lit_jupiter_has_its_range() {
    const RANGES_KM: [f64; 2] = [134_743.0, 135_015.0];
    const POLE: &str = "pole_x,pole_y,pole_z,attitude_sigma_deg";
    let place = place_of("jupiter-junocam", "");
    let with_sun = format!("{POLE},sun_x,sun_y,sun_z");
    let (found, sigma) =
        range_of_jupiter(&place, &with_sun, "-0.256,-0.489,0.834,1,0.485,-0.809,-0.332").expect("an answer");
    for truth in RANGES_KM {
        println!("range {:+.3} %, {:+.2} sigma", (found / truth - 1.0) * 100.0, (found - truth) / sigma);
        assert!((found / truth - 1.0).abs() < 0.0025 && (found - truth).abs() < 2.0 * sigma, "{found} +- {sigma} km");
    }
    // A pole that is wrong by some degrees, and a missing Sun: sigma covers what they do to the range.
    let rough = "-0.145,-0.542,0.828,1";
    let without = range_of_jupiter(&place, POLE, rough);
    let rough_with_sun = range_of_jupiter(&place, &with_sun, &format!("{rough},0.648,-0.682,-0.340"));
    let near = range_of_jupiter(&place, POLE, "-0.256,-0.489,0.834,1");
    for (found, sigma) in [without, rough_with_sun, near].into_iter().flatten() {
        let off = RANGES_KM.map(|truth| (found - truth).abs() / sigma).into_iter().fold(f64::INFINITY, f64::min);
        assert!(off < 2.0, "{found} +- {sigma} km");
    }
}

#[test]
fn exif_of_a_picture_that_was_made_smaller_gives_no_lens() {
    let place = Place::new();
    let picture = field("exif-resized").join("resized.jpg");
    let init = |more: &[&str]| {
        let args = ["init", picture.to_str().unwrap(), "--altitude", "40", "-o", "small.toml", "--force"];
        place.run(&[&args, more].concat())
    };
    let uncertain = init(&[]).expect(2).err;
    assert!(uncertain.contains("the field of view is not known (no --fov, no usable EXIF)"), "{uncertain}");
    // The kind of the lens would not help, so that it is not asked for.
    assert!(!uncertain.contains("--lens"), "{uncertain}");
    init(&["--lens", "pinhole"]).expect(2).says("too uncertain to start from");
    assert!(!place.path("small.toml").exists());
    // Without an altitude the limb cannot say it either: the pitch itself is named.
    let refused = place.run(&["init", picture.to_str().unwrap(), "-o", "small.toml"]).expect(2);
    refused.says("the picture was probably made smaller or cut after exposure");
    init(&["--fov", "63.4"]).expect(0);
    let ran = place.run(&["run", picture.to_str().unwrap(), "--sensor", "small.toml"]).expect(0);
    assert_right(&rows(&ran.out)[0], [0.40058, 0.89629, 0.19027]);
}

#[test]
fn exif_of_picamera2_has_its_times() {
    let place = Place::new();
    std::fs::copy(field("exif-picamera2").join("frame0.jpg"), place.path("in/frame0.jpg")).unwrap();
    std::fs::copy(field("exif-picamera2").join("frame1.jpg"), place.path("in/frame1.jpg")).unwrap();
    place.run(&["init", "in", "--fov", "62.2", "--altitude", "40", "-o", "in/sensor.toml", "--force"]).expect(0);
    let rows = run(&place);
    // 26 November 2026, 10:00:00 UTC.
    assert_eq!(rows.iter().map(|r| cell(r, "time_s")).collect::<Vec<_>>(), ["1795687200.0", "1795687202.0"]);
}
