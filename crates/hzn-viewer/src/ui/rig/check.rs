//! The check of the heads by each other over time: the separation against its limit, and which heads are used.

use egui::{Color32, Rect, Sense, Ui, pos2, vec2};
use egui_plot::{Line, LineStyle, PlotPoints, VLine};

use super::colours::{colour, use_colour};
use crate::ui::plots::{set_label, shared_plot};
use crate::ui::rig_view::{RigView, Use};
use crate::ui::theme;

/// Height of the row of a head in points.
const ROW: f32 = 13.0;
/// Room for the names of the heads, which is that of the labels of the plot above.
const NAMES: f32 = 52.0;

pub(super) fn show(view: &mut RigView, ui: &mut Ui) {
    let dark = ui.visuals().dark_mode;
    let (own, limit) = (theme::line(0, dark), theme::diff(false, dark));
    ui.horizontal(|ui| {
        ui.strong("separation of the heads, °");
        ui.colored_label(limit, "dashed: its limit");
        ui.weak("Below: which heads are used");
        for what in Use::ALL {
            let (square, _) = ui.allocate_exact_size(vec2(10.0, 10.0), Sense::hover());
            ui.painter().rect_filled(square, 1, use_colour(what, dark));
            ui.weak(what.name());
        }
    });
    let height = ui.available_height() - ROW * view.heads.len() as f32 - 10.0;
    let series = |value: fn(&hzn_mcap::Row) -> Option<f64>| -> Vec<Vec<[f64; 2]>> {
        let points: Vec<Option<[f64; 2]>> =
            view.epochs.iter().enumerate().map(|(n, epoch)| Some([n as f64, value(&epoch.joint)?])).collect();
        points.split(Option::is_none).map(|part| part.iter().flatten().copied().collect()).collect()
    };
    let lines = [
        (series(|row| row.separation_deg), own, LineStyle::Solid, "separation"),
        (series(|row| row.separation_limit_deg), limit, LineStyle::dashed_dense(), "limit"),
    ];
    let last = view.epochs.len().saturating_sub(1).max(1) as f64;
    let plot = shared_plot("separation", height.max(60.0))
        .allow_drag(false)
        .allow_zoom(false)
        .allow_boxed_zoom(false)
        .show_x(false)
        .include_y(0.0)
        .x_axis_formatter(
            |mark, _| if mark.value.fract() == 0.0 { format!("{:.0}", mark.value + 1.0) } else { String::new() },
        );
    let cursor = view.epoch as f64;
    let shown = plot.show(ui, |plot| {
        plot.set_plot_bounds_x(-0.5..=last + 0.5);
        for (parts, colour, style, name) in lines {
            for part in parts.into_iter().filter(|part| !part.is_empty()) {
                // A single epoch is a short line.
                let part = if let [alone] = part.as_slice() {
                    vec![[alone[0] - 0.3, alone[1]], [alone[0] + 0.3, alone[1]]]
                } else {
                    part
                };
                plot.line(Line::new(name, PlotPoints::from(part)).color(colour).width(1.8).style(style));
            }
        }
        plot.vline(VLine::new("", cursor).color(Color32::GRAY).width(1.5).allow_hover(false));
        plot.response().clicked().then(|| plot.pointer_coordinate()).flatten()
    });
    set_label(&shown.response, "separation of the heads");
    let frame = *shown.transform.frame();
    let clicked = shown.inner.map(|at| at.x);
    let in_rows = rows(view, ui, frame, last);
    if let Some(x) = clicked.or(in_rows) {
        view.go(x.round().max(0.0) as usize);
    }
}

/// Draws a row for each head. Returns the epoch that was clicked.
fn rows(view: &RigView, ui: &mut Ui, frame: Rect, last: f64) -> Option<f64> {
    let dark = ui.visuals().dark_mode;
    let size = vec2(ui.available_width(), ROW * view.heads.len() as f32);
    let (response, painter) = ui.allocate_painter(size, Sense::click());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Use of the heads over time"));
    let wide = f64::from(frame.width()) / (last + 1.0);
    let left = |n: usize| frame.left() + (n as f64 * wide) as f32;
    for (n, head) in view.heads.iter().enumerate() {
        let top = response.rect.top() + n as f32 * ROW;
        let name = painter.layout_no_wrap(head.name.clone(), egui::FontId::proportional(11.0), colour(n, dark));
        let names = Rect::from_min_size(pos2(frame.left() - NAMES, top), vec2(NAMES - 4.0, ROW));
        painter.with_clip_rect(names).galley(names.min, name, Color32::WHITE);
        // Neighbours with the same use are drawn at once.
        let mut first = 0;
        while first < view.epochs.len() {
            let used = view.used(first, n);
            let end =
                (first..view.epochs.len()).find(|epoch| view.used(*epoch, n) != used).unwrap_or(view.epochs.len());
            let right = left(end).max(left(first) + 1.0);
            let cell = Rect::from_min_max(pos2(left(first), top + 1.0), pos2(right, top + ROW - 1.0));
            painter.rect_filled(cell, 0, use_colour(used, dark));
            first = end;
        }
    }
    let x = left(view.epoch) + wide as f32 / 2.0;
    painter.vline(x, response.rect.y_range(), egui::Stroke::new(1.5, ui.visuals().strong_text_color()));
    let at = response.clicked().then(|| response.interact_pointer_pos()).flatten()?;
    Some(f64::from(at.x - frame.left()) / wide - 0.5)
}
