//! `hzn calibrate board` and `hzn calibrate points`, from beginning to end through the binary.

use std::path::Path;

use crate::common::{Place, assert_provenance};
use crate::dark::assert_drawings_are_readable;

/// Real pictures of a board with 9 × 6 inner corners.
const BOARDS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/data/boards");

/// Runs hzn in the folder. Returns exit code, stdout, stderr.
fn run(place: &Place, args: &[&str]) -> (i32, String, String) {
    let out = place.command(args).output().expect("hzn starts");
    let text = |b: &[u8]| String::from_utf8_lossy(b).into_owned();
    (out.status.code().unwrap_or(-1), text(&out.stdout), text(&out.stderr))
}

/// Copies pictures of the board.
fn copy_boards(place: &Place, names: &[&str]) {
    std::fs::create_dir(place.path("boards")).unwrap();
    for name in names {
        place.write(&format!("boards/{name}"), &std::fs::read(Path::new(BOARDS).join(name)).unwrap());
    }
}

/// Returns a value of the report: the first number after its name.
fn reported(report: &str, name: &str) -> f64 {
    let line = report.lines().find(|l| l.split_whitespace().next() == Some(name)).unwrap_or_else(|| panic!("{report}"));
    line.split_whitespace().nth(1).unwrap().parse().unwrap()
}

/// Tests the pictures that OpenCV ships. With equal focal lengths, OpenCV's own file has fx = fy = 535.9 px, centre
/// (342.3, 235.6) and a mean error of 0.39 px.
#[test]
fn real_boards_give_a_camera() {
    let place = Place::new();
    let board = ["--board", "9x6", "--square-mm", "25", "--model", "brown-conrady"];
    let out = ["-o", "camera.toml", "-o", "report.html", "-o", "residuals.csv"];
    let (code, report, stderr) = run(&place, &[&["calibrate", "board", BOARDS][..], &board, &out].concat());
    assert_eq!(code, 0, "{stderr}");
    assert!(report.contains("pictures         13 of 13 used"), "{report}");
    assert!((reported(&report, "fx_px") / 535.9 - 1.0).abs() < 0.03, "{report}");
    assert!((reported(&report, "cx_px") - 342.3).abs() < 2.0 && (reported(&report, "cy_px") - 235.6).abs() < 3.0);
    assert!(reported(&report, "RMS") < 0.25, "{report}");
    assert!(stderr.contains("the picture's corner lies at"), "{stderr}");
    let camera = place.read("camera.toml");
    assert!(camera.contains("[camera.covariance]"), "{camera}");
    // The file is a [camera] for the other commands.
    let (code, shown, stderr) = run(&place, &["camera", "show", "camera.toml"]);
    assert!(code == 0 && shown.contains("brown-conrady"), "{shown} {stderr}");
    let page = place.read("report.html");
    // The pictures of a board belong to no sensor yet.
    assert_provenance(&page, false, "hzn calibrate board");
    assert!(page.contains("<svg") && page.contains("left14.jpg") && page.contains("1 sigma of the radial curve"));
    assert!(assert_drawings_are_readable(&page) > 13 * 54, "an arrow for each corner");
    let table = hzn_calib::residual_table::read(&place.path("residuals.csv")).unwrap();
    let counts: Vec<_> = table.iter().filter(|(_, r)| r.counts).collect();
    let rms = (counts.iter().map(|(_, r)| r.error_px[0].powi(2) + r.error_px[1].powi(2)).sum::<f64>()
        / counts.len() as f64)
        .sqrt();
    assert!((rms - reported(&report, "RMS")).abs() < 6e-4 && table.len() == 13 * 54, "{rms} {}", table.len());
    assert!(table.iter().any(|(file, _)| file == "left14.jpg"));
    let mut corners: Vec<_> = table.iter().filter(|(f, _)| f == "left14.jpg").map(|(_, r)| r.corner.unwrap()).collect();
    corners.sort_unstable();
    let all: Vec<[u16; 2]> = (0..9).flat_map(|column| (0..6).map(move |row| [column, row])).collect();
    assert_eq!(corners, all, "every corner is named by its column and row");
    let (code, _, stderr) = run(&place, &[&["calibrate", "board", BOARDS][..], &board, &out].concat());
    assert!(code == 2 && stderr.contains("exists already; --force replaces it"), "{stderr}");
}

