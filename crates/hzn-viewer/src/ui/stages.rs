//! The column of stages: the result of each stage for the picture, and its parameters.

use egui::collapsing_header::CollapsingState;
use egui::{Color32, ComboBox, RichText, Ui, vec2};
use hzn_core::status::Status;
use hzn_files::keys;

use super::facts::{self, CARDS, Card};
use super::panels::Panel;
use super::viewer::Viewer;
use super::{Command, altitude_trial, camera_card, diagnosis, histogram, parameters, steady_edge, theme};
use crate::work::frame_view::{BodyResult, Outcome};

/// Smallest width of the column in points.
const LEAST_WIDTH: f32 = 300.0;

pub(super) fn show(viewer: &mut Viewer, ui: &mut Ui) {
    // Most of a narrow window stays for the picture.
    let width = viewer.settings.stages_width.min(0.31 * ui.ctx().content_rect().width()).max(LEAST_WIDTH);
    let shown = egui::Panel::right("stages").default_size(width).size_range(LEAST_WIDTH..=640.0).show(ui, |ui| {
        contents(viewer, ui);
    });
    viewer.settings.stages_width = shown.response.rect.width();
}

/// Draws the column over the picture, at its right, because a narrow window has no room next to it.
pub(super) fn show_over(viewer: &mut Viewer, ctx: &egui::Context, picture: egui::Rect) {
    let rect = picture.shrink(6.0);
    let size = vec2(340.0_f32.min(rect.width()), rect.height());
    let area = egui::Area::new(egui::Id::unique("stages over")).order(egui::Order::Middle);
    area.pivot(egui::Align2::RIGHT_TOP).fixed_pos(rect.right_top()).show(ctx, |ui| {
        let frame = egui::Frame::window(ui.style()).inner_margin(egui::Margin::symmetric(8, 4));
        frame.show(ui, |ui| {
            ui.set_width(size.x - 18.0);
            ui.set_height(size.y - 12.0);
            contents(viewer, ui);
        });
    });
}

fn contents(viewer: &mut Viewer, ui: &mut Ui) {
    header(viewer, ui);
    ui.separator();
    if viewer.session.is_none() {
        return show_missing_sensor(viewer, ui);
    }
    theme::keep_scroll_bar_free(ui);
    viewer.scroll_area(Panel::Stages).show(ui, |ui| {
        // The answer is shared, not copied, because it holds thousands of points.
        let outcome = viewer.frame_view.as_ref().and_then(|s| s.answers.first().cloned());
        altitude_trial::show(viewer, ui);
        diagnosis::show(viewer, ui);
        steady_edge::show(viewer, ui);
        for card in CARDS {
            show_card(viewer, ui, card, outcome.as_deref());
        }
        ui.add_space(8.0);
    });
    // Releasing a slider ends its step.
    if ui.input(|i| i.pointer.any_released())
        && let Some(session) = &mut viewer.session
        && viewer.mask.is_none()
        && viewer.circle.is_none()
    {
        session.end_step();
    }
}

/// Says how to get a sensor.toml if there is none.
fn show_missing_sensor(viewer: &mut Viewer, ui: &mut Ui) {
    ui.label("With a sensor.toml, this column shows the result of every stage.");
    ui.add_space(4.0);
    let ready = viewer.frame_view.as_ref().is_some_and(|f| f.size().is_some());
    if ui.add_enabled(ready, egui::Button::new("Make a sensor.toml…")).clicked() {
        viewer.open_wizard();
    }
    if ui.button("Open a sensor.toml…").clicked() {
        viewer.run(Command::Open, &ui.ctx().clone());
    }
    ui.add_space(4.0);
    ui.weak("You can also drop a sensor.toml on the window.");
}

