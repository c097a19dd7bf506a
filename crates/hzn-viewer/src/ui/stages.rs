//! The column of stages: what each did to the frame, and its parameters.

use egui::{Color32, ComboBox, RichText, Slider, SliderClamping, Ui, vec2};
use hzn_calib::keys::{self, Key, Limits};
use hzn_core::status::Status;
use toml_edit::Value;

use super::facts::{self, CARDS, Card};
use super::viewer::Viewer;
use super::{Command, theme};
use crate::model::{Knob, Session};
use crate::work::frame_view::{BodyResult, Outcome};

/// Width of the parameters' names.
const NAME_WIDTH: f32 = 136.0;

pub(super) fn show(viewer: &mut Viewer, ui: &mut Ui) {
    let width = viewer.settings.stages_width;
    let shown = egui::Panel::right("stages").default_size(width).size_range(300.0..=640.0).show(ui, |ui| {
        head(viewer, ui);
        ui.separator();
        if viewer.session.is_none() {
            return without(viewer, ui);
        }
        egui::ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            // Shared, not copied: an answer holds thousands of points.
            let outcome = viewer.sight.as_ref().and_then(|s| s.answers.first().cloned());
            for card in CARDS {
                one(viewer, ui, card, outcome.as_deref());
            }
            ui.add_space(8.0);
        });
        // A slider that was let go ends its step.
        if ui.input(|i| i.pointer.any_released())
            && let Some(session) = &mut viewer.session
            && viewer.mask.is_none()
        {
            session.settle();
        }
    });
    viewer.settings.stages_width = shown.response.rect.width();
}

/// There is no sensor: how to come by one.
fn without(viewer: &mut Viewer, ui: &mut Ui) {
    ui.label("What the sensor does with a picture, stage by stage, stands here once there is a sensor.toml.");
    ui.add_space(4.0);
    if ui.button("Open a sensor.toml…").clicked() {
        viewer.run(Command::Open, &ui.ctx().clone());
    }
    ui.add_space(4.0);
    ui.weak("hzn init writes one to start from; it can be dropped on the window, too.");
}

/// Preset, undo, redo, reset, save; and what is wrong.
fn head(viewer: &mut Viewer, ui: &mut Ui) {
    ui.add_space(5.0);
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
                        session.settle();
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
        button(ui, Command::Undo, "Undo", session.can_undo());
        button(ui, Command::Redo, "Redo", session.can_redo());
        let changed = session.is_changed();
        button(ui, Command::Diff, "Diff", changed);
        button(ui, Command::Save, "Save", changed);
    });
    if let Some(problem) = session.problem() {
        let text = match (&problem.field, problem.line) {
            (Some(field), _) => format!("{field}: {}", problem.what),
            (None, Some(line)) => format!("line {line}: {}", problem.what),
            _ => problem.what.clone(),
        };
        ui.colored_label(ui.visuals().error_fg_color, text).on_hover_text("The last values that were accepted count.");
    }
    if viewer.sight.as_ref().and_then(|s| s.answers.first()).is_some_and(|o| o.bodies.len() > 1) {
        bodies(viewer, ui);
    }
    if let Some(command) = command {
        viewer.run(command, &ui.ctx().clone());
    }
}

