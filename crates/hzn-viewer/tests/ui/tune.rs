//! Tests of viewing, stepping, tuning, saving and comparing.

use egui::{Key, Role};
use egui_kittest::kittest::Queryable;
use hzn_core::status::Status;
use hzn_viewer::ui::Command;

use crate::window::*;

#[test]
fn open_step_tune_save_and_open_again() {
    let (dir, mut window) = window_on_flight();
    assert_eq!(window.state().sequence().len(), 4);
    assert_eq!(answer(&window).0, Status::Ok);

    window.get_by_label("Next picture").click();
    settled(&mut window);
    let first = answer(&window);
    assert_eq!((frame_view(&window).index, first.0), (1, Status::Ok));

    // The threshold changes, and the answer follows.
    window.get_by_role_and_label(Role::Slider, "scale").set_value_accesskit(1.5);
    settled(&mut window);
    let tuned = answer(&window);
    assert!(tuned.1 > first.1, "{:?} {:?}", tuned.1, first.1);
    assert_ne!(tuned.2, first.2);
    assert!(window.state().session().unwrap().is_changed());

    // Undo and redo.
    window.get_by_label("Undo").click();
    settled(&mut window);
    assert_eq!(answer(&window), first);
    window.get_by_label("Redo").click();
    settled(&mut window);
    assert_eq!(answer(&window), tuned);

    // After saving, one value differs and everything else is unchanged.
    window.get_by_label("Save").click();
    window.run_steps(3);
    let text = std::fs::read_to_string(dir.path().join("sensor.toml")).unwrap();
    assert_eq!(text, SENSOR.replace("scale = 1.0 ", "scale = 1.5 "));

    // In another window, the answer of the saved file is the same to the last bit.
    let mut again = window_on(dir.path());
    again.get_by_label("Next picture").click();
    settled(&mut again);
    assert_eq!(answer(&again), tuned);
}

#[test]
fn keys_step_and_find_what_has_no_answer() {
    let (_dir, mut window) = window_on_flight();
    window.key_press(Key::ArrowRight);
    settled(&mut window);
    assert_eq!(frame_view(&window).index, 1);
    until(&mut window, "not processed", |v| v.processed() == 4);
    window.key_press(Key::N);
    settled(&mut window);
    assert_eq!(frame_view(&window).index, 3);
    assert_eq!(answer(&window).0, Status::NoLimb);
    assert!(window.query_by_label("no-limb").is_some());
    window.key_press(Key::Home);
    settled(&mut window);
    assert_eq!(frame_view(&window).index, 0);
    window.key_press(Key::F1);
    window.run_steps(4);
    assert!(window.query_by_label("Keys and mouse").is_some());
}

#[test]
fn playing_shows_every_frame_once() {
    let (_dir, pictures) = folder();
    lengthen(&pictures, 60);
    let mut window = window_on(&pictures);
    for _ in 0..8 {
        window.key_press(Key::Period);
    }
    window.run_steps(2);
    // A key would be two frames of the window: one for the press and one for the release.
    let ctx = window.ctx.clone();
    window.state_mut().run(Command::Play, &ctx);
    let mut shown = vec![frame_view(&window).index];
    let begin = std::time::Instant::now();
    while shown.last() != Some(&59) {
        assert!(begin.elapsed().as_secs() < 60, "{shown:?}");
        window.step();
        shown.extend(Some(frame_view(&window).index).filter(|i| shown.last() != Some(i)));
    }
    assert!(shown.iter().copied().eq(0..60), "{shown:?}");
}

#[test]
fn two_presets_stand_side_by_side() {
    let (_dir, mut window) = window_on_flight();
    window.get_by_label("Compare").click();
    window.run_steps(3);
    window.get_by_label("with preset dlr-2022").click();
    window.run_steps(2);
    until(&mut window, "not compared", |v| v.frame_view().is_some_and(|s| s.answers.len() == 2));
    let [a, b] = [0, 1].map(|i| frame_view(&window).answers[i].clone());
    assert_ne!(a.config, b.config);
    assert_eq!(a.config.camera, b.config.camera);
    assert!(window.query_by_label("Compared with preset dlr-2022").is_some());
}