/// Draws preset, undo, redo, reset and save, and the error in the text.
fn header(viewer: &mut Viewer, ui: &mut Ui) {
    ui.add_space(5.0);
    let (can_undo, can_redo) = (viewer.can_undo(), viewer.can_redo());
    let Some(session) = &mut viewer.session else {
        ui.horizontal(|ui| {
            ui.strong("Stages");
        });
        return;
    };
    let mut command = None;
    ui.horizontal(|ui| {
        let label = ui.label("preset");
        let key = keys::find("preset");
        let current = session.preset().to_owned();
        ComboBox::from_id_salt("preset")
            .selected_text(&current)
            .width(104.0)
            .show_ui(ui, |ui| {
                for choice in key.map_or(&[][..], |key| key.choices) {
                    if ui.selectable_label(choice.name == current, choice.name).clicked() {
                        session.set("", "preset", 0, Some(choice.name.into()));
                        session.end_step();
                    }
                }
            })
            .response
            .labelled_by(label.id);
        let mut button = |ui: &mut Ui, c: Command, text: &str, on: bool| {
            let hint = format!("{} ({})", c.name(), c.key(ui.ctx()));
            if ui.add_enabled(on, egui::Button::new(text)).on_hover_text(hint).clicked() {
                command = Some(c);
            }
        };
        button(ui, Command::Undo, "Undo", can_undo);
        button(ui, Command::Redo, "Redo", can_redo);
        let changed = session.is_changed();
        button(ui, Command::Diff, "Changes", session.sheet() != session.on_file());
        button(ui, Command::Save, "Save", changed);
    });
    if let Some(problem) = session.problem() {
        let text = match (&problem.field, problem.line) {
            (Some(field), _) => format!("{field}: {}", problem.what),
            (None, Some(line)) => format!("line {line}: {}", problem.what),
            _ => problem.what.clone(),
        };
        let colour = ui.visuals().error_fg_color;
        let label = egui::Label::new(RichText::new(text).color(colour)).wrap();
        ui.add(label).on_hover_text("The last accepted values are in use.");
    }
    if viewer.frame_view.as_ref().and_then(|s| s.answers.first()).is_some_and(|o| o.bodies.len() > 1) {
        bodies(viewer, ui);
    }
    if let Some(command) = command {
        viewer.run(command, &ui.ctx().clone());
    }
}

/// Draws the choice between several bodies.
fn bodies(viewer: &mut Viewer, ui: &mut Ui) {
    let names: Vec<(&str, Status)> = viewer
        .frame_view
        .iter()
        .flat_map(|s| s.answers.first())
        .flat_map(|o| &o.bodies)
        .map(|b| (b.kind.name(), b.row.status))
        .collect();
    ui.horizontal(|ui| {
        for (i, (name, status)) in names.into_iter().enumerate() {
            if ui.selectable_label(viewer.body == i, format!("{name}: {status}")).clicked() {
                viewer.body = i;
            }
        }
    });
}

/// Draws a card: its header, the results of its stage, and the parameters, which unfold.
fn show_card(viewer: &mut Viewer, ui: &mut Ui, card: &Card, outcome: Option<&Outcome>) {
    let answer = outcome.and_then(|o| o.bodies.get(viewer.body).or(o.bodies.first())).map(|shared| &**shared);
    let id = ui.make_persistent_id(("card", card.title));
    let mut state = CollapsingState::load_with_default_open(ui.ctx(), id, card.open);
    let focus = viewer.focus_key.filter(|path| card.sections.contains(&path.split('.').next().unwrap_or_default()));
    if focus.is_some() {
        state.set_open(true);
    }
    let fill = ui.visuals().faint_bg_color;
    egui::Frame::new().fill(fill).corner_radius(6).inner_margin(egui::Margin::symmetric(8, 5)).show(ui, |ui| {
        ui.set_width(ui.available_width());
        if card_header(ui, card, answer, state.openness(ui.ctx())) {
            state.toggle(ui);
        }
        state.store(ui.ctx());
        // The results are always visible; the parameters unfold.
        if let (Some(frame_view), Some(outcome), Some(answer)) = (&viewer.frame_view, outcome, answer) {
            for line in facts::lines(card, frame_view, outcome, answer) {
                ui.add(egui::Label::new(RichText::new(line).size(12.5)).wrap());
            }
        }
        if card.title == "Edge points"
            && let Some(answer) = answer
        {
            candidates(viewer, ui, answer);
        }
        match card.title {
            "Mask" => mask(viewer, ui),
            "Threshold" => histogram::show(viewer, ui),
            _ => {}
        }
        state.show_body_unindented(ui, |ui| {
            ui.add_space(2.0);
            if card.sections.contains(&"camera") {
                camera_card::show(viewer, ui);
            }
            for section in card.sections {
                for key in keys::in_section(section) {
                    parameters::show(viewer, ui, key);
                }
            }
        });
    });
    ui.add_space(2.0);
}

