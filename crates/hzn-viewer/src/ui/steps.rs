//! The list of what to do about a picture without an answer, in the order in which it helps.

use egui::{RichText, Ui};
use hzn_core::threshold;

use super::viewer::Viewer;
use super::{altitude_trial, links};
use crate::model::Session;
use crate::model::diagnosis::{Pair, Suspect};

/// One thing to do.
pub(super) enum Step {
    /// Set Otsu's threshold.
    Otsu(String),
    /// Correct two values at once.
    Both(String, Pair),
    /// What the user does elsewhere in the window.
    Say(String),
    /// Advice that may name keys.
    Tip(String),
}

/// Draws the list. An earlier step can change what the later ones say, so that the list begins with what hides the
/// rest.
pub(super) fn show(viewer: &mut Viewer, ui: &mut Ui, steps: &[Step]) {
    if steps.is_empty() {
        return;
    }
    ui.label(RichText::new("What to do, in this order:").size(12.5).strong());
    for (i, step) in steps.iter().enumerate() {
        let n = i + 1;
        match step {
            Step::Otsu(text) => {
                wrapped(ui, &format!("{n}. {text}"));
                let hint = "Sets threshold.method = \"otsu\" and threshold.scale = 1";
                if ui.button("Use Otsu's threshold").on_hover_text(hint).clicked() {
                    use_otsu(viewer);
                }
            }
            Step::Both(text, pair) => {
                wrapped(ui, &format!("{n}. {text}"));
                let hint = "Corrects both values. Altitudes of frames.csv are shifted on trial, and no file changes.";
                if ui.button("Apply both").on_hover_text(hint).clicked() {
                    correct_both(viewer, pair);
                }
            }
            Step::Say(text) => wrapped(ui, &format!("{n}. {text}")),
            Step::Tip(text) => links::tip(viewer, ui, &format!("{n}. {text}")),
        }
    }
    ui.add_space(3.0);
}

/// Draws a text that may have several lines.
pub(super) fn wrapped(ui: &mut Ui, text: &str) {
    ui.add(egui::Label::new(RichText::new(text).size(12.5)).wrap());
}

/// Sets Otsu's threshold without a factor.
fn use_otsu(viewer: &mut Viewer) {
    let body = viewer.body;
    let Some(session) = &mut viewer.session else { return };
    let name = threshold::Method::Otsu.name();
    session.set_all(&[("threshold", "method", Some(name.into())), ("threshold", "scale", None)], body);
}

/// Corrects two values: those of the sensor.toml in one step, and altitudes of frames.csv on trial.
fn correct_both(viewer: &mut Viewer, pair: &Pair) {
    let (body, has_altitudes) = (viewer.body, viewer.sequence.has_altitudes());
    let mut values: Vec<(&str, &str, Option<toml_edit::Value>)> = Vec::new();
    let mut shift_km = None;
    let Some(session) = &mut viewer.session else { return };
    let mut set = |section, name, change: &dyn Fn(f64) -> f64| {
        let now = session.number(section, name, body);
        values.extend(now.map(|now| (section, name, Some(Session::tidy_value(change(now))))));
    };
    for remedy in &pair.remedies {
        match remedy.suspect {
            Suspect::Altitude if has_altitudes => shift_km = Some(remedy.correction),
            Suspect::Altitude => set("body", "altitude_km", &|km| km + remedy.correction),
            Suspect::LimbHeight => set("body", "limb_height_km", &|km| km + remedy.correction),
            Suspect::Focal => {
                set("camera", "fx_px", &|px| px * remedy.correction);
                set("camera", "fy_px", &|px| px * remedy.correction);
            }
        }
    }
    session.set_all(&values, body);
    if let Some(km) = shift_km {
        altitude_trial::shift(viewer, km);
    }
}