#[test]
fn wrong_boards_and_pictures_are_named() {
    let place = Place::new();
    copy_boards(&place, &["left01.jpg", "left02.jpg", "left03.jpg", "left04.jpg"]);
    let calibrate =
        |more: &[&str]| run(&place, &[&["calibrate", "board", "boards", "-o", "camera.toml"][..], more].concat());
    for wrong in ["8x5", "7x7", "10x7"] {
        let (code, _, stderr) = calibrate(&["--board", wrong]);
        let none = format!("inner corners, none shows {}; give --board 9x6", wrong.replace('x', " x "));
        assert!(code == 2 && stderr.contains("pictures show a board with 9 x 6") && stderr.contains(&none), "{stderr}");
    }
    let (code, _, stderr) = calibrate(&["--board", "9"]);
    assert!(code == 2 && stderr.contains("for example 9x6"), "{stderr}");
    let (code, _, stderr) = calibrate(&["--board", "9x6", "--model", "fisheye"]);
    assert!(code == 2 && stderr.contains("the models are kannala-brandt"), "{stderr}");
    // A model that cannot follow the lens bends it in all pictures alike, which no sigma contains.
    let (code, _, stderr) = calibrate(&["--board", "9x6", "--model", "pinhole"]);
    let other =
        "this lens is not of the model pinhole: it leaves an RMS of 1.170 px, and brown-conrady leaves 0.133 px";
    assert!(code == 1 && stderr.contains(other) && !place.path("camera.toml").exists(), "{code} {stderr}");
    // A picture that cannot be read is named; the others are calibrated.
    place.write("boards/broken.jpg", b"no picture");
    let (code, report, stderr) = calibrate(&["--board", "9x6", "--model", "brown-conrady", "--force"]);
    assert!(code == 3 && stderr.contains("broken.jpg: cannot be read"), "{code} {stderr}");
    assert!(report.contains("4 of 5 used"), "{report}");
    assert!(report.contains("broken.jpg               left out: cannot be read"), "{report}");
    std::fs::remove_file(place.path("boards/broken.jpg")).unwrap();
    // A picture of another size shows another lens; it is named, and the others are calibrated.
    image::GrayImage::new(641, 481).save(place.path("boards/small.png")).unwrap();
    let (code, report, stderr) = calibrate(&["--board", "9x6", "--model", "brown-conrady", "--force"]);
    let other = "small.png: it has 641x481 px, but most pictures have 640x480 px";
    assert!(code == 0 && stderr.contains(other) && report.contains("4 of 5 used"), "{code} {stderr} {report}");
    std::fs::remove_file(place.path("boards/small.png")).unwrap();
    // A copy of a picture says nothing new.
    std::fs::copy(place.path("boards/left01.jpg"), place.path("boards/left01b.jpg")).unwrap();
    let (code, report, stderr) = calibrate(&["--board", "9x6", "--model", "brown-conrady", "--force"]);
    let copy = "left01b.jpg: it has the corners of left01.jpg to the last bit: it is a copy";
    assert!(code == 0 && stderr.contains(copy) && report.contains("4 of 5 used"), "{code} {stderr} {report}");
    std::fs::remove_file(place.path("camera.toml")).unwrap();
    std::fs::remove_file(place.path("boards/left01b.jpg")).unwrap();
    image::GrayImage::new(640, 480).save(place.path("boards/empty.png")).unwrap();
    for name in ["left02.jpg", "left03.jpg"] {
        std::fs::remove_file(place.path(&format!("boards/{name}"))).unwrap();
    }
    let (code, _, stderr) = calibrate(&["--board", "9x6"]);
    assert!(code == 1 && stderr.contains("empty.png: no chessboard is visible"), "{stderr}");
    assert!(stderr.contains("2 of 3 pictures can be used, but a calibration needs at least 3"), "{stderr}");
    assert!(!place.path("camera.toml").exists(), "nothing is half-written");
}

