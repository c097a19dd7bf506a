//! Names of keys in texts, as links that open the card of the key.

use egui::{RichText, Ui};
use hzn_files::keys;

use super::panels::Panel;
use super::viewer::Viewer;

/// Draws an advice, which begins with its mark or number, with a link for each key that it names.
pub(super) fn tip(viewer: &mut Viewer, ui: &mut Ui, tip: &str) {
    ui.add(egui::Label::new(RichText::new(tip).size(12.5)).wrap());
    let named = named_keys(tip);
    if named.is_empty() {
        return;
    }
    ui.horizontal_wrapped(|ui| {
        for path in named {
            if ui.link(RichText::new(path).size(12.0)).on_hover_text("Show this key among the stages").clicked() {
                show_key(viewer, path);
            }
        }
    });
}

/// Opens the card of a key, and marks the key.
pub(super) fn show_key(viewer: &mut Viewer, path: &'static str) {
    viewer.panels.open(Panel::Stages, &mut viewer.settings);
    viewer.focus_key = Some(path);
}

/// Returns the keys that a text names, with or without their section.
fn named_keys(text: &str) -> Vec<&'static str> {
    let words = text.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_' || c == '.'));
    let mut found: Vec<&'static str> = Vec::new();
    for word in words.map(|w| w.trim_matches('.')).filter(|w| w.contains('_') || w.contains('.')) {
        let key = keys::all().find(|k| k.path == word || k.name() == word);
        found.extend(key.map(|k| k.path).filter(|p| !found.contains(p)));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_found_in_advice() {
        let tip = "lower gates.min_arc_px or raise gates.max_sigma_deg; check altitude_km (threshold.scale).";
        assert_eq!(named_keys(tip), ["gates.min_arc_px", "gates.max_sigma_deg", "body.altitude_km", "threshold.scale"]);
        assert!(named_keys("Is the limb in view?").is_empty());
    }
}
