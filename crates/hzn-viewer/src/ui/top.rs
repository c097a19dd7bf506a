//! The bar at the top: menus and the title of the sequence.

use egui::Ui;
use hzn_core::Preset;

use super::Command;
use super::panels::Panel;
use super::path_dialog::{PathDialog, Purpose};
use super::viewer::Viewer;
use crate::model::autosave::absolute;
use crate::work::board;
use crate::work::calibration::Kind;

pub(super) fn show(viewer: &mut Viewer, ui: &mut Ui) {
    egui::Panel::top("top").show(ui, |ui| {
        ui.add_space(3.0);
        ui.horizontal(|ui| {
            menus(viewer, ui);
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                toggles(viewer, ui);
                title(viewer, ui);
            });
        });
        ui.add_space(2.0);
    });
}

/// Draws the switches at the right.
fn toggles(viewer: &mut Viewer, ui: &mut Ui) {
    let shows = |panel| viewer.panels.shows(panel, &viewer.settings);
    let is_live = viewer.live.is_some() || viewer.rig.is_some();
    let theme = if viewer.settings.dark { "Light" } else { "Dark" };
    let all = [
        (Command::Help, "Help", viewer.showing_help),
        (Command::Theme, theme, false),
        (Command::Stages, "Stages", shows(Panel::Stages)),
        (Command::Plots, "Plots", shows(Panel::Plots)),
        (Command::Answer, "Answer", shows(Panel::Answer)),
    ];
    // The window on a flight computer has no such panels.
    let is_panel = |c: Command| matches!(c, Command::Stages | Command::Plots | Command::Answer);
    for (command, text, on) in all.into_iter().filter(|(c, ..)| !(is_live && is_panel(*c))) {
        let hint = format!("{} ({})", command.name(), command.key(ui.ctx()));
        if ui.selectable_label(on, text).on_hover_text(hint).clicked() {
            viewer.run(command, &ui.ctx().clone());
        }
    }
}

/// Draws the title of the sequence and the name of its sensor.toml, in the room that is left.
fn title(viewer: &Viewer, ui: &mut Ui) {
    ui.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| {
        ui.separator();
        let mut text = egui::text::LayoutJob::default();
        let font = egui::TextStyle::Body.resolve(ui.style());
        let mut add = |words: &str, colour| {
            text.append(words, 0.0, egui::TextFormat::simple(font.clone(), colour));
        };
        let rig = viewer.rig.as_ref().map(|rig| rig.path.display().to_string());
        let title = viewer.live.as_ref().map_or(viewer.sequence.title.as_str(), |_| "flight computer");
        add(rig.as_deref().unwrap_or(title), ui.visuals().strong_text_color());
        if let Some(session) = &viewer.session {
            let name = session.path().and_then(|p| p.file_name()).map(|n| n.to_string_lossy().into_owned());
            let of_recording = viewer.sequence.recording.is_some();
            let without_file = if of_recording { "sensor of the recording" } else { "new sensor.toml" };
            let name = name.unwrap_or_else(|| without_file.into());
            let changed = if session.is_changed() { "unsaved: " } else { "" };
            add(&format!("   {changed}{name}"), ui.visuals().weak_text_color());
        }
        let label = egui::Label::new(text).truncate().show_tooltip_when_elided(false);
        ui.add(label).on_hover_text(full_paths(viewer));
    });
}

/// Returns the full paths of what is open, because several flights have files of the same name.
fn full_paths(viewer: &Viewer) -> String {
    let inputs = viewer.sequence.inputs.as_slice();
    let first = inputs.first().map(|p| format!("Pictures: {}", absolute(p).display()));
    let more = (inputs.len() > 1).then(|| format!("and {} more", inputs.len() - 1));
    let sensor = viewer.session.as_ref().map(|session| {
        let home = absolute(session.home());
        let what = if session.path().is_some() { "Sensor" } else { "The sensor has no file yet. Proposed path" };
        format!("{what}: {}", home.display())
    });
    [first, more, sensor].into_iter().flatten().collect::<Vec<_>>().join("\n")
}

fn menu_entry(viewer: &mut Viewer, ui: &mut Ui, command: Command, on: bool) {
    let button = egui::Button::new(command.name()).shortcut_text(command.key(ui.ctx()));
    if ui.add_enabled(on, button).clicked() {
        viewer.run(command, &ui.ctx().clone());
        ui.close();
    }
}

/// Shows the entries of a menu.
type Menu = fn(&mut Viewer, &mut Ui);

fn menus(viewer: &mut Viewer, ui: &mut Ui) {
    let all: [(&str, egui::Key, Menu); 5] = [
        ("File", egui::Key::F, file_menu),
        ("Edit", egui::Key::E, edit_menu),
        ("Pictures", egui::Key::P, frames_menu),
        ("Compare", egui::Key::C, compare_menu),
        ("Export", egui::Key::X, export_menu),
    ];
    for (name, key, contents) in all {
        let button = ui.menu_button(name, |ui| contents(viewer, ui)).response;
        let hint = format!("Alt+{}", key.name());
        let button = button.on_hover_text(hint);
        if ui.input_mut(|i| i.consume_key(egui::Modifiers::ALT, key)) {
            egui::Popup::toggle_id(ui.ctx(), egui::Popup::default_response_id(&button));
        }
    }
}

