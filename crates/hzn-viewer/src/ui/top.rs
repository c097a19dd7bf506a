//! The bar at the top: menus, the title of the sequence, and messages.

use std::time::Duration;

use egui::{RichText, Ui};
use hzn_core::Preset;

use super::Command;
use super::path_dialog::{PathDialog, Purpose};
use super::viewer::{Message, Viewer};

/// Age from which a job gets a bar. A bar for a shorter job would only make the window jump.
const NOTICED_AFTER: Duration = Duration::from_millis(200);

pub(super) fn show(viewer: &mut Viewer, ui: &mut Ui) {
    egui::Panel::top("top").show(ui, |ui| {
        ui.add_space(3.0);
        ui.horizontal(|ui| {
            menus(viewer, ui);
            ui.separator();
            ui.strong(&viewer.sequence.title);
            if let Some(session) = &viewer.session {
                let name = session.path().and_then(|p| p.file_name()).map(|n| n.to_string_lossy().into_owned());
                let name = name.unwrap_or_else(|| "sensor of the recording".into());
                let changed = if session.is_changed() { "changed: " } else { "" };
                ui.weak(format!("{changed}{name}"));
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                for (command, text) in [
                    (Command::Help, "Help"),
                    (Command::Theme, if viewer.settings.dark { "Light" } else { "Dark" }),
                    (Command::Stages, "Stages"),
                    (Command::Plots, "Plots"),
                ] {
                    let on = match command {
                        Command::Stages => viewer.settings.stages,
                        Command::Plots => viewer.settings.plots,
                        Command::Help => viewer.showing_help,
                        _ => false,
                    };
                    let hint = format!("{} ({})", command.name(), command.key(ui.ctx()));
                    if ui.selectable_label(on, text).on_hover_text(hint).clicked() {
                        viewer.run(command, &ui.ctx().clone());
                    }
                }
            });
        });
        ui.add_space(2.0);
        jobs(viewer, ui);
        messages(viewer, ui);
    });
}

fn menu_entry(viewer: &mut Viewer, ui: &mut Ui, command: Command, on: bool) {
    let button = egui::Button::new(command.name()).shortcut_text(command.key(ui.ctx()));
    if ui.add_enabled(on, button).clicked() {
        viewer.run(command, &ui.ctx().clone());
        ui.close();
    }
}

fn menus(viewer: &mut Viewer, ui: &mut Ui) {
    ui.menu_button("File", |ui| file_menu(viewer, ui));
    ui.menu_button("Edit", |ui| edit_menu(viewer, ui));
    ui.menu_button("Pictures", |ui| frames_menu(viewer, ui));
    ui.menu_button("Compare", |ui| compare_menu(viewer, ui));
    ui.menu_button("Export", |ui| export_menu(viewer, ui));
}

fn file_menu(viewer: &mut Viewer, ui: &mut Ui) {
    let has_sensor = viewer.session.is_some();
    menu_entry(viewer, ui, Command::Open, true);
    let recent = viewer.settings.recent.clone();
    if !recent.is_empty() {
        ui.menu_button("Opened last", |ui| {
            for path in recent {
                if ui.button(path.display().to_string()).clicked() {
                    viewer.open_paths(vec![path]);
                    ui.close();
                }
            }
        });
    }
    ui.separator();
    menu_entry(viewer, ui, Command::Save, has_sensor);
    menu_entry(viewer, ui, Command::SaveAs, has_sensor);
}

fn edit_menu(viewer: &mut Viewer, ui: &mut Ui) {
    let (undo, redo, changed) =
        viewer.session.as_ref().map_or((false, false, false), |s| (s.can_undo(), s.can_redo(), s.is_changed()));
    menu_entry(viewer, ui, Command::Undo, undo);
    menu_entry(viewer, ui, Command::Redo, redo);
    menu_entry(viewer, ui, Command::Reset, changed);
    menu_entry(viewer, ui, Command::Diff, changed);
    ui.separator();
    menu_entry(viewer, ui, Command::Mask, viewer.session.is_some());
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
            viewer.path_dialog = Some(PathDialog::new(Purpose::Compare, &viewer.sequence.folder));
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
    let mut ask = |ui: &mut Ui, text: &str, on: bool, purpose: Purpose, name: &str| {
        if ui.add_enabled(on, egui::Button::new(text)).clicked() {
            viewer.path_dialog = Some(PathDialog::new(purpose, &viewer.sequence.default_output_path(name)));
            ui.close();
        }
    };
    let stem = viewer.sequence.stem().to_owned();
    ask(ui, "Save video with overlays…", has_sensor && has_frames, Purpose::Video, &format!("{stem}.mp4"));
    ask(ui, "Save results as CSV…", has_frames, Purpose::Table, &format!("{stem}-viewed.csv"));
}

fn messages(viewer: &mut Viewer, ui: &mut Ui) {
    let mut closed = None;
    let mut recover = None;
    for (i, Message { text, bad, recover: path }) in viewer.messages.iter().enumerate() {
        ui.horizontal(|ui| {
            if ui.small_button("Close").clicked() {
                closed = Some(i);
            }
            if let Some(path) = path
                && ui
                    .button("Recover it")
                    .on_hover_text("Writes a complete recording next to it and opens that")
                    .clicked()
            {
                recover = Some(path.clone());
                closed = Some(i);
            }
            let colour = if *bad { ui.visuals().warn_fg_color } else { ui.visuals().text_color() };
            ui.add(egui::Label::new(RichText::new(text).color(colour)).wrap());
        });
    }
    if let Some(i) = closed {
        viewer.messages.remove(i);
    }
    if let Some(path) = recover {
        viewer.recover(path);
    }
}

/// Shows the progress of jobs that take longer than [`NOTICED_AFTER`].
fn jobs(viewer: &Viewer, ui: &mut Ui) {
    for job in &viewer.jobs {
        ui.ctx().request_repaint_after(NOTICED_AFTER);
        if job.age() < NOTICED_AFTER {
            continue;
        }
        ui.horizontal(|ui| {
            let name = format!("Cancel {}", job.name.to_lowercase());
            let cancel = ui.add_enabled(!job.is_stopping(), egui::Button::new("Cancel").small());
            cancel.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &name));
            if cancel.clicked() {
                job.stop();
            }
            ui.label(job.name);
            ui.add(egui::ProgressBar::new(job.fraction()).desired_width(220.0).show_percentage());
        });
    }
}