/// Which of several bodies is looked at.
fn bodies(viewer: &mut Viewer, ui: &mut Ui) {
    let names: Vec<(&str, Status)> = viewer
        .sight
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

fn one(viewer: &mut Viewer, ui: &mut Ui, card: &Card, outcome: Option<&Outcome>) {
    let answer = outcome.and_then(|o| o.bodies.get(viewer.body).or(o.bodies.first()));
    let time =
        card.stage.and_then(|stage| answer?.times.iter().find(|(s, t)| *s == stage && !t.is_zero()).map(|(_, t)| *t));
    let id = ui.make_persistent_id(("card", card.title));
    let mut state =
        egui::containers::collapsing_header::CollapsingState::load_with_default_open(ui.ctx(), id, card.open);
    let fill = ui.visuals().faint_bg_color;
    egui::Frame::new().fill(fill).corner_radius(6).inner_margin(egui::Margin::symmetric(8, 5)).show(ui, |ui| {
        ui.set_width(ui.available_width());
        let header = ui.horizontal(|ui| {
            let (icon, _) = ui.allocate_exact_size(vec2(14.0, 14.0), egui::Sense::hover());
            let dot = reached(card, answer);
            ui.painter().circle_filled(icon.center(), 4.5, dot);
            let title = ui.add(
                egui::Label::new(RichText::new(card.title).strong()).selectable(false).sense(egui::Sense::click()),
            );
            title.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, card.title));
            let mut clicked = title.clicked();
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let (rect, arrow) = ui.allocate_exact_size(vec2(14.0, 14.0), egui::Sense::click());
                egui::collapsing_header::paint_default_icon(
                    ui,
                    state.openness(ui.ctx()),
                    &arrow.clone().with_new_rect(rect),
                );
                clicked |= arrow.clicked();
                if let Some(time) = time {
                    ui.weak(format!("{:.0} µs", time.as_nanos() as f64 / 1e3))
                        .on_hover_text("Time of this stage while it is watched, which takes time too");
                }
            });
            clicked
        });
        if header.inner {
            state.toggle(ui);
        }
        state.store(ui.ctx());
        // What happened is always there; the parameters unfold.
        if let (Some(sight), Some(outcome), Some(answer)) = (&viewer.sight, outcome, answer) {
            for line in facts::lines(card, sight, outcome, answer) {
                ui.add(egui::Label::new(RichText::new(line).size(12.5)).wrap());
            }
        }
        if card.title == "Candidates"
            && let Some(answer) = answer
        {
            candidates(viewer, ui, answer);
        }
        if card.title == "Mask" {
            mask(viewer, ui);
        }
        state.show_body_unindented(ui, |ui| {
            ui.add_space(2.0);
            for section in card.sections {
                for key in keys::in_section(section) {
                    parameter(viewer, ui, key);
                }
            }
        });
    });
    ui.add_space(2.0);
}

/// The colour of a card's dot: whether the frame came as far as this.
fn reached(card: &Card, answer: Option<&BodyResult>) -> Color32 {
    let grey = Color32::from_rgb(110, 115, 124);
    let Some(Ok(report)) = answer.map(|a| a.report.as_ref()) else { return grey };
    match card.stage {
        Some(stage) if report.stage < stage => grey,
        Some(stage) if report.stage == stage && report.status != Status::Ok => theme::status(report.status),
        Some(_) => theme::status(Status::Ok),
        None => grey,
    }
}

/// The candidate edges: pointing at one shows it in the picture.
fn candidates(viewer: &mut Viewer, ui: &mut Ui, answer: &BodyResult) {
    let Ok(report) = &answer.report else { return };
    viewer.pointed = None;
    if report.candidates.is_empty() {
        return;
    }
    let select = viewer.sight.as_ref().and_then(|s| s.answers.first()).map(|o| o.config.select);
    egui::Grid::new("candidates").num_columns(6).spacing(vec2(10.0, 2.0)).show(ui, |ui| {
        for head in ["", "length", "points", "inliers", "RMS px", "verdict"] {
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
            let why = select.map(|s| hzn_run::explain::verdict_text(c.verdict, &s)).unwrap_or_default();
            row |= ui.label(RichText::new(c.verdict.name()).size(12.0)).on_hover_text(why);
            if row.hovered() || row.contains_pointer() {
                viewer.pointed = Some(c.number);
            }
            ui.end_row();
        }
    });
    let more = (report.counters.candidates as usize).saturating_sub(report.candidates.len());
    if more > 0 {
        ui.weak(format!("and {more} more, not listed"));
    }
}

fn mask(viewer: &mut Viewer, ui: &mut Ui) {
    if viewer.session.is_none() {
        return;
    }
    ui.horizontal(|ui| {
        let drawing = viewer.mask.is_some();
        if ui.selectable_label(drawing, if drawing { "Done" } else { "Draw the mask" }).clicked() {
            super::picture::toggle_mask(viewer);
        }
        if let Some(session) = &mut viewer.session
            && !session.polygons().is_empty()
            && ui.button("Clear").clicked()
        {
            session.set_polygons(&[]);
            session.settle();
        }
    });
}

