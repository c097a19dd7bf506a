//! Questions before changes go, before a file is replaced, and about the changes of a window that crashed.

use std::path::Path;

use egui::{Id, Modal, RichText, Ui};

use super::dialogs::changed_lines;
use super::path_dialog::Purpose;
use super::viewer::{Leave, Outside, Viewer, replaced};
use crate::model::autosave::absolute;
use crate::model::{FileChange, Session};

pub(super) fn show(viewer: &mut Viewer, ctx: &egui::Context) {
    if let Some(leave) = &viewer.changes.question {
        let what = match leave {
            Leave::Window => "You close the window",
            Leave::Sequence(_) => "You open other pictures",
            Leave::Sensor(_) => "You open another sensor.toml",
            Leave::NewSensor => "You make a new sensor.toml",
        };
        unsaved(viewer, ctx, what);
    } else if let Some(outside) = viewer.changes.outside.clone() {
        other_folder(viewer, ctx, &outside);
    } else if let Some(change) = viewer.changes.of_file {
        changed_file(viewer, ctx, change);
    } else if let Some(dialog) = viewer.path_dialog.as_ref().filter(|dialog| dialog.replaces) {
        let (purpose, path) = (dialog.purpose, dialog.path());
        existing_file(viewer, ctx, purpose, &path);
    } else if viewer.changes.lost.is_some() && viewer.path_dialog.is_none() {
        lost(viewer, ctx);
    }
}

/// Asks what to do with changes that are not saved.
fn unsaved(viewer: &mut Viewer, ctx: &egui::Context, what: &str) {
    let home = viewer.session.as_ref().map(|s| absolute(s.home())).unwrap_or_default();
    let (mut save, mut discard, mut cancel) = (false, false, false);
    let shown = Modal::new(Id::unique("unsaved")).show(ctx, |ui| {
        ui.set_max_width(460.0);
        ui.heading("Unsaved changes");
        ui.add_space(4.0);
        ui.label(format!("{what}, and the changes of this sensor.toml are not saved:"));
        path_label(ui, &home);
        ui.add_space(8.0);
        ui.horizontal(|ui| {
            save = ui.button("Save changes").clicked();
            discard = ui.button("Discard changes").clicked();
            cancel = ui.button("Cancel").clicked();
        });
    });
    if save {
        viewer.save_and_leave(ctx);
    } else if discard {
        viewer.discard_and_leave(ctx);
    } else if cancel || shown.should_close() {
        viewer.changes.question = None;
    }
}

/// Asks whether a sensor.toml outside the folder of the pictures is written.
fn other_folder(viewer: &mut Viewer, ctx: &egui::Context, outside: &Outside) {
    let (mut there, mut inside, mut cancel) = (false, false, false);
    let shown = Modal::new(Id::unique("file of another folder")).show(ctx, |ui| {
        ui.set_max_width(460.0);
        ui.heading("Save into another folder?");
        ui.add_space(4.0);
        ui.label("This file is not in the folder of the pictures, so it may belong to other pictures:");
        path_label(ui, &outside.path);
        ui.label("The folder of the pictures is:");
        path_label(ui, &outside.folder);
        ui.add_space(8.0);
        ui.horizontal(|ui| {
            there = ui.button("Save there").clicked();
            inside = outside.has_choice && ui.button("Save into the folder…").clicked();
            cancel = ui.button("Cancel").clicked();
        });
    });
    if there {
        viewer.save_outside();
    } else if inside {
        viewer.save_inside();
    } else if cancel || shown.should_close() {
        viewer.cancel_save();
    }
}

