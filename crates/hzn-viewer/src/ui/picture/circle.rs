//! The tool that drags the image circle with the mouse.

use egui::{Align2, CursorIcon, Painter, PointerButton, Response, Shape, Stroke, Ui, vec2};
use hzn_core::camera::Config;

use super::read_out::label;
use crate::model::image_circle::{Circle, Grip, angle_deg, moved};
use crate::model::{Session, sheet};
use crate::ui::placement::Placement;
use crate::ui::theme;
use crate::ui::viewer::Viewer;

/// Largest distance of the pointer from centre or rim that is grabbed, in screen points.
const REACH: f64 = 9.0;

/// Runs the tool. Returns true while a part of the circle is dragged.
pub(super) fn edit(viewer: &mut Viewer, ui: &Ui, response: &Response, placement: &Placement<'_>) -> bool {
    let (Some(mut tool), Some(session)) = (viewer.circle.take(), viewer.session.as_mut()) else { return false };
    let Some(config) = session.config().map(|c| c.camera.clone()) else { return false };
    let circle = Circle::new(&config);
    let reach = REACH / placement.scale();
    let own = has_own_centre(session);
    let grip_at = |p| circle.grip_at(p, reach).filter(|grip| *grip == Grip::Rim || own);
    let at = response.interact_pointer_pos().or(response.hover_pos()).and_then(|p| placement.to_picture(p));
    if let Some(p) = at {
        if response.drag_started_by(PointerButton::Primary) {
            let from = ui.input(|i| i.pointer.press_origin()).and_then(|p| placement.to_picture(p)).unwrap_or(p);
            tool.grip = grip_at(from);
        }
        if tool.grip.or_else(|| grip_at(p)).is_some() {
            ui.ctx().set_cursor_icon(CursorIcon::Crosshair);
        }
        if response.dragged_by(PointerButton::Primary)
            && let Some(grip) = tool.grip
        {
            drag(session, &config, grip, p);
        }
        if response.clicked_by(PointerButton::Secondary) && circle.is_set && grip_at(p) == Some(Grip::Rim) {
            remove(session);
        }
    }
    let dragging = tool.grip.is_some();
    if response.drag_stopped() {
        tool.grip = None;
        session.end_step();
    }
    let done = ui.input(|i| i.key_pressed(egui::Key::Escape) || i.key_pressed(egui::Key::Enter));
    viewer.circle = (!done).then_some(tool);
    dragging
}

/// Returns true if the principal point stands in sensor.toml, and not in the file of another tool.
fn has_own_centre(session: &Session) -> bool {
    session.sheet().get(sheet::Key { section: "camera", name: "file", body: 0 }).is_none()
}

/// Moves the centre, or the rim, to a point of the picture.
fn drag(session: &mut Session, config: &Config, grip: Grip, p: [f64; 2]) {
    match grip {
        Grip::Centre => {
            // Tenths of a pixel are fine enough for a hand.
            let [x, y] = p.map(|x| (x * 10.0).round() / 10.0);
            if moved(config, [x, y]).is_some() {
                let values = [("camera", "cx_px", Some(x.into())), ("camera", "cy_px", Some(y.into()))];
                session.set_gesture("camera.circle", &values);
            }
        }
        Grip::Rim => {
            if let Some(deg) = angle_deg(config, p) {
                // Rounded down, the angle stays within the lens.
                let deg = ((deg * 100.0).floor() / 100.0).max(0.1);
                session.set("camera", "theta_max_deg", 0, Some(deg.into()));
            }
        }
    }
}

/// Removes the image circle.
pub(in crate::ui) fn remove(session: &mut Session) {
    session.set("camera", "theta_max_deg", 0, None);
    session.end_step();
}

/// Draws the tool, if it is in use.
pub(super) fn draw(viewer: &Viewer, painter: &Painter, placement: &Placement<'_>) {
    let (Some(tool), Some(session)) = (&viewer.circle, &viewer.session) else { return };
    let Some(config) = session.config().map(|c| &c.camera) else { return };
    let circle = Circle::new(config);
    let strong = |grip| Stroke::new(if tool.grip == Some(grip) { 3.0 } else { 2.0 }, theme::TRUTH);
    let rim = |i: usize| placement.to_screen(circle.rim(i as f64 * std::f64::consts::TAU / 256.0));
    let outline: Vec<_> = (0..=256).filter_map(rim).collect();
    painter.add(Shape::line(outline, strong(Grip::Rim)));
    let quarter = |i: usize| placement.to_screen(circle.rim(i as f64 * std::f64::consts::FRAC_PI_2));
    painter.extend((0..4).filter_map(quarter).map(|p| Shape::circle_filled(p, 4.5, theme::TRUTH)));
    let own = has_own_centre(session);
    if let Some(p) = placement.to_screen(circle.centre).filter(|_| own) {
        painter.circle(p, 5.0, egui::Color32::from_black_alpha(120), strong(Grip::Centre));
        painter.circle_filled(p, 1.5, theme::TRUTH);
    }
    let now = match config.theta_max_deg {
        Some(deg) => format!("Image circle: {deg:.2}° off the optical axis."),
        None => "Image circle: not set; drag the rim to set it.".to_owned(),
    };
    let centre = if own { "drag the centre to move the principal point" } else { "the centre is in the camera file" };
    let text = format!(
        "{now} Drag the rim to change the radius; {centre}. A right click on the rim removes the \
                        circle. Esc: done."
    );
    let rect = painter.clip_rect();
    label(painter, rect.center_top() + vec2(0.0, 10.0), Align2::CENTER_TOP, &text);
}
