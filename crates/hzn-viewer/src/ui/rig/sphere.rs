//! All heads on one sphere of directions around the vehicle: the border of each picture, the limb that each head found,
//! and the joint axis.

use egui::{Align2, FontId, Sense, Stroke, Ui, vec2};
use hzn_core::camera::Camera;
use hzn_core::frames::{Cam, Rotation, UnitVec3, Vehicle};
use hzn_core::pixel::ImagePoint;

use super::colours::colour;
use crate::ui::globe::Globe;
use crate::ui::rig_view::{RigView, Use};
use crate::ui::theme;

/// Points on a side of a picture's border, and around a limb.
const SIDE: u32 = 20;
const AROUND: u32 = 180;

pub(super) fn show(view: &mut RigView, ui: &mut Ui) {
    let dark = ui.visuals().dark_mode;
    ui.add_space(4.0);
    ui.strong("All heads on one sphere");
    ui.weak("Borders of the pictures (thin), limbs (thick), joint axis; drag to turn");
    let side = ui.available_width().min((ui.available_height() - 24.0).max(80.0));
    let (response, painter) = ui.allocate_painter(vec2(ui.available_width(), side), Sense::drag());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Sphere of all heads"));
    let by = response.drag_delta() * 0.01;
    view.eye_rad = [view.eye_rad[0] + by.x, (view.eye_rad[1] + by.y).clamp(-1.5, 1.5)];
    let globe = Globe::downwards(response.rect, view.eye_rad);
    let faint = Stroke::new(1.0, ui.visuals().weak_text_color().gamma_multiply(0.6));
    painter.circle_stroke(globe.centre, globe.radius, faint);
    axes(&globe, &painter, ui);
    let Some(epoch) = view.epochs.get(view.epoch) else { return };
    for (n, (head, answer)) in view.heads.iter().zip(&epoch.heads).enumerate() {
        let q = head.q_vehicle_from_camera_wxyz;
        let Some(turn) = Rotation::<Cam, Vehicle, f64>::assume_from_quaternion(q) else { continue };
        let to_vehicle = |d: UnitVec3<Cam, f64>| turn.apply(&d).xyz();
        let colour = colour(n, dark);
        let line = |directions: &mut dyn Iterator<Item = UnitVec3<Cam, f64>>| -> Vec<_> {
            directions.map(|d| globe.at(to_vehicle(d))).collect()
        };
        globe.line(&painter, &line(&mut border(&head.camera)), 1.2, colour);
        let Some(solution) = answer.as_ref().and_then(|answer| answer.solution.as_deref()) else { continue };
        let width = if view.used(view.epoch, n) == Use::Used { 2.6 } else { 1.6 };
        let limb = line(&mut around(solution.axis.xyz(), solution.half_angle_rad));
        globe.line(&painter, &limb, width, colour);
    }
    let joint = epoch.joint.axis_x.zip(epoch.joint.axis_y).zip(epoch.joint.axis_z);
    if let Some(((x, y), z)) = joint {
        let (at, is_near) = globe.at([x, y, z]);
        let colour = if is_near { theme::AXIS } else { theme::AXIS.gamma_multiply(0.5) };
        for arm in [vec2(8.0, 0.0), vec2(0.0, 8.0)] {
            painter.line_segment([at - arm, at + arm], Stroke::new(2.5, colour));
        }
    }
}

/// Draws the axes of the vehicle.
fn axes(globe: &Globe, painter: &egui::Painter, ui: &Ui) {
    let colour = ui.visuals().weak_text_color();
    for (name, d) in [("x", [1.0, 0.0, 0.0]), ("y", [0.0, 1.0, 0.0]), ("z", [0.0, 0.0, 1.0])] {
        let (at, is_near) = globe.at(d);
        let colour = if is_near { colour } else { colour.gamma_multiply(0.5) };
        painter.line_segment([globe.centre, at], Stroke::new(1.0, colour));
        painter.text(at, Align2::CENTER_CENTER, name, FontId::proportional(12.0), colour);
    }
}

/// Returns the border of the picture as directions of the camera; corners beyond the lens are left out.
fn border(camera: &Camera<f64>) -> impl Iterator<Item = UnitVec3<Cam, f64>> {
    let [w, h] = [camera.width(), camera.height()].map(|x| f64::from(x) - 1.0);
    let corners = [[0.0, 0.0], [w, 0.0], [w, h], [0.0, h], [0.0, 0.0]];
    let sides = corners.into_iter().zip(corners.into_iter().skip(1));
    let points = sides.flat_map(|(a, b)| {
        (0..=SIDE).map(move |n| [0, 1].map(|i| a[i] + (b[i] - a[i]) * f64::from(n) / f64::from(SIDE)))
    });
    points.filter_map(move |[u, v]| camera.unproject(ImagePoint { u, v }))
}

/// Returns the directions at an angle from an axis.
fn around(axis: [f64; 3], half_angle_rad: f64) -> impl Iterator<Item = UnitVec3<Cam, f64>> {
    let [x, y, z] = axis;
    // A direction that is not parallel to the axis.
    let other = if x.abs() < 0.7 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let cross = |[a, b, c]: [f64; 3], [d, e, f]: [f64; 3]| [b * f - c * e, c * d - a * f, a * e - b * d];
    let across = cross([x, y, z], other);
    let length = across.iter().map(|x| x * x).sum::<f64>().sqrt();
    let across = across.map(|x| x / length);
    let third = cross([x, y, z], across);
    let (sin, cos) = half_angle_rad.sin_cos();
    (0..=AROUND).filter_map(move |n| {
        let (s, c) = (std::f64::consts::TAU * f64::from(n) / f64::from(AROUND)).sin_cos();
        UnitVec3::try_new([0, 1, 2].map(|i| axis[i] * cos + (across[i] * c + third[i] * s) * sin))
    })
}