/// One key of sensor.toml: a slider, a choice or a switch.
fn parameter(viewer: &mut Viewer, ui: &mut Ui, key: &Key) {
    let body = viewer.body;
    let Some(session) = &mut viewer.session else { return };
    if matches!(key.path, "mask.polygons_px" | "camera.file" | "camera.camera") {
        return;
    }
    let value = session.value(key.section(), key.name(), body).cloned();
    let method = session.value(key.section(), "method", body).and_then(|m| m.as_str().map(str::to_owned));
    // A key of another method changes nothing: it is not in the way.
    if key.method().is_some() && method.is_some() && key.method() != method.as_deref() {
        return;
    }
    let hint = hint(key);
    ui.horizontal(|ui| {
        let place = egui::Layout::left_to_right(egui::Align::Center);
        let name = ui
            .allocate_ui_with_layout(vec2(NAME_WIDTH, 18.0), place, |ui| {
                ui.set_min_width(NAME_WIDTH);
                ui.add(egui::Label::new(RichText::new(key.name()).size(12.5)).truncate())
            })
            .inner
            .on_hover_text(&hint);
        match (&key.limits, &value) {
            (Limits::Choice, Some(toml::Value::String(current))) => {
                ComboBox::from_id_salt(key.path)
                    .selected_text(current)
                    .width(130.0)
                    .show_ui(ui, |ui| {
                        for choice in key.choices {
                            if ui.selectable_label(choice.name == current, choice.name).clicked() {
                                session.set(key.section(), key.name(), body, Some(choice.name.into()));
                                session.settle();
                            }
                        }
                    })
                    .response
                    .labelled_by(name.id)
                    .on_hover_text(&hint);
            }
            (_, Some(toml::Value::Boolean(on))) => {
                let mut on = *on;
                if ui.checkbox(&mut on, "").labelled_by(name.id).on_hover_text(&hint).changed() {
                    session.set(key.section(), key.name(), body, Some(Value::from(on)));
                    session.settle();
                }
            }
            (limits, Some(toml::Value::Float(_) | toml::Value::Integer(_))) => {
                number(session, ui, key, body, limits, name.id, &hint);
            }
            (Limits::Number { .. }, None) => {
                // Left out: a click gives it a value to begin with.
                if ui.button("automatic").on_hover_text(format!("{hint}\nClick to set it.")).clicked()
                    && let Some(knob) = Knob::from_limits(&key.limits, session.usual(key.section(), key.name(), body))
                {
                    session.set_number(key, body, knob.middle());
                    session.settle();
                }
            }
            (_, Some(other)) => {
                let text = other.to_string();
                ui.add(egui::Label::new(RichText::new(text).size(12.0)).truncate());
            }
            (_, None) => {
                ui.weak("not set").on_hover_text(&hint);
            }
        }
        restore(session, ui, key, body);
    });
}

fn number(session: &mut Session, ui: &mut Ui, key: &Key, body: usize, limits: &Limits, name: egui::Id, hint: &str) {
    let Some(mut x) = session.number(key.section(), key.name(), body) else { return };
    let before = x;
    let whole = matches!(session.value(key.section(), key.name(), body), Some(toml::Value::Integer(_)));
    let unit = if key.unit().is_empty() { String::new() } else { format!(" {}", key.unit()) };
    let usual = session.usual(key.section(), key.name(), body);
    let response = match Knob::from_limits(limits, usual).filter(|_| key.section() != "camera") {
        Some(knob) => {
            ui.spacing_mut().slider_width = (ui.available_width() - 96.0).max(60.0);
            let mut slider = Slider::new(&mut x, knob.low..=knob.high)
                .logarithmic(knob.logarithmic)
                .clamping(SliderClamping::Never)
                .suffix(unit);
            if whole {
                slider = slider.integer();
            }
            if knob.logarithmic {
                slider = slider.smallest_positive((usual / 100.0).max(1e-4));
            }
            ui.add(slider)
        }
        None => {
            let speed = if whole { 1.0 } else { (x.abs() * 0.002).max(1e-5) };
            ui.add(egui::DragValue::new(&mut x).speed(speed).suffix(unit).max_decimals(if whole { 0 } else { 6 }))
        }
    };
    let response = response.labelled_by(name).on_hover_text(hint);
    if x != before {
        session.set_number(key, body, x);
    }
    if response.lost_focus() {
        session.settle();
    }
}

/// A value that the text holds can be taken out, so that the preset's counts.
fn restore(session: &mut Session, ui: &mut Ui, key: &Key, body: usize) {
    let differs = session.differs(key.section(), key.name(), body);
    if differs && ui.small_button("file").on_hover_text("Back to the file's value").clicked() {
        session.restore(key.section(), key.name(), body);
        session.settle();
    }
}

fn hint(key: &Key) -> String {
    let limits = match key.limits {
        Limits::Choice => String::new(),
        _ => format!("\n{}.", keys::limits_in_words(key).replace('`', "")),
    };
    let unit = if key.unit().is_empty() { String::new() } else { format!(" [{}]", key.unit()) };
    format!("{}{unit}: {}{limits}", key.path, key.sentence().replace('`', ""))
}
