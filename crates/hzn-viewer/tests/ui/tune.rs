//! Looking, stepping, tuning, saving, comparing.

use egui::{Key, Modifiers, Role};
use egui_kittest::kittest::Queryable;
use hzn_core::status::Status;
use hzn_viewer::ui::Viewer;

use crate::window::*;

#[test]
fn open_step_tune_save_and_open_again() {
    let dir = tempfile::tempdir().unwrap();
    flight(dir.path());
    let mut window = window();
    open(&mut window, dir.path());
    settled(&mut window);
    assert_eq!(window.state().sequence().len(), 4);
    assert_eq!(answer(&window).0, Status::Ok);

    window.get_by_label("Next frame").click();
    settled(&mut window);
    let first = answer(&window);
    assert_eq!((sight(&window).index, first.0), (1, Status::Ok));

    // The level is turned, and the answer follows.
    window.get_by_role_and_label(Role::Slider, "scale").set_value_accesskit(1.5);
    settled(&mut window);
    let tuned = answer(&window);
    assert!(tuned.1 > first.1, "{:?} {:?}", tuned.1, first.1);
    assert_ne!(tuned.2, first.2);
    assert!(window.state().session().unwrap().is_changed());

    // Back and forth.
    window.get_by_label("Undo").click();
    settled(&mut window);
    assert_eq!(answer(&window), first);
    window.get_by_label("Redo").click();
    settled(&mut window);
    assert_eq!(answer(&window), tuned);

    // Saved: one value is another, everything else is as it was.
    window.get_by_label("Save").click();
    window.run_steps(3);
    let text = std::fs::read_to_string(dir.path().join("sensor.toml")).unwrap();
    assert_eq!(text, SENSOR.replace("scale = 1.0 ", "scale = 1.5 "));

    // Opened again by another window, the frame is the same to the last bit.
    let mut again = self::window();
    open(&mut again, dir.path());
    settled(&mut again);
    again.get_by_label("Next frame").click();
    settled(&mut again);
    assert_eq!(answer(&again), tuned);
}

#[test]
fn keys_step_and_find_what_has_no_answer() {
    let dir = tempfile::tempdir().unwrap();
    flight(dir.path());
    let mut window = window();
    open(&mut window, dir.path());
    settled(&mut window);
    window.key_press(Key::ArrowRight);
    settled(&mut window);
    assert_eq!(sight(&window).index, 1);
    window.get_by_label("Process all").click();
    window.run_steps(2);
    until(&mut window, "not processed", |v| v.processed() == 4);
    window.key_press(Key::N);
    settled(&mut window);
    assert_eq!(sight(&window).index, 3);
    assert_eq!(answer(&window).0, Status::NoLimb);
    assert!(window.query_by_label("no-limb").is_some());
    window.key_press(Key::Home);
    settled(&mut window);
    assert_eq!(sight(&window).index, 0);
    window.key_press(Key::F1);
    window.run_steps(4);
    assert!(window.query_by_label("Keys and mouse").is_some());
}

#[test]
fn two_presets_stand_side_by_side() {
    let dir = tempfile::tempdir().unwrap();
    flight(dir.path());
    let mut window = window();
    open(&mut window, dir.path());
    settled(&mut window);
    window.get_by_label("Compare").click();
    window.run_steps(3);
    window.get_by_label("with preset dlr-2022").click();
    window.run_steps(2);
    until(&mut window, "not compared", |v| v.sight().is_some_and(|s| s.answers.len() == 2));
    let [a, b] = [0, 1].map(|i| sight(&window).answers[i].clone());
    assert_ne!(a.config, b.config);
    assert_eq!(a.config.camera, b.config.camera);
    assert!(window.query_by_label("Compared with dlr-2022").is_some());
}

#[test]
fn a_refused_value_is_said_in_place() {
    let dir = tempfile::tempdir().unwrap();
    flight(dir.path());
    let mut window = window();
    open(&mut window, dir.path());
    settled(&mut window);
    let before = answer(&window);
    window.get_by_role_and_label(Role::Slider, "scale").set_value_accesskit(-3.0);
    settled(&mut window);
    // Whatever the slider makes of it, the sensor never has a value beyond its limits.
    let config = window.state().session().unwrap().config().unwrap().clone();
    assert!((0.1..=10.0).contains(&config.binarize.scale));
    assert_eq!(before.0, Status::Ok);
}
