//! The window on a flight computer: its telemetry as it comes, and a box for telecommands.

mod commands;
mod plots;
mod state;

use std::time::{Duration, Instant};

use egui::{RichText, Ui};

use super::theme;
use super::viewer::Viewer;
use crate::model::Live;

/// Longest time between two drawings, so that the age of the data goes on.
const REDRAW: Duration = Duration::from_millis(200);
/// Width in points of the columns at both sides of the plots.
const COLUMN: f32 = 290.0;

/// Draws everything below the bar at the top.
pub(super) fn show(viewer: &mut Viewer, ui: &mut Ui) {
    let Some(view) = &mut viewer.live else { return };
    let (line, now) = (&view.line, Instant::now());
    ui.ctx().request_repaint_after(REDRAW);
    egui::Panel::top("line").show(ui, |ui| {
        ui.add_space(4.0);
        ui.horizontal_wrapped(|ui| {
            headline(ui, line.name(), &line.live(), now);
            ui.separator();
            plots::controls(&mut view.axis, ui);
        });
        ui.add_space(4.0);
    });
    egui::Panel::left("computer").resizable(false).exact_size(COLUMN).show(ui, |ui| {
        egui::ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| state::show(ui, &line.live(), now));
    });
    egui::Panel::right("commands").resizable(false).exact_size(COLUMN).show(ui, |ui| {
        ui.add_space(6.0);
        commands::show(&mut view.typed, line, ui);
    });
    egui::CentralPanel::default().show(ui, |ui| plots::show(&mut view.axis, ui, &line.live()));
}

/// Draws the state of the line.
fn headline(ui: &mut Ui, name: &str, live: &Live, now: Instant) {
    let dark = ui.visuals().dark_mode;
    let (good, bad) = (theme::diff(true, dark), ui.visuals().error_fg_color);
    ui.strong(name);
    match (&live.ended, live.is_connected) {
        (Some(_), _) => ui.colored_label(bad, "ended"),
        (None, true) => ui.colored_label(good, "connected"),
        (None, false) => ui.colored_label(theme::warning(dark), "waits for the other end"),
    };
    ui.separator();
    let age = |ui: &mut Ui, what: &str, age: Option<Duration>| {
        let text = age.map_or_else(|| format!("no {what} yet"), |age| format!("last {what} {} ago", seconds(age)));
        let is_old = age.is_none_or(|age| age >= hzn_ground::SILENT_AFTER);
        ui.colored_label(if is_old { theme::warning(dark) } else { good }, text);
    };
    age(ui, "packet", live.age(now));
    age(ui, "answer", live.age_of_answer(now));
    ui.separator();
    let counts = live.counts();
    ui.label(format!("{} packets, {} answers", counts.packets, counts.answers));
    let lost = format!("{} lost", counts.lost);
    let lost = match live.loss() {
        Some(part) if part > 0.0 => format!("{lost}, {:.1} % in the last minute", 100.0 * part),
        _ => lost,
    };
    let is_lossy = live.loss().is_some_and(|part| part > 0.0);
    let text = RichText::new(format!("{lost}; {} broken", counts.broken));
    ui.label(if is_lossy { text.color(theme::warning(dark)) } else { text });
}

/// Returns a duration with one decimal while it is short.
fn seconds(age: Duration) -> String {
    let s = age.as_secs_f64();
    if s < 10.0 { format!("{s:.1} s") } else { format!("{s:.0} s") }
}
