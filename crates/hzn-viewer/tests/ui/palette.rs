//! The palette finds commands and keys by their names.

use egui::{Key, Modifiers, Role};
use egui_kittest::kittest::Queryable;

use crate::window::*;

const FIELD: &str = "Find a command";

fn type_text(window: &mut Window, text: &str) {
    window.get_by_role_and_label(Role::TextInput, FIELD).type_text(text);
    window.run_steps(3);
}

#[test]
fn a_command_is_found_by_a_part_of_its_name_and_runs() {
    let (_dir, mut window) = window_on_flight();
    let is_dark = window.state_mut().settings_mut().dark;
    window.key_press_modifiers(Modifiers::COMMAND, Key::P);
    window.run_steps(4);
    type_text(&mut window, "light theme");
    window.key_press(Key::Enter);
    window.run_steps(3);
    assert_ne!(window.state_mut().settings_mut().dark, is_dark);
    assert!(window.query_by_label(FIELD).is_none(), "the palette is closed");
    // The arrow marks the next entry, and letters in the field are no commands of their own.
    window.key_press_modifiers(Modifiers::COMMAND, Key::P);
    window.run_steps(4);
    type_text(&mut window, "ten pictures");
    window.key_press(Key::ArrowDown);
    window.key_press(Key::ArrowUp);
    window.key_press(Key::Escape);
    window.run_steps(3);
    assert!(window.query_by_label(FIELD).is_none());
    assert_eq!(frame_view(&window).index, 0);
}

#[test]
fn a_key_of_the_sensor_is_shown_among_the_stages() {
    let (_dir, mut window) = window_on_flight();
    window.key_press_modifiers(Modifiers::COMMAND, Key::P);
    window.run_steps(4);
    type_text(&mut window, "gates.min_arc");
    window.get_by_label("gates.min_arc_px").click();
    window.run_steps(8);
    assert!(window.query_by_label(FIELD).is_none());
    assert!(window.query_all_by_label_contains("min_arc_px").next().is_some());
}
