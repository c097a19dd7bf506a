//! A shift of the altitudes of frames.csv or of a recording, on trial: all pictures are processed with it, and no file
//! changes.

use egui::{RichText, Ui};

use super::theme;
use super::viewer::Viewer;

/// Draws the shift that is on trial, and the button that ends it.
pub(super) fn show(viewer: &mut Viewer, ui: &mut Ui) {
    let shift_km = viewer.sequence.altitude_shift_km;
    if shift_km == 0.0 {
        return;
    }
    let border = egui::Stroke::new(1.0, theme::warning(ui.visuals().dark_mode));
    let frame = egui::Frame::new().fill(ui.visuals().faint_bg_color).stroke(border).corner_radius(6);
    frame.inner_margin(egui::Margin::symmetric(8, 6)).show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.strong("Trial of other altitudes");
        let what = format!(
            "All altitudes are shifted by {shift_km:+.1} km in this window. No file is changed. If the pictures have \
             answers now, correct the altitudes where they come from."
        );
        ui.add(egui::Label::new(RichText::new(what).size(12.5)).wrap());
        if ui.button("End the trial").clicked() {
            shift(viewer, -shift_km);
        }
    });
    ui.add_space(4.0);
}

/// Shifts the altitudes of all pictures, which are processed again.
pub(super) fn shift(viewer: &mut Viewer, by_km: f64) {
    viewer.sequence.shift_altitudes(by_km);
    for session in viewer.session.iter_mut().chain(viewer.other.iter_mut().map(|(_, session)| session)) {
        session.renew();
    }
}
