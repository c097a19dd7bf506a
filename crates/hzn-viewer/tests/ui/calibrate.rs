//! The calibration on the pictures, from the window.

use std::fmt::Write as _;
use std::path::Path;

use egui_kittest::kittest::Queryable;
use hzn_sim::flight::{Flight, rocket};

use super::window::{Window, menu, path, said, until, window_on};

/// Writes a rendered flight with altitudes.
fn write(flight: &Flight, folder: &Path) {
    let mut table = "file,time_s,x_km,y_km,z_km\n".to_owned();
    for frame in &flight.frames {
        let picture = frame.render().unwrap();
        let path = folder.join(&frame.file);
        std::fs::write(&path, picture.encode(&path).unwrap()).unwrap();
        let [x, y, z] = frame.scene.pose.position_m.map(|m| m / 1e3);
        writeln!(table, "{},{},{x},{y},{z}", frame.file, frame.time_s).unwrap();
    }
    std::fs::write(folder.join("frames.csv"), table).unwrap();
    std::fs::write(folder.join("sensor.toml"), hzn_files::sensor::to_text(&flight.sensor).unwrap()).unwrap();
}

fn calibrated(window: &mut Window, entry: &str) {
    menu(window, "Edit", entry);
    until(window, "the calibration does not end", |v| !v.is_calibrating());
    window.run_steps(3);
}

#[test]
fn limb_height_and_noise_are_one_step() {
    let dir = tempfile::tempdir().unwrap();
    write(&rocket(480, 270, 30, 7707), dir.path());
    let mut window = window_on(dir.path());
    let number = |window: &Window, key: &str| window.state().session().unwrap().number("body", key, 0);
    let before = (number(&window, "limb_height_km"), number(&window, "limb_height_sigma_km"));
    let file = std::fs::read_to_string(dir.path().join("sensor.toml")).unwrap();
    calibrated(&mut window, "Limb height and noise from the flight…");
    assert!(window.query_by_label_contains("limb_height_km = ").is_some(), "the keys are shown before they change");
    assert_eq!(number(&window, "limb_height_km"), before.0, "nothing changes before Apply");
    window.get_by_label("Apply").click();
    said(&mut window, "applied as one step");
    let after = (number(&window, "limb_height_km"), number(&window, "limb_height_sigma_km"));
    assert_ne!(after, before);
    // The file is as it was, and one undo takes everything back.
    assert_eq!(std::fs::read_to_string(dir.path().join("sensor.toml")).unwrap(), file);
    window.state_mut().session_mut().unwrap().undo();
    assert_eq!((number(&window, "limb_height_km"), number(&window, "limb_height_sigma_km")), before);
    assert!(!window.state().session().unwrap().is_changed());
}

#[test]
fn a_flight_that_does_not_determine_the_values_says_why() {
    let dir = tempfile::tempdir().unwrap();
    write(&rocket(320, 180, 4, 7708), dir.path());
    let mut window = window_on(dir.path());
    calibrated(&mut window, "Limb height and noise from the flight…");
    assert!(window.query_by_label_contains("4 pictures: ").is_some());
    assert!(window.query_by_label("Apply").is_none());
}

#[test]
fn the_lens_comes_from_the_flight_as_one_step() {
    let dir = tempfile::tempdir().unwrap();
    let flight = rocket(480, 270, 30, 7709);
    write(&flight, dir.path());
    let right = flight.sensor.camera.fx_px;
    let path = dir.path().join("sensor.toml");
    let mut wrong = flight.sensor.clone();
    (wrong.camera.fx_px, wrong.camera.fy_px) = (1.03 * right, 1.03 * wrong.camera.fy_px);
    wrong.camera.focal_sigma_percent = 3.0;
    std::fs::write(&path, hzn_files::sensor::to_text(&wrong).unwrap()).unwrap();
    let mut window = window_on(dir.path());
    let fx = |window: &Window| window.state().session().unwrap().number("camera", "fx_px", 0).unwrap();
    let before = fx(&window);
    calibrated(&mut window, "Lens from the flight…");
    assert!(window.query_by_label_contains("[camera] fx_px = ").is_some(), "the keys are shown before they change");
    for plot in ["Plot of limb heights", "Plot of the calibration"] {
        assert!(window.query_by_label(plot).is_some(), "{plot}");
    }
    assert_eq!(fx(&window), before, "nothing changes before Apply");
    window.get_by_label("Apply").click();
    said(&mut window, "applied as one step");
    assert!((fx(&window) / right - 1.0).abs() < 0.01, "{} instead of {right}", fx(&window));
    window.state_mut().session_mut().unwrap().undo();
    assert_eq!(fx(&window), before);
    assert!(!window.state().session().unwrap().is_changed());
}

