//! The parameters of a stage: each key of sensor.toml is a slider, a choice or a switch.

use egui::{ComboBox, Id, RichText, Slider, SliderClamping, Ui, vec2};
use hzn_calib::keys::{self, Key, Limits};
use toml_edit::Value;

use super::viewer::Viewer;
use crate::model::{Session, SliderRange};

/// Width of the names of parameters.
const NAME_WIDTH: f32 = 136.0;

/// Draws one key of sensor.toml.
pub(super) fn show(viewer: &mut Viewer, ui: &mut Ui, key: &Key) {
    let body = viewer.body;
    let Some(session) = &mut viewer.session else { return };
    if matches!(key.path, "mask.polygons_px" | "camera.file" | "camera.camera") {
        return;
    }
    let method = session.value(key.section(), "method", body).and_then(|m| m.as_str().map(str::to_owned));
    // A key of another method has no effect, so it is hidden.
    if key.method().is_some() && method.is_some() && key.method() != method.as_deref() {
        return;
    }
    let hint = hint(key);
    ui.horizontal(|ui| {
        let layout = egui::Layout::left_to_right(egui::Align::Center);
        let name = ui
            .allocate_ui_with_layout(vec2(NAME_WIDTH, 18.0), layout, |ui| {
                ui.set_min_width(NAME_WIDTH);
                ui.add(egui::Label::new(RichText::new(key.name()).size(12.5)).truncate())
            })
            .inner
            .on_hover_text(&hint);
        value(session, ui, key, body, name.id, &hint);
        restore(session, ui, key, body);
    });
}

/// Draws the value of a key in the form that belongs to its type and its limits.
fn value(session: &mut Session, ui: &mut Ui, key: &Key, body: usize, name: Id, hint: &str) {
    let value = session.value(key.section(), key.name(), body).cloned();
    match (&key.limits, &value) {
        (Limits::Choice, Some(toml::Value::String(current))) => choice(session, ui, key, body, current, name, hint),
        (_, Some(toml::Value::Boolean(on))) => {
            let mut on = *on;
            if ui.checkbox(&mut on, "").labelled_by(name).on_hover_text(hint).changed() {
                session.set(key.section(), key.name(), body, Some(Value::from(on)));
                session.end_step();
            }
        }
        (limits, Some(toml::Value::Float(_) | toml::Value::Integer(_))) => {
            number(session, ui, key, body, limits, name, hint);
        }
        (Limits::Number { .. }, None) => {
            // The key is not in the text; a click sets a first value.
            if ui.button("automatic").on_hover_text(format!("{hint}\nClick to set it.")).clicked()
                && let Some(range) =
                    SliderRange::from_limits(&key.limits, session.usual_magnitude(key.section(), key.name(), body))
            {
                session.set_number(key, body, range.middle());
                session.end_step();
            }
        }
        (_, Some(other)) => {
            let text = other.to_string();
            ui.add(egui::Label::new(RichText::new(text).size(12.0)).truncate());
        }
        (_, None) => {
            ui.weak("not set").on_hover_text(hint);
        }
    }
}

fn choice(session: &mut Session, ui: &mut Ui, key: &Key, body: usize, current: &str, name: Id, hint: &str) {
    ComboBox::from_id_salt(key.path)
        .selected_text(current)
        .width(130.0)
        .show_ui(ui, |ui| {
            for choice in key.choices {
                if ui.selectable_label(choice.name == current, choice.name).clicked() {
                    session.set(key.section(), key.name(), body, Some(choice.name.into()));
                    session.end_step();
                }
            }
        })
        .response
        .labelled_by(name)
        .on_hover_text(hint);
}

fn number(session: &mut Session, ui: &mut Ui, key: &Key, body: usize, limits: &Limits, name: Id, hint: &str) {
    let Some(mut x) = session.number(key.section(), key.name(), body) else { return };
    let before = x;
    let is_whole = matches!(session.value(key.section(), key.name(), body), Some(toml::Value::Integer(_)));
    let unit = if key.unit().is_empty() { String::new() } else { format!(" {}", key.unit()) };
    let magnitude = session.usual_magnitude(key.section(), key.name(), body);
    let response = match SliderRange::from_limits(limits, magnitude).filter(|_| key.section() != "camera") {
        Some(range) => {
            ui.spacing_mut().slider_width = (ui.available_width() - 96.0).max(60.0);
            let mut slider = Slider::new(&mut x, range.low..=range.high)
                .logarithmic(range.logarithmic)
                .clamping(SliderClamping::Never)
                .suffix(unit);
            if is_whole {
                slider = slider.integer();
            }
            if range.logarithmic {
                slider = slider.smallest_positive((magnitude / 100.0).max(1e-4));
            }
            ui.add(slider)
        }
        None => {
            let speed = if is_whole { 1.0 } else { (x.abs() * 0.002).max(1e-5) };
            ui.add(egui::DragValue::new(&mut x).speed(speed).suffix(unit).max_decimals(if is_whole { 0 } else { 6 }))
        }
    };
    let response = response.labelled_by(name).on_hover_text(hint);
    if x != before {
        session.set_number(key, body, x);
    }
    if response.lost_focus() {
        session.end_step();
    }
}

/// Draws the button that restores the saved file's value of a key.
fn restore(session: &mut Session, ui: &mut Ui, key: &Key, body: usize) {
    let differs = session.differs(key.section(), key.name(), body);
    if differs && ui.small_button("file").on_hover_text("Restore the value of the file").clicked() {
        session.restore(key.section(), key.name(), body);
        session.end_step();
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
