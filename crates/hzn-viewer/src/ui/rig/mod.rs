//! The window on a rig: the pictures of all heads at one epoch, the same on one sphere, and the check over time.

mod check;
mod colours;
mod pictures;
mod sphere;

use egui::Ui;
use hzn_core::status::Status;

use super::rig_view::{RigView, Use};
use super::theme;
use super::viewer::Viewer;
use colours::use_colour;

/// Width of the column with the sphere, in points, and its largest part of the window.
const COLUMN: f32 = 340.0;
const COLUMN_PART: f32 = 0.32;
/// Part of the height that the plot of the check takes.
const CHECK_PART: f32 = 0.27;

/// Draws everything below the bar at the top.
pub(super) fn show(viewer: &mut Viewer, ui: &mut Ui) {
    let Some(mut view) = viewer.rig.take() else { return };
    for (text, is_problem) in view.poll(ui.ctx()) {
        if is_problem { viewer.add_problem(text) } else { viewer.add_note(text) }
    }
    egui::Panel::top("rig").show(ui, |ui| {
        ui.add_space(4.0);
        ui.horizontal_wrapped(|ui| headline(&mut view, ui));
        ui.add_space(4.0);
    });
    let size = ui.available_size();
    egui::Panel::bottom("check").resizable(false).exact_size((CHECK_PART * size.y).max(150.0)).show(ui, |ui| {
        check::show(&mut view, ui);
    });
    egui::Panel::right("sphere").resizable(false).exact_size(COLUMN.min(COLUMN_PART * size.x)).show(ui, |ui| {
        sphere::show(&mut view, ui);
    });
    egui::CentralPanel::default().show(ui, |ui| pictures::show(&view, ui));
    viewer.rig = Some(view);
}

/// Draws the player and the joint answer.
fn headline(view: &mut RigView, ui: &mut Ui) {
    let dark = ui.visuals().dark_mode;
    let count = view.epochs.len();
    let step = |ui: &mut Ui, text: &str, name: &str, on: bool| {
        let response = ui.add_enabled(on, egui::Button::new(text));
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, on, name));
        response.on_hover_text(name).clicked()
    };
    if step(ui, "Back", "Previous epoch", view.epoch > 0) {
        view.go(view.epoch.saturating_sub(1));
    }
    if step(ui, "Next", "Next epoch", view.epoch + 1 < count) {
        view.go(view.epoch + 1);
    }
    let Some(epoch) = view.epochs.get(view.epoch) else {
        ui.weak(if view.is_complete { "no epoch" } else { "opening the heads…" });
        return;
    };
    let more = if view.is_complete { "" } else { "…" };
    let time = epoch.joint.time_s.map(|s| format!(", {s:.3} s")).unwrap_or_default();
    ui.strong(format!("epoch {} of {count}{more}{time}", view.epoch + 1));
    ui.separator();
    let status = epoch.joint.status;
    ui.colored_label(theme::status(status), status.name());
    if let Some(sigma_deg) = epoch.joint.sigma_max_deg {
        ui.label(format!("3σ {:.4}°", 3.0 * sigma_deg));
    }
    if let Some((own, limit)) = epoch.joint.separation_deg.zip(epoch.joint.separation_limit_deg) {
        ui.label(format!("separation {own:.4}°, limit {limit:.4}°"));
    }
    if let Some(heads) = epoch.joint.heads_excluded.as_ref().filter(|heads| !heads.is_empty()) {
        ui.colored_label(use_colour(Use::Excluded, dark), format!("excluded: {heads}"));
    }
    if status != Status::Ok {
        ui.weak(&epoch.joint.detail);
    }
}
