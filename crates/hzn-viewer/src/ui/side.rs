//! The left column: the answer, how the picture is shown, and which overlays are drawn.

use egui::{Color32, RichText, Ui, vec2};
use hzn_core::status::Status;

use super::viewer::Viewer;
use super::{Command, facts, theme};
use crate::model::rows;
use crate::model::settings::{Layer, Look};
use crate::work::frame_view::{BodyResult, FrameView};

pub(super) fn show(viewer: &mut Viewer, ui: &mut Ui) {
    let width = viewer.settings.side_width;
    let shown = egui::Panel::left("side").default_size(width).size_range(180.0..=360.0).show(ui, |ui| {
        egui::ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            ui.add_space(6.0);
            answer(viewer, ui);
            ui.add_space(8.0);
            look(viewer, ui);
            ui.add_space(8.0);
            layers(viewer, ui);
        });
    });
    viewer.settings.side_width = shown.response.rect.width();
}

fn answer(viewer: &Viewer, ui: &mut Ui) {
    let Some(frame_view) = &viewer.frame_view else { return };
    let answer = viewer.answer();
    let status = match (&frame_view.picture, answer) {
        (Err(_), _) => Some(Status::Unreadable),
        (_, Some(answer)) => Some(answer.row.status),
        _ => None,
    };
    if let Some(status) = status {
        let colour = theme::status(status);
        let text = RichText::new(status.name()).strong().size(16.0).color(theme::text_on(colour));
        egui::Frame::new().fill(colour).corner_radius(5).inner_margin(egui::Margin::symmetric(10, 4)).show(ui, |ui| {
            ui.label(text);
        });
        if status != Status::Ok {
            for line in detail(frame_view, answer) {
                ui.add(egui::Label::new(RichText::new(line).size(12.0)).wrap());
            }
        }
    }
    let Some(answer) = answer else { return };
    egui::Grid::new("answer").num_columns(2).spacing(vec2(8.0, 2.0)).show(ui, |ui| {
        let mut row = |name: &str, value: String| {
            ui.weak(name);
            ui.label(RichText::new(value).monospace().size(12.0));
            ui.end_row();
        };
        if let Some(s) = answer.solution() {
            for (name, x) in ["axis x", "axis y", "axis z"].into_iter().zip(s.axis.xyz()) {
                row(name, format!("{x:+.6}"));
            }
            row("3σ", format!("{:.4}°", 3.0 * s.covariance.sigma_max_rad().to_degrees()));
            if let Some(truth) = viewer.truth_of(&frame_view.name, &answer.row.body)
                && let Some(error) = rows::error_deg(&answer.row, Some(truth))
            {
                row("error", format!("{error:.4}°"));
            }
            row("RMS", format!("{:.3} px", s.rms_px));
            row("inliers", s.inliers.to_string());
            if let Some(body) = &s.axis_body {
                let [roll, pitch] = hzn_mcap::roll_pitch_deg(body);
                row("roll", format!("{roll:.3}°"));
                row("pitch", format!("{pitch:.3}°"));
            }
        }
        row("time", format!("{:.0} µs", answer.elapsed.as_nanos() as f64 / 1e3));
        let recorded = viewer.rows.recorded(frame_view.index, viewer.body);
        if let Some(change) = recorded.and_then(|r| change(r, answer)) {
            row("moved", change);
        }
    });
}

/// Returns the angle between the answer and the file's answer as text, or whether only one of them is an answer.
fn change(recorded: &hzn_mcap::Row, answer: &BodyResult) -> Option<String> {
    match (recorded.axis(), answer.row.axis()) {
        (Some(a), Some(b)) => {
            let angle = rows::angle_deg(a, b);
            (angle > 1e-9).then(|| format!("{angle:.4}°"))
        }
        (None, Some(_)) => Some("answered now".into()),
        (Some(_), None) => Some("no answer now".into()),
        (None, None) => None,
    }
}

/// Returns why there is no answer, and the first advice.
fn detail(frame_view: &FrameView, answer: Option<&BodyResult>) -> Vec<String> {
    match (&frame_view.picture, answer) {
        (Err(why), _) => vec![why.clone()],
        (_, Some(answer)) => {
            let tips = answer.report.as_ref().map(hzn_run::explain::tips).unwrap_or_default();
            let tip = tips.first().map(|tip| format!("Try: {tip}"));
            [facts::shorten_detail(&answer.row.detail)].into_iter().chain(tip).collect()
        }
        _ => Vec::new(),
    }
}

fn look(viewer: &mut Viewer, ui: &mut Ui) {
    ui.horizontal(|ui| {
        for (look, command) in Look::ALL.into_iter().zip([Command::Colour, Command::Grey, Command::Level]) {
            let hint = format!("{} ({})", command.name(), command.key(ui.ctx()));
            if ui.selectable_label(viewer.settings.look == look, look.name()).on_hover_text(hint).clicked() {
                viewer.settings.look = look;
            }
        }
    });
    let hint = format!("As a pinhole would see it ({})", Command::Undistorted.key(ui.ctx()));
    ui.checkbox(&mut viewer.settings.undistorted, "Undistorted").on_hover_text(hint);
}

fn layers(viewer: &mut Viewer, ui: &mut Ui) {
    ui.horizontal(|ui| {
        ui.strong("Overlays");
        if viewer.layers_hidden && ui.small_button("show").clicked() {
            viewer.layers_hidden = false;
        }
    });
    ui.add_enabled_ui(!viewer.layers_hidden, |ui| {
        for layer in Layer::ALL {
            if layer == Layer::Truth && viewer.truth.is_empty() {
                continue;
            }
            ui.horizontal(|ui| {
                let mut on = viewer.settings.shows(layer);
                // These two layers can only be drawn in the plane of the camera.
                let own_plane = matches!(layer, Layer::Touched | Layer::Circle);
                let drawn = !(own_plane && viewer.settings.undistorted);
                let switch = ui.add_enabled(drawn, egui::Checkbox::new(&mut on, layer.name()));
                if switch
                    .on_disabled_hover_text("This overlay is drawn only if the picture is not undistorted")
                    .changed()
                {
                    viewer.settings.show(layer, on);
                }
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    let (rect, _) = ui.allocate_exact_size(vec2(18.0, 10.0), egui::Sense::hover());
                    ui.painter().rect_filled(rect, 2, colour(layer));
                });
            });
        }
    });
}

fn colour(layer: Layer) -> Color32 {
    match layer {
        Layer::Touched => theme::TOUCHED,
        Layer::Edges => theme::edge(0),
        Layer::Rejected => theme::REJECTED,
        Layer::Inliers => theme::INLIER,
        Layer::Limb => theme::LIMB,
        Layer::Axis => theme::AXIS,
        Layer::Sky => theme::SKY,
        Layer::Mask => theme::MASK,
        Layer::Circle => theme::CIRCLE,
        Layer::Truth => theme::TRUTH,
    }
}
