//! Draws the window that calibrates: the report, the limb height of each picture, and the keys that would change.

use egui::{RichText, Ui, vec2};
use egui_plot::{HLine, Line, Plot, Points};

use super::dialogs::escape;
use super::viewer::Viewer;
use super::{placement, theme};
use crate::work::measured::{Marks, Measured};

pub(super) fn show(viewer: &mut Viewer, ctx: &egui::Context, picture: egui::Rect) {
    let Some(mut window) = viewer.calibration.take() else { return };
    if let Some(result) = window.running.as_ref().and_then(|r| r.end()) {
        (window.running, window.result) = (None, Some(result));
    }
    let version = viewer.session.as_ref().map(|s| s.version());
    let is_current = version == Some(window.version);
    let (mut is_open, mut is_applied, mut asks) = (true, false, false);
    let width = 560.0_f32.min(picture.width() - 40.0);
    let height = (picture.height() - 90.0).max(160.0);
    let frame = egui::Window::new(window.name).open(&mut is_open).default_pos(placement::beside(picture));
    frame.default_width(width).max_height(height).vscroll(true).show(ctx, |ui| {
        if let Some(form) = window.form.as_mut().filter(|_| window.running.is_none()) {
            asks = form.show(ui);
            ui.separator();
        }
        match (&window.running, &window.result) {
            (Some(running), _) => {
                let done = running.done().min(running.total);
                let part = done as f32 / running.total.max(1) as f32;
                ui.add(egui::ProgressBar::new(part).text(format!("{done} of {} pictures", running.total)));
                ui.weak("The window can be used meanwhile. Closing this one stops the calibration.");
            }
            (None, Some(Err(why))) => drop(ui.colored_label(theme::warning(ui.visuals().dark_mode), why)),
            (None, Some(Ok(measured))) => is_applied = report(ui, measured, is_current),
            (None, None) => {}
        }
    });
    if asks {
        viewer.ask_board_pictures();
    }
    if is_applied
        && let (Some(Ok(measured)), Some(session)) = (&window.result, &mut viewer.session)
        && let Ok(text) = &measured.text
    {
        session.set_text(text);
        viewer.add_note("The calibration was applied as one step; undo takes it back. The file is not saved yet.");
        return;
    }
    if is_open && !escape(ctx) {
        viewer.calibration = Some(window);
    }
}

/// Draws the result. Returns true if it is to be applied.
fn report(ui: &mut Ui, measured: &Measured, is_current: bool) -> bool {
    let mut is_applied = false;
    ui.horizontal(|ui| {
        let can_apply = is_current && measured.text.is_ok();
        is_applied = ui.add_enabled(can_apply, egui::Button::new("Apply")).clicked();
        if !is_current {
            ui.weak("The sensor was changed since; calibrate again.");
        }
    });
    let small = |text: &str| RichText::new(text.to_owned()).size(12.0);
    if let Err(why) = &measured.text {
        ui.colored_label(theme::warning(ui.visuals().dark_mode), format!("The sensor must not be changed: {why}"));
    }
    for key in &measured.keys {
        ui.add(egui::Label::new(small(key).monospace()).wrap());
    }
    ui.add_space(6.0);
    if !measured.heights.is_empty() {
        ui.strong("Limb height of each picture, km");
        heights(ui, measured);
    }
    if let Some(marks) = &measured.marks {
        ui.strong(marks.title);
        plot_marks(ui, marks);
    }
    ui.add_space(6.0);
    egui::Grid::new("calibrated").num_columns(2).spacing(vec2(8.0, 2.0)).show(ui, |ui| {
        for (name, value) in &measured.lines {
            ui.label(small(name).weak());
            ui.add(egui::Label::new(small(value)).wrap());
            ui.end_row();
        }
    });
    is_applied
}

/// Plots the limb height of each picture with its 1-sigma, and that of all pictures.
fn heights(ui: &mut Ui, measured: &Measured) {
    let dark = ui.visuals().dark_mode;
    let plot = Plot::new("limb heights").height(150.0).allow_scroll(false).allow_drag(false).allow_zoom(false);
    let shown = plot.show(ui, |plot| {
        plot.hline(HLine::new("all pictures", measured.height_km).color(theme::LIMB).width(1.5));
        for (counts, colour) in [(true, theme::line(0, dark)), (false, theme::line(1, dark))] {
            let of = measured.heights.iter().enumerate().filter(|(_, h)| h.counts == counts);
            let dots: Vec<[f64; 2]> = of.clone().map(|(i, h)| [(i + 1) as f64, h.km]).collect();
            for (i, h) in of {
                let x = (i + 1) as f64;
                let bar = vec![[x, h.km - h.sigma_km], [x, h.km + h.sigma_km]];
                plot.line(Line::new("1 sigma", bar).color(colour).width(1.0));
            }
            let name = if counts { "counts" } else { "left out" };
            plot.points(Points::new(name, dots).color(colour).radius(3.0));
        }
    });
    shown.response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Plot of limb heights"));
}

/// Plots points; those that do not count have another colour.
fn plot_marks(ui: &mut Ui, marks: &Marks) {
    let dark = ui.visuals().dark_mode;
    let plot = Plot::new("calibration marks").height(150.0).allow_scroll(false).allow_drag(false).allow_zoom(false);
    let shown = plot.include_y(0.0).show(ui, |plot| {
        for (counts, colour) in [(true, theme::line(0, dark)), (false, theme::line(1, dark))] {
            let of = marks.points.iter().filter(|(_, c)| *c == counts);
            let dots: Vec<[f64; 2]> = of.map(|(point, _)| *point).collect();
            let name = if counts { "counts" } else { "left out" };
            plot.points(Points::new(name, dots).color(colour).radius(2.0));
        }
    });
    shown.response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Plot of the calibration"));
}
