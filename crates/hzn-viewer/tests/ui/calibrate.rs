//! The calibration on the pictures, from the window.

use std::fmt::Write as _;
use std::path::Path;

use egui_kittest::kittest::Queryable;
use hzn_sim::flight::{Flight, rocket};

use super::window::{Window, menu, said, until, window_on};

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