/// Real pictures of a board with 9 × 6 inner corners, of OpenCV: its own calibration has a focal length of 535.9 px.
const BOARDS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/data/boards");

const SENSOR: &str = "# mine
[camera]
width = 640
height = 480
model = \"brown-conrady\"
fx_px = 400.0
fy_px = 400.0
cx_px = 319.5
cy_px = 239.5
k = [0.0, 0.0, 0.0, 0.0, 0.0]

[body]
altitude_km = 240.0
";

/// Opens a picture of the camera, and asks for the calibration from pictures of a board.
fn window_for_boards(folder: &Path, size: [u32; 2]) -> Window {
    image::GrayImage::new(size[0], size[1]).save(folder.join("0.png")).unwrap();
    let sensor = SENSOR.replace("640", &size[0].to_string()).replace("480", &size[1].to_string());
    std::fs::write(folder.join("sensor.toml"), sensor).unwrap();
    let mut window = window_on(folder);
    menu(&mut window, "Edit", "Lens from board pictures…");
    window.run_steps(4);
    window
}

fn choose_boards(window: &mut Window, folder: &Path) {
    window.get_by_label("Choose the board pictures…").click();
    path(window, folder, "Open this");
    until(window, "the calibration does not end", |v| !v.is_calibrating());
    window.run_steps(4);
}

#[test]
fn the_lens_comes_from_pictures_of_a_board() {
    let dir = tempfile::tempdir().unwrap();
    let (pictures, boards) = (dir.path().join("pictures"), dir.path().join("boards"));
    std::fs::create_dir(&pictures).unwrap();
    std::fs::create_dir(&boards).unwrap();
    for name in ["left01.jpg", "left03.jpg", "left05.jpg", "left07.jpg", "left09.jpg", "left12.jpg"] {
        std::fs::copy(Path::new(BOARDS).join(name), boards.join(name)).unwrap();
    }
    std::fs::write(boards.join("broken.jpg"), b"no picture").unwrap();
    let mut window = window_for_boards(&pictures, [640, 480]);
    let before = window.state().session().unwrap().sheet().clone();
    choose_boards(&mut window, &boards);
    assert!(window.query_by_label_contains("6 of 7 used").is_some(), "the report is shown");
    assert!(window.query_by_label_contains("left out: cannot be read").is_some(), "a broken picture is named");
    assert!(window.query_by_label("Plot of the calibration").is_some());
    assert_eq!(window.state().session().unwrap().sheet(), &before, "nothing changes before Apply");
    window.get_by_label("Apply").click();
    said(&mut window, "applied as one step");
    let session = window.state().session().unwrap();
    let camera = &session.config().unwrap().camera;
    assert!((camera.fx_px / 535.9 - 1.0).abs() < 0.03 && (camera.fy_px / 535.9 - 1.0).abs() < 0.03, "{camera:?}");
    assert!(camera.covariance.is_some() && camera.k.iter().any(|k| *k != 0.0));
    assert!(
        session.sheet().text().starts_with("# mine") && session.sheet().text().contains("6 board pictures of boards")
    );
    window.state_mut().session_mut().unwrap().undo();
    assert_eq!(window.state().session().unwrap().sheet(), &before);
}

#[test]
fn board_pictures_that_cannot_be_used_say_why() {
    let dir = tempfile::tempdir().unwrap();
    let boards = dir.path().join("boards");
    std::fs::create_dir(&boards).unwrap();
    let mut window = window_for_boards(dir.path(), [320, 240]);
    image::GrayImage::new(640, 480).save(boards.join("empty.png")).unwrap();
    choose_boards(&mut window, &boards);
    assert!(window.query_by_label_contains("no picture shows the board").is_some());
    std::fs::copy(Path::new(BOARDS).join("left01.jpg"), boards.join("left01.jpg")).unwrap();
    choose_boards(&mut window, &boards);
    let words = "The board pictures have 640 x 480 px, the sensor's camera 320 x 240";
    assert!(window.query_by_label_contains(words).is_some());
    assert!(window.query_by_label("Apply").is_none());
}
