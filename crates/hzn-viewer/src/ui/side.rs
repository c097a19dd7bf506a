//! The left column: the answer, how the picture is shown, and which overlays are drawn.

use egui::{Color32, Rect, RichText, Ui, vec2};
use hzn_core::status::Status;
use hzn_run::overlay::caption::shorten_detail;
use hzn_run::unread::Unread;

use super::panels::Panel;
use super::viewer::Viewer;
use super::{Command, camera_card, number, theme};
use crate::model::quantity;
use crate::model::settings::{Contrast, Layer, Look};
use crate::work::frame_view::{BodyResult, FrameView};

pub(super) fn show(viewer: &mut Viewer, ui: &mut Ui) {
    // At most a quarter of a small window goes to this column.
    let most = (ui.ctx().content_rect().width() * 0.25).clamp(160.0, 360.0);
    let width = viewer.settings.side_width.min(most);
    let shown = egui::Panel::left("side").default_size(width).size_range(160.0..=most).show(ui, |ui| {
        theme::keep_scroll_bar_free(ui);
        viewer.scroll_area(Panel::Answer).show(ui, |ui| {
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

/// Draws a status as a badge.
fn badge(ui: &mut Ui, text: &str, colour: Color32) {
    let text = RichText::new(text).strong().size(16.0).color(theme::text_on(colour));
    egui::Frame::new().fill(colour).corner_radius(5).inner_margin(egui::Margin::symmetric(10, 4)).show(ui, |ui| {
        ui.label(text);
    });
}

fn small(ui: &mut Ui, text: &str) {
    ui.add(egui::Label::new(RichText::new(text).size(12.0)).wrap());
}

/// Draws what is wrong with the sensor.toml or with the size of the picture, and the cure. Returns true if there is no
/// answer for this reason.
fn trouble(viewer: &mut Viewer, ui: &mut Ui) -> bool {
    let problem = viewer.session.as_ref().and_then(|s| s.problem()).cloned();
    if let (Some(problem), Some(session)) = (problem, &mut viewer.session) {
        badge(ui, "invalid sensor.toml", theme::status(Status::Unreadable));
        small(ui, &problem.to_string());
        // A field is named as `[section] key`.
        let named = problem.field.as_deref().and_then(|field| field.strip_prefix('[')?.split_once("] "));
        ui.horizontal_wrapped(|ui| {
            if session.is_changed() && ui.button("Undo").clicked() {
                session.undo();
            }
            if let Some((section, name)) = named
                && ui.button(format!("Remove {section}.{name}")).on_hover_text("The default applies then").clicked()
            {
                session.set(section, name, viewer.body, None);
                session.end_step();
            }
        });
        if session.config().is_none() {
            return true;
        }
    }
    let refused = viewer.frame_view.as_ref().and_then(|f| Some((f.answers.first()?.refused.clone()?, f.size()?)));
    let Some((why, [w, h])) = refused else { return false };
    let cause = Unread::of_detail(&why);
    let is_of_picture = matches!(cause, Unread::Size | Unread::Channel);
    badge(ui, if is_of_picture { cause.name() } else { "unusable sensor" }, theme::status(Status::Unreadable));
    small(ui, &why);
    if let Some(session) = viewer.session.as_mut().filter(|_| cause == Unread::Size)
        && ui.button(format!("Scale the camera to {w:.0} × {h:.0}")).clicked()
    {
        camera_card::scale_to(session, [w as u32, h as u32]);
    }
    true
}

/// Shows the status, and how far a known truth is away.
fn say_status(viewer: &mut Viewer, ui: &mut Ui, frame_view: &FrameView, answer: Option<&BodyResult>, status: Status) {
    let row = answer.map(|a| &a.row).filter(|_| status == Status::Ok);
    let truth = row.and_then(|row| viewer.truth_of(&frame_view.name, &row.body));
    let sigmas = row.and_then(|row| quantity::error_sigmas(row, truth));
    let misses = row.is_some_and(|row| quantity::misses_truth(row, truth));
    let high_rms = row.zip(viewer.missed.expected_rms).and_then(|(row, expected)| expected.exceeded_by(row));
    let is_conspicuous = misses || high_rms.is_some();
    badge(ui, status.name(), if is_conspicuous { theme::MISSED } else { theme::status(status) });
    high_rms.iter().for_each(|line| small(ui, line));
    if let Some(sigmas) = sigmas.filter(|_| misses) {
        small(ui, &format!("The error is {sigmas:.1} σ: the truth lies outside of 3σ."));
    }
    if status != Status::Ok {
        detail(frame_view, answer).iter().for_each(|line| small(ui, line));
        let hint = "Shows the diagnosis among the stages";
        if answer.is_some() && ui.link("Why, and what to do").on_hover_text(hint).clicked() {
            viewer.panels.open(Panel::Stages, &mut viewer.settings);
            viewer.focus_diagnosis = true;
        }
    }
}

fn answer(viewer: &mut Viewer, ui: &mut Ui) {
    if trouble(viewer, ui) {
        return;
    }
    let Some(frame_view) = viewer.frame_view.clone() else { return };
    let shared = viewer.answer().cloned();
    let answer = shared.as_deref();
    let status = match (&frame_view.picture, answer) {
        (Err(_), _) => Some(Status::Unreadable),
        (_, Some(answer)) => Some(answer.row.status),
        _ => None,
    };
    if let Some(status) = status {
        say_status(viewer, ui, &frame_view, answer, status);
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
                && let Some(error) = quantity::error_deg(&answer.row, Some(truth))
            {
                row("error (truth)", format!("{error:.4}°"));
            }
            row("RMS", format!("{:.3} px", s.rms_px));
            row("inliers", s.inliers.to_string());
            if let (Some(p_limb), Some(level_deg)) = (s.p_limb, answer.row.protection_deg) {
                row("p (limb)", format!("{p_limb:.4}"));
                row("protection", format!("{level_deg:.4}°"));
            }
            if let Some(body) = &s.axis_vehicle {
                let [roll, pitch] = hzn_mcap::roll_pitch_deg(body);
                row("roll", format!("{roll:.3}°"));
                row("pitch", format!("{pitch:.3}°"));
            }
        }
        row("processing", format!("{:.0} µs", answer.elapsed.as_nanos() as f64 / 1e3));
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
            let angle = quantity::angle_deg(a, b);
            (angle > 1e-9).then(|| format!("{angle:.4}°"))
        }
        (None, Some(_)) => Some("answered now".into()),
        (Some(_), None) => Some("no answer now".into()),
        (None, None) => None,
    }
}

/// Returns why there is no answer, in numbers where there are some.
fn detail(frame_view: &FrameView, answer: Option<&BodyResult>) -> Vec<String> {
    match (&frame_view.picture, answer) {
        (Err(why), _) => vec![why.clone()],
        (_, Some(answer)) => {
            let fit = answer.fit.map(|fit| {
                let (fitted, expected) = (fit.fitted_deg, fit.expected_deg);
                format!("half-angle {fitted:.2}° fitted, {expected:.2}° expected: {:+.1} σ", fit.sigmas)
            });
            [shorten_detail(&answer.row.detail)].into_iter().chain(fit).collect()
        }
        _ => Vec::new(),
    }
}

fn look(viewer: &mut Viewer, ui: &mut Ui) {
    let bits = viewer.frame_view.as_ref().and_then(|f| Some(f.picture.as_ref().ok()?.layout.bits));
    ui.horizontal_wrapped(|ui| {
        let commands = [Command::Colour, Command::Grey, Command::Level, Command::FalseColour];
        for (look, command) in Look::ALL.into_iter().zip(commands) {
            let hint = format!("{} ({})", command.name(), command.key(ui.ctx()));
            if ui.selectable_label(viewer.settings.look == look, look.name()).on_hover_text(hint).clicked() {
                viewer.settings.look = look;
            }
        }
    });
    let mut stretched = viewer.settings.contrast.stretches(bits.unwrap_or(8));
    let hint = "Shows the darkest pixels black and the brightest white; the sensor sees the picture as it is";
    if ui.checkbox(&mut stretched, "Auto contrast").on_hover_text(hint).changed() {
        viewer.settings.contrast = if stretched { Contrast::Stretched } else { Contrast::Full };
    }
    ui.horizontal(|ui| {
        let label = ui.label("gamma");
        let drag = egui::DragValue::new(&mut viewer.settings.gamma).range(0.3..=4.0).speed(0.02).max_decimals(2);
        number::drag(ui, drag).labelled_by(label.id).on_hover_text("Above 1, dark parts are shown brighter");
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
        let has_grid = viewer.frame_view.as_ref().is_some_and(|f| f.grid().is_some());
        for layer in Layer::ALL {
            if (layer == Layer::Truth && viewer.truth.is_empty())
                || (layer == Layer::Lens && viewer.companions.residuals.is_none())
                || (layer == Layer::Grid && !has_grid)
            {
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
                    for (part, colour) in split(rect, &colours(layer)) {
                        ui.painter().rect_filled(part, 2, colour);
                    }
                });
            });
        }
    });
}

/// Returns the colours of a layer: each candidate has its own.
fn colours(layer: Layer) -> Vec<Color32> {
    if layer == Layer::Edges { (0..4).map(theme::edge).collect() } else { vec![colour(layer)] }
}

/// Divides a rectangle into equal columns, one for each colour.
fn split(rect: Rect, colours: &[Color32]) -> impl Iterator<Item = (Rect, Color32)> {
    let width = rect.width() / colours.len().max(1) as f32;
    let left = move |n: usize| rect.left() + width * n as f32;
    let part = move |n: usize| Rect::from_x_y_ranges(left(n)..=left(n + 1), rect.y_range());
    colours.iter().enumerate().map(move |(n, colour)| (part(n), *colour))
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
        Layer::Grid => theme::GRID,
        Layer::Vertical => theme::VERTICAL,
        Layer::Mask => theme::MASK,
        Layer::Circle => theme::CIRCLE,
        Layer::Truth => theme::TRUTH,
        Layer::Lens => theme::LENS,
    }
}
