//! The tool that draws and edits the mask with the mouse.

use egui::{Align2, Painter, PointerButton, Pos2, Response, Shape, Stroke, Ui, vec2};

use super::read_out::label;
use crate::ui::placement::Placement;
use crate::ui::theme;
use crate::ui::viewer::Viewer;

/// Largest distance of the pointer from a corner that is grabbed, in screen points.
const REACH: f64 = 9.0;

/// Runs the tool. Returns true while a corner is grabbed.
pub(super) fn edit(viewer: &mut Viewer, ui: &Ui, response: &Response, placement: &Placement<'_>) -> bool {
    let (Some(mut tool), Some(session)) = (viewer.mask.take(), viewer.session.as_mut()) else { return false };
    let polygons = session.polygons();
    let reach = REACH / placement.scale();
    let at = response.interact_pointer_pos().or(response.hover_pos()).and_then(|p| placement.to_picture(p));
    let mut new = None;
    if let Some(p) = at {
        if response.drag_started_by(PointerButton::Primary) {
            let from = ui.input(|i| i.pointer.press_origin()).and_then(|p| placement.to_picture(p)).unwrap_or(p);
            tool.grab(&polygons, from, reach);
        }
        if response.dragged_by(PointerButton::Primary) {
            new = tool.drag(&polygons, p);
        }
        if response.clicked_by(PointerButton::Primary) {
            new = tool.click(&polygons, p, reach);
        }
        if response.clicked_by(PointerButton::Secondary) && tool.open.is_empty() {
            new = tool.remove(&polygons, p, reach);
        }
    }
    let grabbing = tool.is_grabbing();
    if response.drag_stopped() {
        tool.release();
        session.end_step();
    }
    let (enter, back) = ui.input(|i| (i.key_pressed(egui::Key::Enter), i.key_pressed(egui::Key::Backspace)));
    if enter {
        new = new.or_else(|| tool.close(&polygons));
    }
    if back {
        tool.undo_corner();
    }
    if let Some(new) = new {
        session.set_polygons(&new);
        if !grabbing {
            session.end_step();
        }
    }
    viewer.mask = Some(tool);
    grabbing
}

/// Draws the tool, if it is in use.
pub(super) fn draw(viewer: &Viewer, painter: &Painter, placement: &Placement<'_>, ui: &Ui) {
    let Some(tool) = &viewer.mask else { return };
    let stroke = Stroke::new(2.0, theme::TRUTH);
    for corner in viewer.session.iter().flat_map(|s| s.polygons()).flatten() {
        painter.extend(placement.to_screen(corner).map(|p| Shape::circle_filled(p, 4.5, theme::TRUTH)));
    }
    let mut line: Vec<Pos2> = tool.open.iter().filter_map(|p| placement.to_screen(*p)).collect();
    painter.extend(line.iter().map(|p| Shape::circle_filled(*p, 4.5, theme::TRUTH)));
    if !line.is_empty() {
        line.extend(ui.ctx().pointer_hover_pos());
    }
    painter.add(Shape::line(line, stroke));
    let text = "Mask: click corners, close on the first one or with Enter. Drag a corner to move it; right-click \
                removes a corner or an area. Backspace or undo: one corner back. Esc: done.";
    let rect = painter.clip_rect();
    label(painter, rect.center_top() + vec2(0.0, 10.0), Align2::CENTER_TOP, text);
}