fn file_menu(viewer: &mut Viewer, ui: &mut Ui) {
    let has_sensor = viewer.session.is_some();
    menu_entry(viewer, ui, Command::Open, true);
    menu_entry(viewer, ui, Command::OpenFolder, true);
    menu_entry(viewer, ui, Command::OpenPath, true);
    let recent = viewer.settings.recent.clone();
    if !recent.is_empty() {
        ui.menu_button("Open recent", |ui| {
            for path in recent {
                if ui.button(path.display().to_string()).clicked() {
                    viewer.open_paths(vec![path]);
                    ui.close();
                }
            }
        });
    }
    let is_open = !viewer.sequence.title.is_empty();
    menu_entry(viewer, ui, Command::Reload, is_open);
    menu_entry(viewer, ui, Command::Follow, is_open);
    ui.separator();
    menu_entry(viewer, ui, Command::Save, has_sensor);
    menu_entry(viewer, ui, Command::SaveAs, has_sensor);
}

fn edit_menu(viewer: &mut Viewer, ui: &mut Ui) {
    let (undo, redo) = (viewer.can_undo(), viewer.can_redo());
    let changed = viewer.session.as_ref().is_some_and(|s| s.is_changed());
    menu_entry(viewer, ui, Command::Undo, undo);
    menu_entry(viewer, ui, Command::Redo, redo);
    menu_entry(viewer, ui, Command::Reset, changed);
    let differs = viewer.session.as_ref().is_some_and(|s| s.sheet() != s.on_file());
    menu_entry(viewer, ui, Command::Diff, differs);
    ui.separator();
    let can_calibrate = viewer.session.is_some() && !viewer.sequence.is_empty() && viewer.calibration.is_none();
    for kind in [Kind::Noise, Kind::Lens] {
        let button = egui::Button::new(format!("{}…", kind.name()));
        if ui.add_enabled(can_calibrate, button).clicked() {
            viewer.calibrate(kind);
            ui.close();
        }
    }
    if ui.add_enabled(can_calibrate, egui::Button::new(format!("{}…", board::NAME))).clicked() {
        viewer.ask_board();
        ui.close();
    }
    ui.separator();
    menu_entry(viewer, ui, Command::Palette, true);
    ui.separator();
    menu_entry(viewer, ui, Command::Mask, viewer.session.is_some());
    menu_entry(viewer, ui, Command::Circle, viewer.session.is_some());
}

fn frames_menu(viewer: &mut Viewer, ui: &mut Ui) {
    let (has_sensor, has_frames) = (viewer.session.is_some(), !viewer.sequence.is_empty());
    for c in [Command::Play, Command::Next, Command::Back, Command::First, Command::Last] {
        menu_entry(viewer, ui, c, has_frames);
    }
    ui.separator();
    for c in [Command::NextRefused, Command::BackRefused, Command::Worst] {
        menu_entry(viewer, ui, c, has_frames);
    }
    ui.separator();
    menu_entry(viewer, ui, Command::Space, has_frames);
    ui.separator();
    menu_entry(viewer, ui, Command::ProcessAll, has_sensor && has_frames && viewer.sweep.is_none());
    menu_entry(viewer, ui, Command::Rerun, has_sensor && has_frames && viewer.sweep.is_none());
}

fn compare_menu(viewer: &mut Viewer, ui: &mut Ui) {
    ui.add_enabled_ui(viewer.session.is_some(), |ui| {
        for preset in Preset::ALL {
            if ui.button(format!("with preset {}", preset.name())).clicked() {
                viewer.compare_with_preset(*preset);
                ui.close();
            }
        }
        if ui.button("with another sensor.toml…").clicked() {
            viewer.ask(PathDialog::new(Purpose::Compare, &viewer.sequence.folder));
            ui.close();
        }
        ui.separator();
        if ui.add_enabled(viewer.other.is_some(), egui::Button::new("Stop comparing")).clicked() {
            viewer.other = None;
            ui.close();
        }
    });
}

fn export_menu(viewer: &mut Viewer, ui: &mut Ui) {
    let (has_sensor, has_frames) = (viewer.session.is_some(), !viewer.sequence.is_empty());
    menu_entry(viewer, ui, Command::ExportPicture, has_frames);
    let stem = viewer.sequence.stem().to_owned();
    let mut ask = |ui: &mut Ui, text: &str, on: bool, purpose: Purpose, name: &str| {
        if ui.add_enabled(on, egui::Button::new(text)).clicked() {
            viewer.ask(PathDialog::new(purpose, &viewer.sequence.default_output_path(name)));
            ui.close();
        }
    };
    ask(ui, "Save video with overlays…", has_sensor && has_frames, Purpose::Video, &format!("{stem}.mp4"));
    ask(ui, "Save results as CSV…", has_frames, Purpose::Table, &format!("{stem}-viewed.csv"));
    ask(ui, "Save plots as SVG…", has_frames, Purpose::Plots, &format!("{stem}-plots.svg"));
    ask(ui, "Save plots as PNG…", has_frames, Purpose::Plots, &format!("{stem}-plots.png"));
}