/// Asks what to do with a sensor.toml that another program changed.
fn changed_file(viewer: &mut Viewer, ctx: &egui::Context, change: FileChange) {
    let home = viewer.session.as_ref().map(|s| absolute(s.home())).unwrap_or_default();
    let exists = change == FileChange::Changed;
    let (mut reload, mut overwrite, mut cancel) = (false, false, false);
    let sections = viewer.session.as_ref().filter(|_| viewer.changes.shows_difference).map(Session::differs_from_file);
    let shown = Modal::new(Id::unique("changed file")).show(ctx, |ui| {
        ui.set_max_width(460.0);
        ui.heading(if exists { "The file has changed" } else { "The file was removed" });
        ui.add_space(4.0);
        let what = if exists { "changed" } else { "removed" };
        ui.label(format!("Another program {what} this file after the window read it:"));
        path_label(ui, &home);
        if exists {
            ui.label("“Reload” shows the text of the file; undo brings the text of this window back.");
            ui.label("“Overwrite” writes the text of this window; the text of the file is lost.");
            ui.toggle_value(&mut viewer.changes.shows_difference, "Show the difference");
            match &sections {
                Some(Ok(sections)) => {
                    ui.weak("“−” is the file, “+” is this window:");
                    changed_lines(ui, sections, 240.0);
                }
                Some(Err(why)) => drop(ui.label(why.to_string())),
                None => {}
            }
        }
        ui.add_space(8.0);
        ui.horizontal(|ui| {
            reload = exists && ui.button("Reload").clicked();
            overwrite = ui.button(if exists { "Overwrite" } else { "Write it again" }).clicked();
            cancel = ui.button("Cancel").clicked();
        });
    });
    if reload {
        viewer.reload_file();
    } else if overwrite {
        viewer.overwrite_file();
    } else if cancel || shown.should_close() {
        viewer.cancel_save();
    }
}

/// Asks whether a file that exists is replaced.
fn existing_file(viewer: &mut Viewer, ctx: &egui::Context, purpose: Purpose, path: &Path) {
    let lost = replaced(purpose, path);
    let (mut replace, mut keep) = (false, false);
    let shown = Modal::new(Id::unique("existing file")).show(ctx, |ui| {
        ui.set_max_width(460.0);
        ui.heading("Replace the file?");
        ui.add_space(4.0);
        let lost = lost.as_deref().unwrap_or(path);
        let is_part = lost != path;
        ui.label(if is_part { "A run that did not end has left this file:" } else { "This file exists already:" });
        path_label(ui, lost);
        let size = lost.metadata().map(|m| m.len()).unwrap_or_default();
        ui.label(format!("It has {}, which would be lost.", size_in_words(size)));
        ui.add_space(8.0);
        ui.horizontal(|ui| {
            replace = ui.button("Replace").clicked();
            keep = ui.button("Choose another name").clicked();
        });
    });
    if replace {
        viewer.replace_file();
    } else if keep || shown.should_close() {
        viewer.keep_file();
    }
}

fn path_label(ui: &mut Ui, path: &Path) {
    ui.add(egui::Label::new(RichText::new(path.display().to_string()).monospace()).wrap());
}

fn size_in_words(bytes: u64) -> String {
    match bytes {
        0..1_000 => format!("{bytes} bytes"),
        1_000..1_000_000 => format!("{:.1} kB", bytes as f64 / 1e3),
        1_000_000..1_000_000_000 => format!("{:.1} MB", bytes as f64 / 1e6),
        _ => format!("{:.1} GB", bytes as f64 / 1e9),
    }
}

/// Asks whether the changes of a window that crashed come back.
fn lost(viewer: &mut Viewer, ctx: &egui::Context) {
    let home = viewer.changes.lost.as_ref().map(|(u, _)| u.home.clone()).unwrap_or_default();
    let (mut restore, mut later, mut discard) = (false, false, false);
    let shown = Modal::new(Id::unique("lost")).show(ctx, |ui| {
        ui.set_max_width(460.0);
        ui.heading("Changes of an earlier window");
        ui.add_space(4.0);
        ui.label("A window ended before its changes of this sensor.toml were saved:");
        path_label(ui, &home);
        ui.add_space(8.0);
        ui.horizontal(|ui| {
            let hint = "Opens the pictures of that window with the changed sensor.toml";
            restore = ui.button("Restore changes").on_hover_text(hint).clicked();
            later = ui.button("Later").on_hover_text("The next window asks again").clicked();
            discard = ui.button("Discard changes").clicked();
        });
    });
    if restore {
        viewer.restore_lost();
    } else if discard {
        viewer.forget_lost();
    } else if later || shown.should_close() {
        viewer.keep_lost();
    }
}
