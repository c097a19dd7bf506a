//! The page of an empty window.

use egui::{RichText, Ui, vec2};

use crate::ui::Command;
use crate::ui::viewer::Viewer;

/// Draws the page: what can be opened, the demo flight, and recent files.
pub(super) fn show(viewer: &mut Viewer, ui: &mut Ui) {
    let ctx = ui.ctx().clone();
    egui::ScrollArea::vertical().show(ui, |ui| {
        ui.vertical_centered(|ui| {
            ui.add_space((ui.ctx().content_rect().height() * 0.14).min(120.0));
            ui.set_max_width(520.0);
            ui.heading(RichText::new("hzn viewer").size(26.0));
            ui.add_space(4.0);
            ui.label("It shows what the horizon sensor found in each picture, and tunes its parameters.");
            ui.add_space(16.0);
            for (text, command) in [("Open file…", Command::Open), ("Open folder…", Command::OpenFolder)] {
                if ui.add(egui::Button::new(text).min_size(vec2(220.0, 30.0))).clicked() {
                    viewer.run(command, &ctx);
                }
            }
            let hint = "24 rendered pictures with exact truth; they are rendered the first time, which takes seconds";
            let demo = egui::Button::new("Open the demo flight").min_size(vec2(220.0, 30.0));
            let idle = viewer.jobs.is_empty();
            if ui.add_enabled(idle, demo).on_hover_text(hint).clicked() {
                viewer.open_demo();
            }
            ui.add_space(10.0);
            ui.weak("Or drop a recording (.mcap), a folder, pictures, a video or a sensor.toml here.");
            recent(viewer, ui);
        });
    });
}

fn recent(viewer: &mut Viewer, ui: &mut Ui) {
    let recent = viewer.settings.recent.clone();
    if recent.is_empty() {
        return;
    }
    ui.add_space(18.0);
    ui.strong("Recent");
    for path in recent {
        let link = egui::Link::new(path.display().to_string());
        if ui.add(link).clicked() {
            viewer.open_paths(vec![path]);
        }
    }
}
