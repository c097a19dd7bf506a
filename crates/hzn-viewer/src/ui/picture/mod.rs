//! The panel with the picture and its overlays.

mod mask;
mod overlays;
mod read_out;
mod stage;
mod textures;

use egui::{Align2, Color32, FontId, PointerButton, Rect, Response, Sense, Ui, Vec2, pos2, vec2};

use super::viewer::Viewer;
use super::{Command, theme};
use crate::model::Plane;
use crate::model::View;
use crate::model::settings::Layer;
use crate::model::view::Point;
use crate::work::FrameView;
pub(super) use mask::toggle as toggle_mask;
use read_out::{label, notice};
use stage::{Stage, area};
pub(super) use textures::Textures;

/// Largest distance of the pointer from a corner that is grabbed, in screen points.
const REACH: f64 = 9.0;

fn size_of(sight: &FrameView) -> Option<Point> {
    let layout = sight.picture.as_ref().ok()?.layout;
    Some([layout.width.into(), layout.height.into()])
}

pub(super) fn show(viewer: &mut Viewer, ui: &mut Ui) {
    egui::CentralPanel::no_frame().show(ui, |ui| {
        let rect = ui.max_rect();
        let ground = if ui.visuals().dark_mode { ui.visuals().extreme_bg_color } else { Color32::from_gray(214) };
        ui.painter().rect_filled(rect, 0, ground);
        if viewer.sequence.title.is_empty() {
            return welcome(viewer, ui);
        }
        let Some(sight) = viewer.sight.clone() else {
            ui.centered_and_justified(|ui| ui.weak(if viewer.sequence.is_empty() { "" } else { "…" }));
            return;
        };
        let panes = if viewer.other.is_some() { 2 } else { 1 };
        let width = rect.width() / panes as f32;
        for pane in 0..panes {
            let left = rect.left() + width * pane as f32;
            let inner = Rect::from_min_size(pos2(left, rect.top()), vec2(width, rect.height())).shrink2(vec2(1.0, 0.0));
            one(viewer, ui, &sight, inner, pane);
        }
    });
}

fn welcome(viewer: &mut Viewer, ui: &mut Ui) {
    ui.vertical_centered(|ui| {
        ui.add_space(ui.available_height() * 0.28);
        ui.heading("hzn viewer");
        ui.add_space(6.0);
        ui.label("Drop a recording (.mcap), a folder of pictures, a picture or a video here.");
        ui.add_space(10.0);
        if ui.button("Open…").clicked() {
            viewer.run(Command::Open, &ui.ctx().clone());
        }
        ui.add_space(14.0);
        let recent = viewer.settings.recent.clone();
        for path in recent {
            if ui.link(path.display().to_string()).clicked() {
                viewer.open_paths(vec![path]);
            }
        }
    });
}

fn one(viewer: &mut Viewer, ui: &mut Ui, sight: &FrameView, rect: Rect, pane: usize) {
    let response = ui.interact(rect, ui.scope_id().with(("picture", pane)), Sense::click_and_drag());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, format!("Picture {}", sight.name)));
    let painter = ui.painter_at(rect);
    let Some(size) = size_of(sight) else {
        let why = sight.picture.as_ref().err().cloned().unwrap_or_default();
        let text = format!("{}\ncannot be shown: {why}", sight.name);
        painter.text(
            rect.center(),
            Align2::CENTER_CENTER,
            text,
            FontId::proportional(15.0),
            ui.visuals().warn_fg_color,
        );
        return;
    };
    let plane = sight.image.as_ref().map(|s| s.of.1.plane.clone()).unwrap_or_default();
    let mut stage = Stage { view: viewer.view, area: area(rect), size, plane, camera: sight.camera.as_deref() };
    if pointer(viewer, ui, &response, &mut stage) {
        viewer.view = stage.view;
    }
    if let Some((_, texture)) = &viewer.textures.shown {
        let at = Rect::from_min_max(stage.place([-0.5, -0.5]), stage.place([size[0] - 0.5, size[1] - 0.5]));
        let uv = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        painter.image(texture.id(), at, uv, Color32::WHITE);
        if pane == 0
            && viewer.settings.shows(Layer::Touched)
            && !viewer.layers_hidden
            && stage.plane == Plane::Camera
            && let Some((_, touched)) = &viewer.textures.touched
        {
            painter.image(touched.id(), at, uv, theme::TOUCHED);
        }
    }
    read_out::values(&painter, sight, &stage, rect);
    let outcome = sight.answers.get(pane);
    if let Some(outcome) = outcome.filter(|_| !viewer.layers_hidden) {
        overlays::draw(viewer, &painter, sight, outcome, &stage);
    }
    if let (Some(tool), 0) = (&viewer.mask, pane) {
        mask::draw(tool, viewer, &painter, &stage, ui);
    }
    if let Some(name) = viewer.other.as_ref().map(|(name, _)| name.clone()) {
        let title = if pane == 0 { "session".to_owned() } else { name };
        label(&painter, rect.left_top() + vec2(10.0, 10.0), Align2::LEFT_TOP, &title);
    }
    if let Some(refused) = outcome.and_then(|o| o.refused.as_deref()) {
        notice(&painter, rect, refused, ui.visuals().warn_fg_color);
    }
    if let Some(at) = response.hover_pos()
        && let Some(text) = read_out::under_pointer(sight, outcome.map(|o| &**o), viewer.body, &stage, at)
    {
        label(&painter, rect.left_bottom() + vec2(10.0, -10.0), Align2::LEFT_BOTTOM, &text);
    }
}

