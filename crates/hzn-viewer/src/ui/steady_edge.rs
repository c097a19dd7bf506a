//! The card that offers to mask an edge of the vehicle.

use egui::{RichText, Ui};

use super::steady_offer::SteadyOffer;
use super::theme;
use super::viewer::Viewer;

/// Draws the offer, if there is one.
pub(super) fn show(viewer: &mut Viewer, ui: &mut Ui) {
    update(viewer);
    let Some(area) = viewer.steady.area.clone() else { return };
    let border = egui::Stroke::new(1.0, theme::warning(ui.visuals().dark_mode));
    let frame = egui::Frame::new().fill(ui.visuals().faint_bg_color).stroke(border).corner_radius(6);
    frame.inner_margin(egui::Margin::symmetric(8, 6)).show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.strong("An edge that does not move");
        let what = format!(
            "{:.0} % of the {} pictures with edges and without an answer have an edge at the same pixels, while the \
             limb moves. It is probably a part of the vehicle. The picture shows the area with a dashed line.",
            100.0 * area.part,
            area.pictures
        );
        ui.add(egui::Label::new(RichText::new(what).size(12.5)).wrap());
        let hint = "Adds the area to mask.polygons_px as one step for undo. M edits it.";
        if ui.button("Mask this").on_hover_text(hint).clicked()
            && let Some(session) = &mut viewer.session
        {
            let mut polygons = session.polygons();
            polygons.push(area.polygon);
            session.set_polygons(&polygons);
            session.end_step();
            viewer.steady = SteadyOffer::default();
        }
    });
    ui.add_space(4.0);
}

/// Looks for a steady edge again if the results have changed. While the mask is edited there is no offer.
fn update(viewer: &mut Viewer) {
    let Some(session) = viewer.session.as_ref().filter(|_| viewer.mask.is_none()) else {
        viewer.steady = SteadyOffer::default();
        return;
    };
    let generation = viewer.rows.generation();
    // An offer that comes and goes while pictures are processed would move everything below it.
    if viewer.steady.seen != Some(generation) && !viewer.is_working() {
        let area = viewer.rows.steady().find(&session.polygons());
        viewer.steady = SteadyOffer { seen: Some(generation), area };
    }
}
