//! Tests of what is typed: decimal commas in every kind of field, and the keys of the menus.

use egui::{Key, Modifiers, Role};
use egui_kittest::kittest::{NodeT, Queryable};

use crate::window::*;

fn shows(window: &Window, words: &str) -> bool {
    window.query_all_by_label_contains(words).next().is_some()
}

/// Returns the number that a field has.
fn number(window: &Window, field: &str) -> f64 {
    window.get_by_role_and_label(Role::SpinButton, field).accesskit_node().numeric_value().unwrap()
}

/// Checks that a field reads a decimal comma, and keeps its number if a text has two meanings.
fn assert_reads_a_comma(window: &mut Window, field: &str, text: &str, value: f64) {
    type_number(window, field, text);
    assert_eq!(number(window, field), value, "{field}");
    type_number(window, field, "1.234,5");
    assert_eq!(number(window, field), value, "{field}");
    said(window, "“1.234,5” is no number, so the value stays as it was.");
    window.get_by_label("Close").click();
    window.run_steps(3);
}

#[test]
fn the_entries_of_an_array_read_a_decimal_comma() {
    let dir = tempfile::tempdir().unwrap();
    flight(dir.path());
    std::fs::write(dir.path().join("sensor.toml"), SENSOR.replace("pinhole", "kannala-brandt")).unwrap();
    let mut window = window_on(dir.path());
    window.get_by_label("Rays").click_accesskit();
    // The card opens slowly.
    window.run_steps(30);
    window.get_by_label("Add").click_accesskit();
    settled(&mut window);
    assert_reads_a_comma(&mut window, "k 1", "-0,02", -0.02);
    let config = window.state().session().unwrap().config().unwrap().clone();
    assert_eq!(config.camera.k.as_slice(), [-0.02]);
}

#[test]
fn the_ends_of_a_sweep_read_a_decimal_comma() {
    let (_dir, mut window) = window_on_flight();
    window.get_by_role_and_label(Role::Label, "scale").click_secondary();
    window.run_steps(4);
    window.get_by_label("Sweep threshold.scale over the sequence…").click();
    window.run_steps(4);
    assert_reads_a_comma(&mut window, "from", "0,75", 0.75);
    assert_reads_a_comma(&mut window, "to", "1,5", 1.5);
}

#[test]
fn the_form_of_a_board_reads_a_decimal_comma() {
    let (_dir, mut window) = window_on_flight();
    menu(&mut window, "Edit", "Lens from board pictures…");
    window.run_steps(4);
    assert_reads_a_comma(&mut window, "side of a square", "24,5", 24.5);
    assert_reads_a_comma(&mut window, "inner corners along a row", "7,0", 7.0);
}

#[test]
fn each_menu_has_a_key_that_opens_and_closes_it() {
    let (_dir, mut window) = window_on_flight();
    let menus = [
        (Key::F, "Reload the pictures"),
        (Key::E, "Lens from board pictures…"),
        (Key::P, "View from space"),
        (Key::C, "with another sensor.toml…"),
        (Key::X, "Save results as CSV…"),
    ];
    for (key, entry) in menus {
        assert!(!shows(&window, entry), "{entry} is shown before its menu opens");
        window.key_press_modifiers(Modifiers::ALT, key);
        window.run_steps(4);
        for (_, other) in menus {
            assert_eq!(shows(&window, other), other == entry, "Alt+{}: {other}", key.name());
        }
        window.key_press_modifiers(Modifiers::ALT, key);
        window.run_steps(4);
        assert!(!shows(&window, entry), "Alt+{} closes the menu", key.name());
    }
    // Each letter alone has another meaning, and none of them was taken as a command.
    assert_eq!(frame_view(&window).index, 0);
    assert!(window.state().frame_view().is_some_and(|v| v.answers.len() == 1), "no comparison has begun");
}
