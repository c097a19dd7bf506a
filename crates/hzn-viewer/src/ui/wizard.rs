//! Draws the form for a first sensor.toml.

use egui::{DragValue, Id, Modal, Ui};
use hzn_files::start::Body;

use super::viewer::Viewer;
use super::wizard_form::Wizard;
use super::{number, theme};

pub(super) fn show(viewer: &mut Viewer, ctx: &egui::Context) {
    let Some(mut wizard) = viewer.wizard.take() else { return };
    let (mut make, mut cancel) = (false, false);
    let outcome = wizard.write();
    let shown = Modal::new(Id::unique("wizard")).show(ctx, |ui| {
        ui.set_max_width(480.0);
        ui.heading("Make a sensor.toml");
        ui.label("Rough values are enough to begin: their sigmas become part of the covariance.");
        ui.add_space(6.0);
        questions(ui, &mut wizard);
        ui.add_space(6.0);
        match &outcome {
            Ok(start) => drop(ui.label(Wizard::sigmas_in_words(start))),
            Err(why) => drop(ui.colored_label(theme::warning(ui.visuals().dark_mode), why)),
        }
        ui.horizontal(|ui| {
            make = ui.add_enabled(outcome.is_ok(), egui::Button::new("Make sensor.toml")).clicked();
            cancel = ui.button("Cancel").clicked();
        });
    });
    match outcome {
        Ok(start) if make => viewer.begin_session(&start.text, start.warnings),
        _ if cancel || shown.should_close() => {}
        _ => viewer.wizard = Some(wizard),
    }
}

fn questions(ui: &mut Ui, wizard: &mut Wizard) {
    let [w, h] = wizard.size_px;
    egui::Grid::new("wizard").num_columns(2).spacing([12.0, 6.0]).show(ui, |ui| {
        ui.label("picture");
        let camera = wizard.exif.camera.clone().map(|c| format!(", {c}")).unwrap_or_default();
        ui.label(format!("{w} × {h} px{camera}"));
        ui.end_row();
        ui.label("lens");
        ui.horizontal(|ui| {
            ui.selectable_value(&mut wizard.fisheye, false, "pinhole").on_hover_text("Straight lines stay straight");
            ui.selectable_value(&mut wizard.fisheye, true, "fisheye").on_hover_text("Also for more than 90°");
        });
        ui.end_row();
        ui.label("focal length");
        ui.horizontal(|ui| {
            ui.selectable_value(&mut wizard.states_fov, true, "from the field of view");
            let known = wizard.exif.focal_mm.is_some() || wizard.exif.focal_35mm_mm.is_some();
            ui.add_enabled_ui(known, |ui| ui.selectable_value(&mut wizard.states_fov, false, "from EXIF"));
        });
        ui.end_row();
        if wizard.states_fov {
            let label = ui.label("field of view over the width");
            let drag = DragValue::new(&mut wizard.fov_deg).range(1.0..=300.0).speed(0.5).suffix("°");
            number::drag(ui, drag).labelled_by(label.id);
            ui.end_row();
        }
        ui.label("body");
        egui::ComboBox::from_id_salt("body").selected_text(wizard.body.name()).show_ui(ui, |ui| {
            for body in Body::all() {
                ui.selectable_value(&mut wizard.body, body, body.name());
            }
        });
        ui.end_row();
        ui.label("altitude");
        ui.horizontal(|ui| {
            ui.selectable_value(&mut wizard.one_altitude, true, "one for all pictures");
            let why = "There is no frames.csv with altitudes next to the pictures";
            ui.add_enabled_ui(wizard.has_altitudes, |ui| {
                let choice = ui.selectable_value(&mut wizard.one_altitude, false, "from frames.csv");
                choice.on_disabled_hover_text(why);
            });
        });
        ui.end_row();
        if wizard.one_altitude {
            let label = ui.label("altitude above the ground");
            let drag = DragValue::new(&mut wizard.altitude_km).range(1.0..=1e6).speed(1.0).suffix(" km");
            number::drag(ui, drag).labelled_by(label.id);
            ui.end_row();
        }
    });
}