/// Draws the dot, the title, the time and the arrow of a card. Returns true if the card is to unfold or to fold.
fn card_header(ui: &mut Ui, card: &Card, answer: Option<&BodyResult>, openness: f32) -> bool {
    let time =
        card.stage.and_then(|stage| answer?.times.iter().find(|(s, t)| *s == stage && !t.is_zero()).map(|(_, t)| *t));
    let header = ui.horizontal(|ui| {
        let (icon, _) = ui.allocate_exact_size(vec2(14.0, 14.0), egui::Sense::hover());
        let dot = reached_colour(card, answer);
        ui.painter().circle_filled(icon.center(), 4.5, dot);
        let title =
            ui.add(egui::Label::new(RichText::new(card.title).strong()).selectable(false).sense(egui::Sense::click()));
        title.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, card.title));
        let mut clicked = title.clicked();
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            let (rect, arrow) = ui.allocate_exact_size(vec2(14.0, 14.0), egui::Sense::click());
            egui::collapsing_header::paint_default_icon(ui, openness, &arrow.clone().with_new_rect(rect));
            clicked |= arrow.clicked();
            if let Some(time) = time {
                ui.weak(format!("{:.0} µs", time.as_nanos() as f64 / 1e3))
                    .on_hover_text("Time of this stage, including the time of the observer");
            }
        });
        clicked
    });
    header.inner
}

/// Returns the colour of a card's dot, which shows whether the picture reached the stage.
fn reached_colour(card: &Card, answer: Option<&BodyResult>) -> Color32 {
    let grey = Color32::from_rgb(110, 115, 124);
    let Some(Ok(report)) = answer.map(|a| a.report.as_ref()) else { return grey };
    match card.stage {
        Some(stage) if report.stage < stage => grey,
        Some(stage) if report.stage == stage && report.status != Status::Ok => theme::status(report.status),
        Some(_) => theme::status(Status::Ok),
        None => grey,
    }
}

/// Lists the candidate edges. The picture highlights the one under the pointer.
fn candidates(viewer: &mut Viewer, ui: &mut Ui, answer: &BodyResult) {
    let Ok(report) = &answer.report else { return };
    viewer.pointed = None;
    if report.candidates.is_empty() {
        return;
    }
    let select = viewer.frame_view.as_ref().and_then(|s| s.answers.first()).map(|o| o.config.gates);
    egui::Grid::new("candidates").num_columns(7).spacing(vec2(10.0, 2.0)).show(ui, |ui| {
        for head in ["", "length px", "points", "inliers", "RMS px", "verdict", ""] {
            ui.weak(RichText::new(head).size(11.5));
        }
        ui.end_row();
        for c in &report.candidates {
            let (rect, mut row) = ui.allocate_exact_size(vec2(12.0, 12.0), egui::Sense::hover());
            ui.painter().rect_filled(rect.shrink(1.0), 2, theme::edge(c.number));
            let rms = if c.rms_px.is_finite() { format!("{:.2}", c.rms_px) } else { "–".into() };
            for text in [c.length_px.to_string(), c.points.to_string(), c.inliers.to_string(), rms] {
                row |= ui.label(RichText::new(text).size(12.0));
            }
            let why = select.map(|s| hzn_run::explain::verdict_text(c.verdict, &s, answer.kind)).unwrap_or_default();
            row |= ui.label(RichText::new(c.verdict.name()).size(12.0)).on_hover_text(why);
            if row.hovered() || row.contains_pointer() {
                viewer.pointed = Some(c.number);
            }
            let chosen = viewer.chosen_candidate == Some(c.number);
            let fitted = answer.edges.iter().any(|e| e.candidate == c.number && e.fitted.is_some());
            let button = ui.add_enabled(fitted, egui::Button::selectable(chosen, "residuals").small());
            if button.on_disabled_hover_text("No cone was fitted to this edge").clicked() {
                viewer.chosen_candidate = (!chosen).then_some(c.number);
            }
            ui.end_row();
        }
    });
    let more = (report.counters.candidates as usize).saturating_sub(report.candidates.len());
    if more > 0 {
        ui.weak(format!("{more} more are not listed"));
    }
}

fn mask(viewer: &mut Viewer, ui: &mut Ui) {
    if viewer.session.is_none() {
        return;
    }
    ui.horizontal(|ui| {
        let drawing = viewer.mask.is_some();
        if ui.selectable_label(drawing, if drawing { "Done" } else { "Draw the mask" }).clicked() {
            viewer.toggle_mask();
        }
        if let Some(session) = &mut viewer.session
            && !session.polygons().is_empty()
            && ui.button("Clear").clicked()
        {
            session.set_polygons(&[]);
            session.end_step();
        }
    });
}
