//! The parameters of a stage: each key of sensor.toml is a slider, a choice or a switch.

use egui::{ComboBox, Id, RichText, Slider, SliderClamping, Ui, vec2};
use hzn_files::keys::{self, Key, Limits};
use toml_edit::Value;

use super::viewer::Viewer;
use super::{camera_card, number};
use crate::model::{Session, SliderRange};

/// Width of the names of parameters.
const NAME_WIDTH: f32 = 136.0;
/// Width of the value behind a slider.
const VALUE_WIDTH: f32 = 96.0;
/// Width of the button that restores the file's value.
const RESTORE_WIDTH: f32 = 46.0;

/// Draws one key of sensor.toml.
pub(super) fn show(viewer: &mut Viewer, ui: &mut Ui, key: &'static Key) {
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
    let focused = viewer.focus_key == Some(key.path);
    let linked = viewer.linked_focal;
    // A change in this frame of the window shows its button in the next one, when the slider leaves room for it.
    // Otherwise the panel would grow.
    let differs = session.differs(key.section(), key.name(), body);
    let mut sweep = false;
    let is_number = SliderRange::from_limits(&key.limits, 1.0).is_some() && key.section() != "camera";
    let row = ui.horizontal(|ui| {
        let layout = egui::Layout::left_to_right(egui::Align::Center);
        let name = ui
            .allocate_ui_with_layout(vec2(NAME_WIDTH, 18.0), layout, |ui| {
                ui.set_min_width(NAME_WIDTH);
                let label = egui::Label::new(RichText::new(key.name()).size(12.5)).truncate();
                ui.add(label.sense(egui::Sense::click()))
            })
            .inner
            .on_hover_text(&hint);
        name.context_menu(|ui| {
            let entry = egui::Button::new(format!("Sweep {} over the sequence…", key.path));
            sweep = ui.add_enabled(is_number, entry).clicked();
        });
        let room = if differs { RESTORE_WIDTH } else { 0.0 };
        value(session, ui, key, body, name.id, &hint, linked, room);
        if differs {
            restore(session, ui, key, body);
        }
    });
    if focused {
        mark(viewer, ui, &row.response);
    }
    if key.path == "body.altitude_km" && viewer.sequence.has_altitudes() {
        ui.weak(
            RichText::new("The pictures have altitudes of their own (frames.csv), which are used instead.").size(12.0),
        );
    }
    if sweep {
        super::study::open(viewer, key);
    }
}

/// Marks the key that a link named, and scrolls to it. The mark goes with the next click.
fn mark(viewer: &mut Viewer, ui: &Ui, row: &egui::Response) {
    let colour = super::theme::warning(ui.visuals().dark_mode);
    ui.painter().rect_stroke(row.rect.expand(2.0), 4, egui::Stroke::new(1.5, colour), egui::StrokeKind::Outside);
    row.scroll_to_me(Some(egui::Align::Center));
    if ui.input(|i| i.pointer.any_pressed()) {
        viewer.focus_key = None;
    }
}

/// Draws the value of a key in the form that belongs to its type and its limits.
/// `room` is the width that stays free behind it.
fn value(session: &mut Session, ui: &mut Ui, key: &Key, body: usize, name: Id, hint: &str, linked: bool, room: f32) {
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
            number(session, ui, key, body, limits, name, hint, linked, room);
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
        (_, Some(toml::Value::Array(values))) if key.path == "camera.k" || !values.is_empty() => {
            array(session, ui, key, body, values, hint);
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

/// Draws a list of numbers, each of which can be edited. The coefficients of a lens can be added and removed.
fn array(session: &mut Session, ui: &mut Ui, key: &Key, body: usize, values: &[toml::Value], hint: &str) {
    let number = |v: &toml::Value| v.as_float().or(v.as_integer().map(|n| n as f64));
    let Some(mut numbers) = values.iter().map(number).collect::<Option<Vec<f64>>>() else {
        ui.add(egui::Label::new(RichText::new(format!("{} entries", values.len())).size(12.0)).truncate());
        return;
    };
    let before = numbers.clone();
    let mut ended = false;
    ui.vertical(|ui| {
        for (i, x) in numbers.iter_mut().enumerate() {
            let speed = (x.abs() * 0.005).max(1e-5);
            let drag = egui::DragValue::new(x).speed(speed).max_decimals(8).prefix(format!("{} ", i + 1));
            let response = number::drag(ui, drag).on_hover_text(hint);
            let name = format!("{} {}", key.name(), i + 1);
            response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::SpinButton, true, &name));
            ended |= response.lost_focus();
        }
        if key.path == "camera.k" {
            ui.horizontal(|ui| {
                if ui.small_button("Add").on_hover_text("Adds a coefficient of 0").clicked() {
                    numbers.push(0.0);
                }
                if !numbers.is_empty() && ui.small_button("Remove").clicked() {
                    numbers.pop();
                }
            });
        }
    });
    if numbers != before {
        session.set(key.section(), key.name(), body, Some(Value::from_iter(numbers)));
    }
    if ended {
        session.end_step();
    }
}

fn number(
    session: &mut Session,
    ui: &mut Ui,
    key: &Key,
    body: usize,
    limits: &Limits,
    name: Id,
    hint: &str,
    linked: bool,
    room: f32,
) {
    let Some(mut x) = session.number(key.section(), key.name(), body) else { return };
    let before = x;
    let is_whole = matches!(session.value(key.section(), key.name(), body), Some(toml::Value::Integer(_)));
    let unit = if key.unit().is_empty() { String::new() } else { format!(" {}", key.unit()) };
    let magnitude = session.usual_magnitude(key.section(), key.name(), body);
    let response = match SliderRange::from_limits(limits, magnitude).filter(|_| key.section() != "camera") {
        Some(range) => {
            ui.spacing_mut().slider_width = (ui.available_width() - VALUE_WIDTH - room).max(60.0);
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
            number::slide(ui, slider)
        }
        None => {
            let speed = if is_whole { 1.0 } else { (x.abs() * 0.002).max(1e-5) };
            let digits = if is_whole { 0 } else { 6 };
            number::drag(ui, egui::DragValue::new(&mut x).speed(speed).suffix(unit).max_decimals(digits))
        }
    };
    let response = response.labelled_by(name).on_hover_text(hint);
    match key.path {
        _ if x == before => {}
        "camera.fx_px" | "camera.fy_px" if x > 0.0 => camera_card::set_focal(session, key.name(), x, linked),
        _ => session.set_number(key, body, x),
    }
    if response.lost_focus() {
        session.end_step();
    }
}

/// Draws the button that restores the saved file's value of a key.
fn restore(session: &mut Session, ui: &mut Ui, key: &Key, body: usize) {
    if ui.small_button("file").on_hover_text("Restore the value of the file").clicked() {
        session.restore(key.section(), key.name(), body);
        session.end_step();
    }
}

fn hint(key: &Key) -> String {
    let limits = match key.limits {
        Limits::Choice => String::new(),
        _ => format!("\nAllowed: {}.", keys::limits_in_words(key).replace('`', "")),
    };
    let unit = if key.unit().is_empty() { String::new() } else { format!(" [{}]", key.unit()) };
    format!("{}{unit}: {}{limits}", key.path, key.sentence().replace('`', ""))
}
