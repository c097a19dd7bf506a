//! The page of an empty window.

use egui::{Color32, Rect, Response, RichText, Role, Sense, StrokeKind, TextureId, Ui, Vec2, pos2, vec2};

use crate::ui::Command;
use crate::ui::viewer::Viewer;
use crate::work::demo::Sample;
use crate::work::thumbnails::Thumbnail;

/// Width of the picture of a sample in points.
const SAMPLE: f32 = 144.0;
/// Size of the picture of a recent file in points.
const SMALL: Vec2 = vec2(96.0, 54.0);

/// Draws the page: what can be opened, samples, and recent files.
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
                viewer.open_sample(Sample::Rocket);
            }
            ui.add_space(10.0);
            ui.weak("Or drop a recording (.mcap), a folder, pictures, a video or a sensor.toml here.");
            samples(viewer, ui);
            recent(viewer, ui);
        });
    });
}

/// Draws the samples next to each other.
fn samples(viewer: &mut Viewer, ui: &mut Ui) {
    ui.add_space(18.0);
    ui.strong("Samples");
    ui.horizontal(|ui| {
        let width = Sample::ALL.len() as f32 * (SAMPLE + ui.spacing().item_spacing.x);
        ui.add_space(((ui.available_width() - width) / 2.0).max(0.0));
        for sample in Sample::ALL {
            ui.vertical(|ui| {
                ui.set_width(SAMPLE);
                let ctx = ui.ctx().clone();
                let decoded =
                    || image::load_from_memory(sample.thumbnail()).map_or_else(|_| blank(), |p| p.into_rgb8());
                let texture = viewer.textures.small(sample.name(), &ctx, decoded);
                let size = vec2(SAMPLE, SAMPLE * SMALL.y / SMALL.x);
                if small_picture(ui, Some(texture), size, &format!("Sample: {}", sample.name())).clicked()
                    && viewer.jobs.is_empty()
                {
                    viewer.open_sample(sample);
                }
                ui.weak(RichText::new(sample.name()).size(12.0));
            });
        }
    });
}

/// Draws the recent files with a picture of each.
fn recent(viewer: &mut Viewer, ui: &mut Ui) {
    let recent = viewer.settings.recent.clone();
    if recent.is_empty() {
        return;
    }
    ui.add_space(18.0);
    ui.strong("Recent");
    for path in recent {
        ui.horizontal(|ui| {
            let name = path.display().to_string();
            let ctx = ui.ctx().clone();
            let texture = match viewer.thumbnail(&path) {
                Thumbnail::Ready(picture) => Some(viewer.textures.small(&name, &ctx, || picture.as_ref().clone())),
                Thumbnail::Awaited | Thumbnail::Missing => None,
            };
            let title = path.file_name().map_or_else(|| name.clone(), |n| n.to_string_lossy().into_owned());
            let what = if texture.is_some() { "First picture of" } else { "No picture of" };
            let picture = small_picture(ui, texture, SMALL, &format!("{what} {title}"));
            let link = ui.add(egui::Link::new(name));
            if picture.clicked() || link.clicked() {
                viewer.open_paths(vec![path.clone()]);
            }
        });
    }
}

fn blank() -> image::RgbImage {
    image::RgbImage::new(1, 1)
}

/// Draws a small picture that can be clicked, or a frame of its size.
fn small_picture(ui: &mut Ui, texture: Option<TextureId>, size: Vec2, label: &str) -> Response {
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    response.widget_info(|| egui::WidgetInfo::labeled(Role::Button, true, label));
    let painter = ui.painter();
    painter.rect_filled(rect, 3, ui.visuals().extreme_bg_color);
    if let Some(texture) = texture {
        let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        painter.image(texture, rect, whole, Color32::WHITE);
    }
    let stroke = ui.style().interact(&response).bg_stroke;
    painter.rect_stroke(rect, 3, stroke, StrokeKind::Outside);
    response.on_hover_cursor(egui::CursorIcon::PointingHand)
}
