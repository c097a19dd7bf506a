//! The page of an empty window: samples, and recent files with their pictures.

use std::time::{Duration, Instant};

use egui::Role;
use egui_kittest::kittest::Queryable;

use crate::window::*;

/// Steps the window until a widget with this label is there.
fn shown(window: &mut Window, label: &str) {
    let begin = Instant::now();
    while window.query_by_label(label).is_none() {
        assert!(begin.elapsed() < Duration::from_secs(60), "{label}");
        std::thread::sleep(Duration::from_millis(5));
        window.step();
    }
}

#[test]
fn a_recent_folder_has_its_first_picture_and_a_click_opens_it() {
    let (dir, pictures) = folder();
    let store = dir.path().join("config").join("viewer.json");
    let mut window = stored_window(&store);
    window.state_mut().settings_mut().add_recent(&dir.path().join("gone"));
    window.state_mut().settings_mut().add_recent(&pictures);
    window.run_steps(2);
    assert!(window.query_by_label("Recent").is_some());
    shown(&mut window, "First picture of pictures");
    assert!(window.query_by_label("No picture of gone").is_some(), "a folder that is gone has an empty frame");
    assert_eq!(files(&dir.path().join("config").join("thumbnails")).len(), 1, "the small picture is kept");
    window.get_by_role_and_label(Role::Button, "First picture of pictures").click();
    settled(&mut window);
    assert_eq!(window.state().sequence().inputs, std::slice::from_ref(&pictures));
    assert_eq!(frame_view(&window).name, "0.png");
}

#[test]
fn the_menu_opens_recent_files() {
    let (_dir, pictures) = folder();
    let (_other_dir, other) = folder();
    let mut window = window_on(&pictures);
    open(&mut window, &other);
    until(&mut window, "not opened", |v| v.sequence().inputs == [other.clone()] && v.is_settled());
    window.get_by_label("File").click();
    window.run_steps(3);
    window.get_by_label_contains("Open recent").click();
    window.run_steps(3);
    window.get_by_label(&pictures.display().to_string()).click();
    until(&mut window, "not opened again", |v| v.sequence().inputs == [pictures.clone()] && v.is_settled());
    let recent = &window.state_mut().settings_mut().recent;
    assert_eq!(recent.as_slice(), [pictures, other], "the last one is first");
}

#[test]
fn samples_have_pictures() {
    let window = sized_window(1024.0, 768.0);
    let mut left = 0.0;
    for name in ["Rocket (demo flight)", "Whole Earth", "Infrared, low orbit"] {
        let sample = window.get_by_role_and_label(Role::Button, &format!("Sample: {name}")).rect();
        assert!(sample.width() > 100.0 && sample.left() > left, "{sample:?}");
        left = sample.right();
    }
}