/// Tests pictures of an independent renderer: one board is cut by the border, one is covered in part.
#[test]
fn rendered_boards_give_the_true_camera() {
    let place = Place::new();
    let boards = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/data/boards-rendered/fisheye94");
    let command = ["calibrate", "board", boards, "--board", "9x6", "--square-mm", "30", "-o", "camera.toml", "-q"];
    let (code, report, stderr) = run(&place, &command);
    assert_eq!(code, 0, "{stderr}");
    assert!(report.contains("pictures         6 of 6 used"), "{report}");
    let truth: serde_json::Value =
        serde_json::from_slice(&std::fs::read(Path::new(boards).join("truth.json")).unwrap()).unwrap();
    let camera: toml::Table = place.read("camera.toml").parse().unwrap();
    let camera = camera["camera"].as_table().unwrap();
    let rows = camera["covariance"]["rows"].as_array().unwrap();
    for (n, (key, true_key)) in [("fx_px", "fx"), ("fy_px", "fy"), ("cx_px", "cx"), ("cy_px", "cy")].iter().enumerate()
    {
        let error = camera[*key].as_float().unwrap() - truth["camera"][true_key].as_f64().unwrap();
        let sigma = rows[n][n].as_float().unwrap().sqrt();
        assert!(error.abs() < 3.5 * sigma, "{key}: {error} ± {sigma}");
    }
    assert!(reported(&report, "RMS") < 0.03, "{report}");
}

#[test]
fn a_table_of_points_gives_a_camera() {
    let place = Place::new();
    // An equidistant lens with 92 px/rad; the camera hangs on the rotator with a roll of 0.5 rad.
    let (mut table, mut mirrored) = ("u_px,v_px,azimuth_deg,elevation_deg\n".to_owned(), String::new());
    mirrored.push_str(&table);
    for (i, j) in (-8..=8).flat_map(|i| (-6..=6).map(move |j| (i, j))) {
        let (azimuth, elevation) = (f64::from(i) * 10.0f64, f64::from(j) * 10.0f64);
        let ((sa, ca), (se, ce)) = (azimuth.to_radians().sin_cos(), elevation.to_radians().sin_cos());
        let (x, y, z) = (ce * sa, -se, ce * ca);
        let (sin, cos) = 0.5f64.sin_cos();
        let (x, y) = (cos * x - sin * y, sin * x + cos * y);
        let (h, theta) = (x.hypot(y), x.hypot(y).atan2(z));
        let scale = if h > 0.0 { 92.0 * theta / h } else { 92.0 };
        let (u, v) = (190.0 + scale * x, 145.0 + scale * y);
        if (0.0..383.0).contains(&u) && (0.0..287.0).contains(&v) {
            // A small error that is not random, but different for each point.
            let error = 0.02 * f64::from((7 * i + 11 * j) % 5 - 2) / 2.0;
            table.push_str(&format!("{},{v},{azimuth},{elevation}\n", u + error));
            mirrored.push_str(&format!("{},{v},{},{elevation}\n", u + error, -azimuth));
        }
    }
    place.write("points.csv", table.as_bytes());
    place.write("mirrored.csv", mirrored.as_bytes());
    let calibrate = |file: &str, more: &[&str]| {
        run(&place, &[&["calibrate", "points", file, "-o", "camera.toml"][..], more].concat())
    };
    let (code, _, stderr) = calibrate("mirrored.csv", &["--size", "384x288"]);
    assert!(code == 1 && stderr.contains("the azimuth counts to the other side"), "{stderr}");
    assert!(!place.path("camera.toml").exists());
    let (code, _, stderr) = calibrate("points.csv", &["--size", "200x150"]);
    assert!(
        code == 2 && stderr.contains("points.csv:") && stderr.contains("outside a picture of 200 x 150 px"),
        "{stderr}"
    );
    let (code, _, stderr) = calibrate("points.csv", &["--size", "384"]);
    assert!(code == 2 && stderr.contains("for example 384x288"), "{stderr}");
    let (code, report, stderr) = calibrate("points.csv", &["--size", "384x288", "--model", "equidistant"]);
    assert_eq!(code, 0, "{stderr}");
    assert!(
        (reported(&report, "fx_px") - 92.0).abs() < 0.03 && (reported(&report, "cy_px") - 145.0).abs() < 0.03,
        "{report}"
    );
}
