//! Draws messages and the progress of work on files over the window, so that the panels keep their places.

use std::time::{Duration, Instant};

use egui::{Align2, Area, Frame, Id, Margin, Order, RichText, Ui, vec2};

use super::theme;
use super::viewer::Viewer;

/// Age from which a job is shown. A box for a shorter job would only flicker.
const NOTICED_AFTER: Duration = Duration::from_millis(200);
/// Largest width of a message, in points.
const WIDTH: f32 = 420.0;

/// Room in points for the text at the foot of the picture, which has up to two lines. It is always left free, because
/// a message that moved away from the pointer could not be closed.
const FOOT: f32 = 56.0;

/// Draws them at the lower right of the picture's area, above the text at its foot.
pub(super) fn show(viewer: &mut Viewer, ctx: &egui::Context, area: egui::Rect) {
    if let Some(next) = viewer.toasts.expire(Instant::now()) {
        ctx.request_repaint_after(next);
    }
    for job in &viewer.jobs {
        ctx.request_repaint_after(NOTICED_AFTER.saturating_sub(job.age()).max(Duration::from_millis(100)));
    }
    let jobs = viewer.jobs.iter().any(|j| j.age() >= NOTICED_AFTER);
    if viewer.toasts.len() == 0 && !jobs {
        return;
    }
    let width = WIDTH.min(area.width() - 16.0).max(160.0);
    Area::new(Id::unique("toasts"))
        .order(Order::Foreground)
        .pivot(Align2::RIGHT_BOTTOM)
        .fixed_pos(area.right_bottom() - vec2(8.0, FOOT))
        .show(ctx, |ui| {
            ui.set_width(width);
            messages(viewer, ui);
            progress(viewer, ui);
        });
}

fn boxed<R>(ui: &mut Ui, stroke: egui::Color32, add: impl FnOnce(&mut Ui) -> R) -> egui::InnerResponse<R> {
    let frame = Frame::new()
        .fill(ui.visuals().window_fill)
        .stroke(egui::Stroke::new(1.0, stroke))
        .corner_radius(6)
        .inner_margin(Margin::symmetric(10, 7))
        .shadow(ui.visuals().popup_shadow);
    frame.show(ui, |ui| {
        ui.set_width(ui.available_width());
        add(ui)
    })
}

fn messages(viewer: &mut Viewer, ui: &mut Ui) {
    let (mut closed, mut recover, mut kept) = (None, None, None);
    for (i, toast) in viewer.toasts.iter().enumerate() {
        let colour = if toast.bad { theme::warning(ui.visuals().dark_mode) } else { ui.visuals().text_color() };
        let shown = boxed(ui, colour, |ui| {
            ui.horizontal_top(|ui| {
                let room = ui.available_width() - 54.0;
                ui.allocate_ui(vec2(room, 18.0), |ui| {
                    ui.set_width(room);
                    ui.add(egui::Label::new(RichText::new(&toast.text).color(colour)).wrap());
                });
                if ui.small_button("Close").clicked() {
                    closed = Some(i);
                }
            });
            let hint = "Writes a complete recording next to it and opens that";
            if let Some(path) = &toast.recover
                && ui.button("Recover it").on_hover_text(hint).clicked()
            {
                recover = Some((i, path.clone()));
            }
        });
        if shown.response.contains_pointer() {
            kept = Some(i);
        }
    }
    if let Some(i) = kept {
        viewer.toasts.keep(i);
    }
    if let Some(i) = closed.or(recover.as_ref().map(|(i, _)| *i)) {
        viewer.toasts.remove(i);
    }
    if let Some((_, path)) = recover {
        viewer.recover(path);
    }
}

fn progress(viewer: &Viewer, ui: &mut Ui) {
    for job in viewer.jobs.iter().filter(|job| job.age() >= NOTICED_AFTER) {
        let border = ui.visuals().text_color();
        boxed(ui, border, |ui| {
            ui.horizontal(|ui| {
                let name = format!("Cancel {}", job.name.to_lowercase());
                let cancel = ui.add_enabled(!job.is_stopping(), egui::Button::new("Cancel").small());
                cancel.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &name));
                if cancel.clicked() {
                    job.stop();
                }
                ui.label(job.name);
                let room = (ui.available_width() - 4.0).max(40.0);
                ui.add(egui::ProgressBar::new(job.fraction()).desired_width(room).show_percentage());
            });
        });
    }
}