#[test]
fn two_sensor_files_stand_side_by_side_with_the_difference() {
    let (dir, mut window) = window_on_flight();
    let other = another_sensor(dir.path());
    menu(&mut window, "Compare", "with another sensor.toml…");
    path(&mut window, &other, "Open this");
    until(&mut window, "not compared", |v| v.frame_view().is_some_and(|s| s.answers.len() == 2));
    window.run_steps(3);
    assert!(window.query_by_label("Compared with other.toml").is_some());
    let [a, b] = [0, 1].map(|i| frame_view(&window).answers[i].bodies[0].row.clone());
    assert_eq!([a.status, b.status], [Status::Ok; 2]);
    let apart = hzn_viewer::model::quantity::angle_deg(a.axis().unwrap(), b.axis().unwrap());
    assert!(apart > 0.0);
    assert!(window.query_by_label(&format!("{apart:.4}° apart")).is_some());
    let level = f64::from(b.level.unwrap()) - f64::from(a.level.unwrap());
    assert!(level > 0.0 && window.query_by_label(&format!("{level:+.0} counts")).is_some());
    // The session can be tuned further; the other sensor stays.
    window.get_by_role_and_label(Role::Slider, "scale").set_value_accesskit(1.6);
    until(&mut window, "not equal", |v| {
        v.frame_view().is_some_and(|s| {
            s.answers.len() == 2 && s.answers[0].bodies[0].row.axis() == s.answers[1].bodies[0].row.axis()
        })
    });
    // An invalid file is reported, and the comparison stays.
    std::fs::write(&other, "preset = 3").unwrap();
    menu(&mut window, "Compare", "with another sensor.toml…");
    path(&mut window, &other, "Open this");
    said(&mut window, "other.toml");
    assert_eq!(frame_view(&window).answers.len(), 2);
    menu(&mut window, "Compare", "Stop comparing");
    until(&mut window, "still compared", |v| v.frame_view().is_some_and(|s| s.answers.len() == 1));
}

#[test]
fn a_refused_value_is_said_in_place() {
    let (_dir, mut window) = window_on_flight();
    let before = answer(&window);
    window.get_by_role_and_label(Role::Slider, "scale").set_value_accesskit(-3.0);
    settled(&mut window);
    // Wherever the slider is set, the value of the sensor stays within its limits.
    let config = window.state().session().unwrap().config().unwrap().clone();
    assert!((0.1..=10.0).contains(&config.threshold.scale));
    assert_eq!(before.0, Status::Ok);
}

#[test]
fn the_lens_is_edited_with_linked_focal_lengths() {
    let dir = tempfile::tempdir().unwrap();
    flight(dir.path());
    std::fs::write(dir.path().join("sensor.toml"), SENSOR.replace("pinhole", "kannala-brandt")).unwrap();
    let mut window = window_on(dir.path());
    let text = |w: &Window| w.state().session().unwrap().sheet().text().to_owned();
    let k = |w: &Window| w.state().session().unwrap().config().unwrap().camera.k.clone();
    window.get_by_label("Rays").click_accesskit();
    // The card opens slowly.
    window.run_steps(30);
    window.get_by_role_and_label(Role::SpinButton, "fx_px").set_value_accesskit(250.0);
    settled(&mut window);
    assert!(text(&window).contains("fx_px = 250.0\nfy_px = 250.0"), "{}", text(&window));
    window.get_by_label("Add").click_accesskit();
    settled(&mut window);
    window.get_by_role_and_label(Role::SpinButton, "k 1").set_value_accesskit(-0.02);
    settled(&mut window);
    assert_eq!(k(&window).as_slice(), [-0.02]);
    window.get_by_label("Remove").click_accesskit();
    settled(&mut window);
    assert!(k(&window).is_empty());
}

#[test]
fn the_terms_of_the_covariance_are_listed() {
    let (_dir, window) = window_on_flight();
    assert!(window.query_by_label_contains("° from edge noise").is_some());
}
