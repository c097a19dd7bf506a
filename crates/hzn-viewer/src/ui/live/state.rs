//! The state of the flight computer, and its alarms.

use std::time::Instant;

use egui::{RichText, Ui, vec2};
use hzn_flight::messages::{Housekeeping, Mode};

use crate::model::Live;
use crate::ui::theme;

pub(super) fn show(ui: &mut Ui, live: &Live, now: Instant) {
    ui.add_space(6.0);
    let dark = ui.visuals().dark_mode;
    ui.strong("Alarms");
    let alarms = live.alarms(now);
    if alarms.is_empty() {
        let nothing = if live.housekeeping.is_some() { "none" } else { "none known: no housekeeping yet" };
        ui.weak(nothing);
    }
    for alarm in &alarms {
        let text = RichText::new(alarm).color(ui.visuals().error_fg_color).strong();
        ui.add(egui::Label::new(text).wrap());
    }
    if live.restarts > 0 {
        ui.colored_label(theme::warning(dark), format!("its clock began again {} times", live.restarts));
    }
    ui.add_space(10.0);
    ui.strong("Last answer");
    grid(ui, "answer", &answer(live));
    ui.add_space(10.0);
    ui.strong("Flight computer");
    match &live.housekeeping {
        Some(h) => grid(ui, "computer", &computer(h)),
        None => drop(ui.weak("no housekeeping yet")),
    }
}

fn grid(ui: &mut Ui, name: &str, rows: &[(&str, String)]) {
    egui::Grid::new(name).num_columns(2).spacing(vec2(8.0, 2.0)).show(ui, |ui| {
        for (name, value) in rows {
            ui.weak(*name);
            ui.label(RichText::new(value).monospace().size(12.0));
            ui.end_row();
        }
    });
}

fn answer(live: &Live) -> Vec<(&'static str, String)> {
    let (Some(last), Some(point)) = (&live.last, live.points.back()) else {
        return vec![("", "none yet".to_owned())];
    };
    let mut rows = vec![
        ("picture", last.exposure.picture.to_string()),
        ("status", point.status.map_or("?", |status| status.name()).to_owned()),
    ];
    if let Some(d) = &last.answer.direction {
        rows.extend(["axis x", "axis y", "axis z"].into_iter().zip(d.axis).map(|(name, x)| (name, format!("{x:+.6}"))));
        rows.push(("3σ", format!("{:.4}°", 3.0 * point.sigma_deg)));
        rows.push(("RMS", format!("{:.3} px", d.rms_px)));
        rows.push(("inliers", d.inliers.to_string()));
        if d.altitude_est_m.is_finite() {
            let (km, sigma_km) = (d.altitude_est_m * 1e-3, d.altitude_est_sigma_m * 1e-3);
            rows.push(("altitude", format!("{km:.1} ± {sigma_km:.1} km")));
        }
        if let Some(p_limb) = last.answer.integrity.and_then(|i| i.p_limb()) {
            rows.push(("p (limb)", format!("{p_limb:.4}")));
        }
        if let Some(level_rad) = last.answer.integrity.and_then(|i| i.protection_rad()) {
            rows.push(("protection", format!("{:.4}°", level_rad.to_degrees())));
        }
    }
    rows.push(("calculation", ms(last.exposure.calculation_us)));
    rows
}

fn computer(h: &Housekeeping) -> Vec<(&'static str, String)> {
    let mut rows = vec![
        ("mode", Mode::from_number(h.mode).map_or("?", Mode::name).to_owned()),
        ("pictures", format!("{}, {} with an answer", h.pictures, h.answers)),
        ("", format!("{} lost, {} refused", h.lost, h.refused)),
        ("calculation", format!("{} at most", ms(h.longest_us))),
        ("parameters", format!("copy {}, generation {}", h.parameter_copy, h.parameter_generation)),
        ("commands", format!("{} done, {} rejected", h.commands, h.rejected)),
        ("its line", format!("{} foreign, {} broken", h.foreign, h.broken)),
        ("starts", format!("{}, {} resets in a row", h.starts, h.watchdog_resets)),
    ];
    if h.since_lift_off_s != u32::MAX {
        rows.push(("lift-off", format!("{} s ago", h.since_lift_off_s)));
    }
    rows
}

fn ms(us: u32) -> String {
    format!("{:.1} ms", f64::from(us) * 1e-3)
}
