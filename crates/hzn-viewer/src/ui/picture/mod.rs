//! The panel with the picture and its overlays.

mod arrow;
mod circle;
mod ground;
mod inset;
mod lens;
mod mask;
mod overlays;
mod read_out;
mod strokes;
mod welcome;

pub(super) use circle::remove as remove_circle;

use egui::{Align2, Color32, FontId, PointerButton, Rect, Response, Sense, Ui, Vec2, pos2, vec2};

use super::compare;
use super::placement::{Placement, area};
use super::theme;
use super::viewer::Viewer;
use crate::model::Plane;
use crate::model::View;
use crate::model::settings::Layer;
use crate::work::FrameView;
use read_out::{corner_label, label, notice};

/// Room in points for the badge of the zoom, which has up to six characters.
const BADGE: f32 = 80.0;

/// Draws the picture, and returns its area.
pub(super) fn show(viewer: &mut Viewer, ui: &mut Ui) -> Rect {
    let area = egui::CentralPanel::no_frame().show(ui, |ui| {
        let rect = ui.max_rect();
        let ground = if ui.visuals().dark_mode { ui.visuals().extreme_bg_color } else { Color32::from_gray(214) };
        ui.painter().rect_filled(rect, 0, ground);
        if viewer.sequence.title.is_empty() {
            return match viewer.awaited() {
                Some(words) => drop(ui.centered_and_justified(|ui| ui.weak(words))),
                None => welcome::show(viewer, ui),
            };
        }
        let Some(frame_view) = viewer.frame_view.clone() else {
            ui.centered_and_justified(|ui| ui.weak(if viewer.sequence.is_empty() { "" } else { "…" }));
            return;
        };
        let panes = if viewer.other.is_some() { 2 } else { 1 };
        let width = rect.width() / panes as f32;
        for pane in 0..panes {
            let left = rect.left() + width * pane as f32;
            let inner = Rect::from_min_size(pos2(left, rect.top()), vec2(width, rect.height())).shrink2(vec2(1.0, 0.0));
            show_pane(viewer, ui, &frame_view, inner, pane);
        }
    });
    area.response.rect
}

fn show_pane(viewer: &mut Viewer, ui: &mut Ui, frame_view: &FrameView, rect: Rect, pane: usize) {
    let response = ui.interact(rect, ui.scope_id().with(("picture", pane)), Sense::click_and_drag());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, format!("Picture {}", frame_view.name)));
    let painter = ui.painter_at(rect);
    let Some(size) = frame_view.size() else {
        let why = frame_view.picture.as_ref().err().cloned().unwrap_or_default();
        let text = format!("{}\ncannot be shown: {why}", frame_view.name);
        painter.text(
            rect.center(),
            Align2::CENTER_CENTER,
            text,
            FontId::proportional(15.0),
            ui.visuals().warn_fg_color,
        );
        return;
    };
    let plane = frame_view.image.as_ref().map(|s| s.key.1.plane.clone()).unwrap_or_default();
    let mut placement =
        Placement { view: viewer.view, area: area(rect), size, plane, camera: frame_view.camera.as_deref() };
    if pointer(viewer, ui, &response, &mut placement) {
        viewer.view = placement.view;
    }
    draw_pixels(viewer, &painter, &placement, pane);
    read_out::values(&painter, frame_view, &placement, rect);
    let outcome = frame_view.answers.get(pane);
    draw_layers(viewer, ui, &painter, frame_view, &placement, pane);
    if let Some(refused) = outcome.and_then(|o| o.refused.as_deref()) {
        notice(&painter, rect, refused, ui.visuals().warn_fg_color);
    }
    let text = response
        .hover_pos()
        .and_then(|at| read_out::under_pointer(frame_view, outcome.map(|o| &**o), viewer.body, &placement, at));
    let foot = rect.left_bottom() + vec2(10.0, -10.0);
    let described = text.map(|text| label(&painter, foot, Align2::LEFT_BOTTOM, &text));
    if !viewer.layers_hidden {
        let percent = 100.0 * placement.scale() * f64::from(ui.ctx().pixels_per_point());
        // The badge gives way to a text at the foot of the picture that reaches it.
        let reaching = described.filter(|text| text.right() > rect.right() - BADGE);
        let foot = reaching.map_or(rect.bottom(), |text| text.top());
        let at = pos2(rect.right() - 10.0, foot - 10.0);
        label(&painter, at, Align2::RIGHT_BOTTOM, &format!("{percent:.0} %"));
    }
}

