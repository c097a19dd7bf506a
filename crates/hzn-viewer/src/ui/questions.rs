//! Questions before changes go, and about the changes of a window that crashed.

use egui::{Id, Modal};

use super::viewer::{Leave, Viewer};

pub(super) fn show(viewer: &mut Viewer, ctx: &egui::Context) {
    if let Some(leave) = &viewer.changes.question {
        let what = match leave {
            Leave::Window => "You close the window",
            Leave::Sequence(_) => "You open other pictures",
            Leave::Sensor(_) => "You open another sensor.toml",
        };
        unsaved(viewer, ctx, what);
    } else if viewer.changes.lost.is_some() && viewer.path_dialog.is_none() {
        lost(viewer, ctx);
    }
}

/// Asks what to do with changes that are not saved.
fn unsaved(viewer: &mut Viewer, ctx: &egui::Context, what: &str) {
    let home = viewer.session.as_ref().map(|s| s.home().display().to_string()).unwrap_or_default();
    let (mut save, mut discard, mut cancel) = (false, false, false);
    let shown = Modal::new(Id::unique("unsaved")).show(ctx, |ui| {
        ui.set_max_width(460.0);
        ui.heading("Unsaved changes");
        ui.add_space(4.0);
        ui.label(format!("{what}, and the changes of this sensor.toml are not saved:"));
        ui.add(egui::Label::new(egui::RichText::new(home).monospace()).wrap());
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

/// Asks whether the changes of a window that crashed come back.
fn lost(viewer: &mut Viewer, ctx: &egui::Context) {
    let home = viewer.changes.lost.as_ref().map(|(u, _)| u.home.display().to_string()).unwrap_or_default();
    let (mut restore, mut later, mut discard) = (false, false, false);
    let shown = Modal::new(Id::unique("lost")).show(ctx, |ui| {
        ui.set_max_width(460.0);
        ui.heading("Changes of an earlier window");
        ui.add_space(4.0);
        ui.label("A window ended before its changes of this sensor.toml were saved:");
        ui.add(egui::Label::new(egui::RichText::new(home).monospace()).wrap());
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
