//! The help: a list of all keys.

use egui::{RichText, vec2};

use super::command;
use super::viewer::Viewer;

pub(super) fn show(viewer: &mut Viewer, ctx: &egui::Context) {
    if !viewer.showing_help {
        return;
    }
    let response = egui::Modal::new(egui::Id::unique("help")).show(ctx, |ui| {
        ui.heading("Keys and mouse");
        ui.add_space(6.0);
        let room = ctx.content_rect().size() - vec2(60.0, 90.0);
        egui::ScrollArea::both().max_height(room.y).max_width(room.x).show(ui, contents);
    });
    if response.should_close() {
        viewer.showing_help = false;
    }
}

fn contents(ui: &mut egui::Ui) {
    ui.horizontal_top(|ui| {
        let half = command::ALL.len().div_ceil(2);
        for (n, part) in command::ALL.chunks(half).enumerate() {
            egui::Grid::new(("keys", n)).num_columns(2).spacing(vec2(14.0, 4.0)).show(ui, |ui| {
                for (c, name, ..) in part {
                    ui.label(RichText::new(c.key(ui.ctx())).monospace().strong());
                    ui.label(*name);
                    ui.end_row();
                }
            });
            ui.add_space(18.0);
        }
    });
    ui.separator();
    for line in [
        "Wheel: zoom about the pointer, to single pixels with values. Drag: move. Double click: zoom in or out.",
        "Click in a plot or in the time line: go to that picture. Drag in a plot: move it; double click: show all.",
        "Click on the residuals: the picture shows the nearest edge point.",
        "Hover over a candidate in the column of stages: the picture highlights it.",
        "Drop a recording, a folder, a picture, a video or a sensor.toml on the window: the window opens it.",
    ] {
        ui.label(line);
    }
}
