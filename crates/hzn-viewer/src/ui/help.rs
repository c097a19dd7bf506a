//! The help: a list of all keys.

use egui::gui_zoom::kb_shortcuts::{ZOOM_IN, ZOOM_OUT, ZOOM_RESET};
use egui::{KeyboardShortcut, RichText, vec2};

use super::command;
use super::viewer::Viewer;

/// Width in points from which the list of keys has two columns.
const TWO_COLUMNS: f32 = 640.0;

/// Keys that the library of the window handles.
const TEXT_SIZE: [(KeyboardShortcut, &str); 3] = [
    (ZOOM_IN, "Larger text and buttons"),
    (ZOOM_OUT, "Smaller text and buttons"),
    (ZOOM_RESET, "Text and buttons of the usual size"),
];

pub(super) fn show(viewer: &mut Viewer, ctx: &egui::Context) {
    if !viewer.showing_help {
        return;
    }
    let response = egui::Modal::new(egui::Id::unique("help")).show(ctx, |ui| {
        let room = ctx.content_rect().size() - vec2(60.0, 120.0);
        ui.set_width(room.x.min(820.0));
        ui.heading("Keys and mouse");
        ui.add_space(6.0);
        egui::ScrollArea::vertical().max_height(room.y).show(ui, contents);
        ui.add_space(4.0);
        ui.button("Close").clicked()
    });
    if response.inner || response.should_close() {
        viewer.showing_help = false;
    }
}

fn contents(ui: &mut egui::Ui) {
    // Both columns begin at the same height, or lie below each other if there is no room for two.
    let across = egui::Layout::left_to_right(egui::Align::Min);
    let layout = if ui.available_width() < TWO_COLUMNS { egui::Layout::top_down(egui::Align::Min) } else { across };
    ui.with_layout(layout, |ui| {
        let ctx = ui.ctx();
        let commands = command::ALL.iter().map(|(c, name, ..)| (c.key(ctx), *name));
        let keys: Vec<(String, &str)> =
            commands.chain(TEXT_SIZE.iter().map(|(key, name)| (ctx.format_shortcut(key), *name))).collect();
        for (n, part) in keys.chunks(keys.len().div_ceil(2)).enumerate() {
            egui::Grid::new(("keys", n)).num_columns(2).spacing(vec2(14.0, 4.0)).show(ui, |ui| {
                for (key, name) in part {
                    ui.label(RichText::new(key).monospace().strong());
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
    ui.separator();
    let [version, licence] = [env!("CARGO_PKG_VERSION"), env!("CARGO_PKG_LICENSE")];
    ui.weak(format!("About: hzn viewer {version}, licence {licence}. The command hzn view starts the same window."));
}
