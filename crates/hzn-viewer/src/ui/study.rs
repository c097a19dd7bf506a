//! Draws the window that sweeps a parameter over the sequence.

use std::sync::Arc;

use egui::{DragValue, RichText, Ui};
use egui_plot::{Line, Plot, Points, VLine};
use hzn_files::keys::Key;

use super::dialogs::escape;
use super::study_window::StudyWindow;
use super::viewer::Viewer;
use super::{number, placement, theme};
use crate::model::{Session, SliderRange};

/// Opens the window for a key.
pub(super) fn open(viewer: &mut Viewer, key: &'static Key) {
    let Some(session) = &viewer.session else { return };
    let magnitude = session.usual_magnitude(key.section(), key.name(), viewer.body);
    let Some(range) = SliderRange::from_limits(&key.limits, magnitude) else { return };
    let now = session.number(key.section(), key.name(), viewer.body).unwrap_or(range.middle());
    // A third to three times the value in effect, within the limits of the slider.
    let around = if now > 0.0 { [now / 3.0, now * 3.0] } else { [range.low, range.high] };
    let range_ends = [around[0].max(range.low), around[1].min(range.high)];
    viewer.study = Some(StudyWindow {
        key,
        study: None,
        range: range_ends,
        logarithmic: range.logarithmic,
        done: 0,
        tallies: Vec::new(),
    });
}

pub(super) fn show(viewer: &mut Viewer, ctx: &egui::Context, picture: egui::Rect) {
    let Some(mut window) = viewer.study.take() else { return };
    if let Some((done, tallies)) = window.study.as_ref().and_then(|s| s.newest()) {
        (window.done, window.tallies) = (done, tallies);
    }
    let (mut is_open, mut start, mut chosen) = (true, false, None);
    let title = format!("Sweep of {}", window.key.path);
    let width = 440.0_f32.min(picture.width() - 40.0);
    let frame = egui::Window::new(title).open(&mut is_open).default_pos(placement::beside(picture));
    frame.default_width(width).show(ctx, |ui| {
        ui.horizontal(|ui| {
            for (name, x) in ["from", "to"].into_iter().zip(&mut window.range) {
                let label = ui.label(name);
                let speed = (x.abs() * 0.01).max(1e-4);
                number::drag(ui, DragValue::new(x).speed(speed)).labelled_by(label.id);
            }
            start = ui.button("Start").clicked();
            if let Some(study) = &window.study {
                ui.weak(format!("{} of {} pictures", window.done, study.total));
            }
        });
        chosen = plots(viewer, ui, &window);
    });
    if start {
        begin(viewer, &mut window);
    }
    if let (Some(value), Some(session)) = (chosen, &mut viewer.session) {
        session.set_number(window.key, viewer.body, value);
        session.end_step();
    }
    if is_open && !escape(ctx) {
        viewer.study = Some(window);
    }
}

/// Starts the sweep. A value that sensor.toml refuses is left out.
fn begin(viewer: &mut Viewer, window: &mut StudyWindow) {
    let Some(session) = &viewer.session else { return };
    let with_value = |value: f64| {
        let mut session: Session = session.clone();
        session.set_number(window.key, viewer.body, value);
        session.problem().is_none().then(|| Some((value, Arc::clone(session.config()?)))).flatten()
    };
    let values: Vec<_> = window.values().into_iter().filter_map(with_value).collect();
    (window.done, window.tallies) = (0, Vec::new());
    window.study = Some(viewer.start_study(values));
}

/// Draws the share of answers, and error or sigma. Returns the value that the user chose.
fn plots(viewer: &Viewer, ui: &mut Ui, window: &StudyWindow) -> Option<f64> {
    if window.tallies.is_empty() {
        ui.weak("Each value is tried on up to 200 pictures of the sequence.");
        return None;
    }
    let dark = ui.visuals().dark_mode;
    let now = viewer.session.as_ref().and_then(|s| s.number(window.key.section(), window.key.name(), viewer.body));
    let share: Vec<[f64; 2]> = window.tallies.iter().map(|t| [t.value, 100.0 * t.share()]).collect();
    let has_truth = window.tallies.iter().any(|t| t.error_deg().is_some());
    let of = |t: &crate::work::study::Tally| if has_truth { t.error_deg() } else { t.sigma_deg() };
    let quality: Vec<[f64; 2]> = window.tallies.iter().filter_map(|t| Some([t.value, of(t)?])).collect();
    let names = ["answered pictures [%]", if has_truth { "error (truth), RMS [°]" } else { "3 sigma, RMS [°]" }];
    let mut chosen = None;
    for (n, (name, line)) in names.into_iter().zip([share, quality]).enumerate() {
        ui.label(RichText::new(name).size(12.5));
        let plot = Plot::new(("study", n)).height(120.0).allow_scroll(false).allow_drag(false).include_y(0.0);
        let shown = plot.show(ui, |ui| {
            let colour = theme::line(n, dark);
            ui.points(Points::new(name, line.clone()).color(colour).radius(2.5));
            ui.line(Line::new(name, line).color(colour).width(1.6));
            if let Some(now) = now {
                ui.vline(VLine::new("now", now).color(theme::warning(dark)).width(1.5));
            }
            ui.response().clicked().then(|| ui.pointer_coordinate()).flatten()
        });
        chosen = shown.inner.map(|p| p.x).or(chosen);
    }
    ui.weak("A click takes the nearest value; undo brings the one before back.");
    let x = chosen?;
    window.tallies.iter().map(|t| t.value).min_by(|a, b| (a - x).abs().total_cmp(&(b - x).abs()))
}
