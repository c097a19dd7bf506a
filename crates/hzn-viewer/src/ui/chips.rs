//! The summary of all pictures in words: how many have which status, and why. A click shows one group in the time line.

use egui::{RichText, ScrollArea, Ui};

use super::theme;
use super::viewer::Viewer;
use crate::model::cause::{Cause, Counted, Group};

/// Returns status and reason of a picture in words.
pub(super) fn cause_text(viewer: &Viewer, frame: usize) -> String {
    match viewer.rows.cause(frame, viewer.body) {
        Some(Cause { status, reason: Some(reason) }) => format!("{status}: {}", reason.name()),
        Some(Cause { status, reason: None }) => status.to_string(),
        None => String::new(),
    }
}

pub(super) fn show(viewer: &mut Viewer, ui: &mut Ui) {
    if viewer.sequence.len() < 2 {
        return;
    }
    let counted = viewer.summary.update(&viewer.rows, viewer.body).to_vec();
    let mut group = viewer.group;
    ScrollArea::horizontal().id_salt("summary").auto_shrink([false, true]).show(ui, |ui| {
        ui.horizontal(|ui| {
            if counted.is_empty() {
                ui.weak(if viewer.session.is_some() { "no results yet" } else { "not processed" });
            }
            for (n, one) in counted.iter().enumerate() {
                if n > 0 {
                    ui.weak("·");
                }
                status(ui, one, &mut group);
            }
            if group.is_some() && ui.small_button("Show all").clicked() {
                group = None;
            }
        });
    });
    viewer.group = group;
}

fn status(ui: &mut Ui, one: &Counted, group: &mut Option<Group>) {
    let (rect, _) = ui.allocate_exact_size(egui::vec2(10.0, 10.0), egui::Sense::hover());
    ui.painter().rect_filled(rect, 2, theme::status(one.status));
    let mut entry = |ui: &mut Ui, text: String, own: Group| {
        let on = *group == Some(own);
        let hint = "Show only these pictures in the time line; “Next refused” then goes through them";
        if ui.selectable_label(on, RichText::new(text).size(12.5)).on_hover_text(hint).clicked() {
            *group = (!on).then_some(own);
        }
    };
    let colon = if one.reasons.is_empty() { "" } else { ":" };
    entry(ui, format!("{} {}{colon}", one.count, one.status), Group { status: one.status, reason: None });
    let named: usize = one.reasons.iter().map(|(_, count)| count).sum();
    let unnamed = one.count.saturating_sub(named);
    for (reason, count) in &one.reasons {
        entry(ui, format!("{count} {}", reason.name()), Group { status: one.status, reason: Some(*reason) });
    }
    if named > 0 && unnamed > 0 {
        ui.weak(RichText::new(format!("{unnamed} without an edge")).size(12.5));
    }
}