/// Draws the overlays, the tools of the first pane, and the labels in the upper corners.
fn draw_layers(
    viewer: &Viewer,
    ui: &Ui,
    painter: &egui::Painter,
    frame_view: &FrameView,
    placement: &Placement<'_>,
    pane: usize,
) {
    // Texts that are placed later avoid these places.
    let mut taken = Vec::new();
    let mut vertical = None;
    let outcome = frame_view.answers.get(pane).filter(|_| !viewer.layers_hidden);
    if let Some(outcome) = outcome {
        vertical = overlays::draw(viewer, painter, frame_view, outcome, placement, &mut taken);
    }
    let residuals = if pane == 0 { lens::draw(viewer, painter, frame_view, placement) } else { None };
    if let Some(outcome) = outcome {
        inset::draw(viewer, painter, frame_view, outcome, &mut taken);
    }
    let compared = viewer.other.as_ref().map(|(name, _)| if pane == 0 { compare::OURS } else { name.as_str() });
    for text in compared.into_iter().chain(vertical.as_deref()) {
        corner_label(painter, Align2::LEFT_TOP, text, &mut taken);
    }
    if let Some(text) = residuals {
        corner_label(painter, Align2::RIGHT_TOP, &text, &mut taken);
    }
    if pane == 0 {
        mask::draw(viewer, painter, placement, ui);
        circle::draw(viewer, painter, placement);
    }
}

/// Draws the picture, and the pixels that were read.
fn draw_pixels(viewer: &Viewer, painter: &egui::Painter, placement: &Placement<'_>, pane: usize) {
    let Some((_, texture)) = &viewer.textures.shown else { return };
    let [width, height] = placement.size;
    let at = Rect::from_min_max(
        placement.shown_to_screen([-0.5, -0.5]),
        placement.shown_to_screen([width - 0.5, height - 0.5]),
    );
    let uv = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
    painter.image(texture.id(), at, uv, Color32::WHITE);
    if pane == 0
        && viewer.settings.shows(Layer::Touched)
        && !viewer.layers_hidden
        && placement.plane == Plane::Camera
        && let Some((_, touched)) = &viewer.textures.touched
    {
        painter.image(touched.id(), at, uv, theme::TOUCHED);
    }
}

/// Handles zoom and pan, or the tool of the mask or of the image circle. Returns true if the view has changed.
fn pointer(viewer: &mut Viewer, ui: &Ui, response: &Response, placement: &mut Placement<'_>) -> bool {
    let before = placement.view;
    if let Some(at) = response.hover_pos() {
        let at = [at.x.into(), at.y.into()];
        let (scroll, pinch) = ui.input(|i| (i.smooth_scroll_delta().y, i.zoom_delta()));
        let factor = (f64::from(scroll) / 240.0).exp() * f64::from(pinch);
        if (factor - 1.0).abs() > 1e-6 {
            placement.view.zoom(placement.area, placement.size, at, factor);
        }
    }
    let drawing = (viewer.mask.is_some() && mask::edit(viewer, ui, response, placement))
        || (viewer.circle.is_some() && circle::edit(viewer, ui, response, placement));
    let by = response.drag_delta();
    if by != Vec2::ZERO && (!drawing || response.dragged_by(PointerButton::Middle)) {
        placement.view.pan(placement.area, placement.size, [by.x.into(), by.y.into()]);
    }
    let has_tool = viewer.mask.is_some() || viewer.circle.is_some();
    if !has_tool && response.double_clicked() {
        if placement.view.is_fit() {
            let at = response.interact_pointer_pos().unwrap_or(response.rect.center());
            let factor = 4.0 / placement.scale();
            placement.view.zoom(placement.area, placement.size, [at.x.into(), at.y.into()], factor.max(2.0));
        } else {
            placement.view = View::FIT;
        }
    }
    if response.dragged() && !has_tool {
        ui.ctx().set_cursor_icon(egui::CursorIcon::Grabbing);
    }
    placement.view != before
}