/// Handles zoom and pan, or the tool of the mask. Returns true if the view has changed.
fn pointer(viewer: &mut Viewer, ui: &Ui, response: &Response, stage: &mut Stage<'_>) -> bool {
    let before = stage.view;
    if let Some(at) = response.hover_pos() {
        let at = [at.x.into(), at.y.into()];
        let (scroll, pinch) = ui.input(|i| (i.smooth_scroll_delta().y, i.zoom_delta()));
        let factor = (f64::from(scroll) / 240.0).exp() * f64::from(pinch);
        if (factor - 1.0).abs() > 1e-6 {
            stage.view.zoom(stage.area, stage.size, at, factor);
        }
    }
    let drawing = viewer.mask.is_some() && mask::edit(viewer, ui, response, stage);
    let by = response.drag_delta();
    if by != Vec2::ZERO && (!drawing || response.dragged_by(PointerButton::Middle)) {
        stage.view.pan(stage.area, stage.size, [by.x.into(), by.y.into()]);
    }
    if viewer.mask.is_none() && response.double_clicked() {
        if stage.view.is_fit() {
            let at = response.interact_pointer_pos().unwrap_or(response.rect.center());
            let factor = 4.0 / stage.scale();
            stage.view.zoom(stage.area, stage.size, [at.x.into(), at.y.into()], factor.max(2.0));
        } else {
            stage.view = View::FIT;
        }
    }
    if response.dragged() && viewer.mask.is_none() {
        ui.ctx().set_cursor_icon(egui::CursorIcon::Grabbing);
    }
    stage.view != before
}

/// Shows a point of the camera's picture, large enough to see single pixels.
pub(super) fn look_at(viewer: &mut Viewer, p: Point) {
    const SCALE: f64 = 8.0;
    let Some(sight) = &viewer.sight else { return };
    let plane = sight.image.as_ref().map(|s| &s.of.1.plane);
    let shown = match (plane, sight.camera.as_deref()) {
        (Some(plane), Some(camera)) => plane.show(camera, p),
        _ => Some(p),
    };
    if let (Some(size), Some(p)) = (size_of(sight), shown) {
        viewer.view.look_at(size, p, SCALE);
    }
}

/// Zooms by key or menu, about the middle of the window.
pub(super) fn zoom(viewer: &mut Viewer, command: Command, ctx: &egui::Context) {
    let Some(size) = viewer.sight.as_ref().and_then(size_of) else { return };
    let rect = ctx.content_rect();
    let area = area(rect);
    match command {
        Command::Fit => viewer.view = View::FIT,
        Command::Actual => viewer.view.set_scale(area, size, 1.0 / f64::from(ctx.pixels_per_point())),
        _ => {
            let factor = if command == Command::ZoomIn { 1.5 } else { 1.0 / 1.5 };
            let middle = rect.center();
            viewer.view.zoom(area, size, [middle.x.into(), middle.y.into()], factor);
        }
    }
}
