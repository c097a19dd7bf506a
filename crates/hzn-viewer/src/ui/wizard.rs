//! Draws the form for a first sensor.toml.

use egui::{DragValue, Id, Modal, Ui};
use hzn_files::start::Body;

use super::viewer::Viewer;
use super::wizard_form::{FocalFrom, Wizard};
use super::{number, theme};

/// What the form says before the limb is measured.
const FROM_LIMB: &str = "The limb in the pictures says lens and field of view, if the altitude is right. This takes \
                         some seconds.";

pub(super) fn show(viewer: &mut Viewer, ctx: &egui::Context) {
    let Some(mut wizard) = viewer.wizard.take() else { return };
    let (mut make, mut cancel) = (false, false);
    // Without a lens, the file is made from the pictures once the user wants it.
    let outcome = (wizard.focal_from != FocalFrom::Limb).then(|| wizard.write());
    let can_make = outcome.as_ref().map_or(wizard.measuring.is_none(), Result::is_ok);
    let shown = Modal::new(Id::unique("wizard")).show(ctx, |ui| {
        ui.set_max_width(480.0);
        ui.heading("Make a sensor.toml");
        ui.label("Rough values are enough to begin: their sigmas become part of the covariance.");
        ui.add_space(6.0);
        ui.add_enabled_ui(wizard.measuring.is_none(), |ui| questions(ui, &mut wizard));
        ui.add_space(6.0);
        let warning = theme::warning(ui.visuals().dark_mode);
        match &outcome {
            Some(Ok(start)) => drop(ui.label(Wizard::sigmas_in_words(start))),
            Some(Err(why)) => drop(ui.colored_label(warning, why)),
            None => of_limb(ui, &wizard),
        }
        ui.horizontal(|ui| {
            make = ui.add_enabled(can_make, egui::Button::new("Make sensor.toml")).clicked();
            cancel = ui.button("Cancel").clicked();
        });
    });
    match outcome {
        Some(Ok(start)) if make => return viewer.begin_session(&start.text, start.warnings),
        None if make => viewer.measure_lens(&mut wizard),
        _ if cancel || shown.should_close() => return,
        _ => {}
    }
    viewer.wizard = Some(wizard);
}

/// Says how far the measurement of the lens is.
fn of_limb(ui: &mut Ui, wizard: &Wizard) {
    if wizard.measuring.is_some() {
        ui.horizontal(|ui| {
            ui.spinner();
            ui.label("The limb in the pictures is measured…");
        });
    } else if let Some(why) = &wizard.no_lens {
        ui.colored_label(theme::warning(ui.visuals().dark_mode), why);
    } else {
        ui.label(FROM_LIMB);
    }
}

fn questions(ui: &mut Ui, wizard: &mut Wizard) {
    let [w, h] = wizard.size_px;
    egui::Grid::new("wizard").num_columns(2).spacing([12.0, 6.0]).show(ui, |ui| {
        ui.label("picture");
        let camera = wizard.exif.camera.clone().map(|c| format!(", {c}")).unwrap_or_default();
        ui.label(format!("{w} × {h} px{camera}")).on_hover_text(&wizard.name);
        ui.end_row();
        ui.label("focal length");
        ui.vertical(|ui| {
            let from = &mut wizard.focal_from;
            ui.horizontal(|ui| {
                ui.selectable_value(from, FocalFrom::FieldOfView, "from the field of view");
                let known = wizard.exif.focal_mm.is_some() || wizard.exif.focal_35mm_mm.is_some();
                ui.add_enabled_ui(known, |ui| ui.selectable_value(from, FocalFrom::Exif, "from EXIF"));
            });
            let unknown = ui.selectable_value(from, FocalFrom::Limb, "I do not know the lens");
            unknown.on_hover_text("The limb in the pictures says kind and focal length");
        });
        ui.end_row();
        if wizard.focal_from != FocalFrom::Limb {
            ui.label("lens");
            ui.horizontal(|ui| {
                let pinhole = ui.selectable_value(&mut wizard.fisheye, false, "pinhole");
                pinhole.on_hover_text("Straight lines stay straight");
                ui.selectable_value(&mut wizard.fisheye, true, "fisheye").on_hover_text("Also for more than 90°");
            });
            ui.end_row();
        }
        if wizard.focal_from == FocalFrom::FieldOfView {
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
