//! The banner over the picture: a sensor that was opened for other pictures is used for these.

use egui::Ui;

use super::theme;
use super::viewer::{Leave, Viewer};
use crate::model::autosave::absolute;

/// Draws the banner until the user has decided.
pub(super) fn show(viewer: &mut Viewer, ui: &mut Ui) {
    let Some(session) = viewer.session.as_ref().filter(|_| viewer.changes.is_sensor_kept) else { return };
    let words = format!("Sensor of {} is used", absolute(session.home()).display());
    let is_ready = viewer.frame_view.as_ref().is_some_and(|f| f.size().is_some());
    let (mut keep, mut make) = (false, false);
    egui::Panel::top("kept sensor").resizable(false).show(ui, |ui| {
        ui.add_space(4.0);
        // The buttons follow the path on the next line if it is long.
        ui.horizontal_wrapped(|ui| {
            ui.colored_label(theme::warning(ui.visuals().dark_mode), words);
            keep = ui.button("Keep").on_hover_text("Use this sensor for these pictures, too").clicked();
            let hint = "Ends the use of this sensor, and opens the form for a sensor.toml of these pictures";
            make = ui.add_enabled(is_ready, egui::Button::new("Make a new one")).on_hover_text(hint).clicked();
        });
        ui.add_space(4.0);
    });
    if keep {
        viewer.changes.is_sensor_kept = false;
    } else if make {
        viewer.leave(Leave::NewSensor, None);
    }
}
