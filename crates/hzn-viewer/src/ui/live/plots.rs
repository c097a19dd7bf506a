//! The answers over the last minutes, and the status of each picture.

use egui::{Color32, Id, Rect, Sense, Ui, pos2, vec2};
use egui_plot::{Line, PlotPoints, Points};
use hzn_core::status::Status;

use crate::model::Live;
use crate::model::live::Point;
use crate::ui::live_view::{Axis, SPANS};
use crate::ui::plots::{set_label, shared_plot};
use crate::ui::theme;

/// Height of the band of statuses in points.
const BAND: f32 = 22.0;

/// A plot: its title, and the value of an answer.
type Curve = (&'static str, fn(&Point) -> f32);

const CURVES: [Curve; 3] = [
    ("angle from the optical axis, °", |p| p.nadir_deg),
    ("3σ, °", |p| 3.0 * p.sigma_deg),
    ("altitude of the free fit, km", |p| p.altitude_km),
];

/// Draws the switches of the time axis.
pub(super) fn controls(axis: &mut Axis, ui: &mut Ui) {
    let hint = "The plots end at the newest answer; dragging a plot ends it";
    ui.toggle_value(&mut axis.follows, "Follow").on_hover_text(hint);
    for (span_s, name) in SPANS {
        if ui.selectable_label(axis.span_s == span_s, name).clicked() {
            axis.span_s = span_s;
        }
    }
}

pub(super) fn show(axis: &mut Axis, ui: &mut Ui, live: &Live) {
    let Some(newest_s) = live.points.back().map(|p| p.time_s) else {
        ui.centered_and_justified(|ui| ui.weak("The plots begin with the first answer."));
        return;
    };
    if axis.follows {
        axis.end_s = newest_s;
    }
    // The times count from the end of the axis.
    let range = [-axis.span_s, 0.0];
    let first = live.points.partition_point(|p| p.time_s < axis.end_s - axis.span_s);
    let end = live.points.partition_point(|p| p.time_s <= axis.end_s);
    let shown = live.points.range(first..end);
    // A flight without free fits has no altitudes, and their plot no room.
    let has_values = |value: fn(&Point) -> f32| shown.clone().any(|p| value(p).is_finite());
    let curves: Vec<Curve> = CURVES.into_iter().filter(|(_, value)| has_values(*value)).collect();
    let title = 20.0 + ui.spacing().item_spacing.y * 2.0;
    let rows = curves.len().max(1) as f32;
    let height = ((ui.available_height() - BAND - title) / rows - title).max(60.0);
    for (n, (name, value)) in curves.iter().enumerate() {
        let values: Vec<[f64; 2]> = shown.clone().map(|p| [p.time_s - axis.end_s, value(p).into()]).collect();
        let last = values.last().filter(|v| v[1].is_finite()).map_or("–".to_owned(), |v| format!("{:.4}", v[1]));
        ui.horizontal(|ui| {
            ui.strong(*name);
            ui.label(egui::RichText::new(last).monospace());
        });
        let colour = theme::line(n, ui.visuals().dark_mode);
        if let Some(by_s) = curve(ui, name, &values, range, height, colour) {
            (axis.follows, axis.end_s) = (false, axis.end_s - by_s);
        }
    }
    if curves.is_empty() {
        ui.weak("No picture of this time has an answer, so there is nothing to plot.");
    }
    ui.strong("status of each picture");
    band(ui, shown.map(|p| (p.time_s - axis.end_s, p.status)), range);
}

/// Plots a quantity. Returns the time by which it was dragged, s.
fn curve(ui: &mut Ui, name: &str, values: &[[f64; 2]], range: [f64; 2], height: f32, colour: Color32) -> Option<f64> {
    let columns = ui.available_width().max(100.0) as usize;
    let plot = shared_plot(("live", name), height)
        .allow_drag(false)
        .allow_zoom(false)
        .allow_boxed_zoom(false)
        .allow_double_click_reset(false)
        .show_x(false)
        .include_x(range[0])
        .include_x(range[1])
        .set_margin_fraction(vec2(0.0, 0.08))
        .x_axis_formatter(|mark, _| format!("{:.0} s", mark.value))
        .link_cursor(Id::unique("live"), [true, false]);
    let parts = polylines(values, range, columns);
    let shown = plot.show(ui, |plot| {
        plot.set_plot_bounds_x(range[0]..=range[1]);
        for part in parts {
            if let [alone] = part.as_slice() {
                plot.points(Points::new(name, PlotPoints::from(vec![*alone])).color(colour).radius(1.5));
            } else {
                plot.line(Line::new(name, PlotPoints::from(part)).color(colour).width(1.5));
            }
        }
    });
    let width = shown.transform.frame().width();
    set_label(&shown.response, name);
    let dragged = f64::from(shown.response.drag_delta().x);
    (dragged != 0.0 && width > 0.0).then(|| dragged / f64::from(width) * (range[1] - range[0]))
}

/// Returns the lines of a plot, broken where an answer is missing. Where several answers lie in one column of pixels,
/// only the lowest and the highest are drawn: an hour has more answers than the screen has columns.
fn polylines(values: &[[f64; 2]], range: [f64; 2], columns: usize) -> Vec<Vec<[f64; 2]>> {
    let column = |t: f64| ((t - range[0]) / (range[1] - range[0]) * columns as f64) as i64;
    let mut parts: Vec<Vec<[f64; 2]>> = vec![Vec::new()];
    for same in values.chunk_by(|a, b| column(a[0]) == column(b[0]) && a[1].is_finite() == b[1].is_finite()) {
        if same.iter().any(|v| !v[1].is_finite()) {
            parts.push(Vec::new());
            continue;
        }
        let by_value = |a: &&[f64; 2], b: &&[f64; 2]| a[1].total_cmp(&b[1]);
        let (low, high) = (same.iter().min_by(by_value), same.iter().max_by(by_value));
        let mut ends: Vec<[f64; 2]> = low.into_iter().chain(high).copied().collect();
        ends.sort_by(|a, b| a[0].total_cmp(&b[0]));
        ends.dedup();
        if let Some(part) = parts.last_mut() {
            part.extend(ends);
        }
    }
    parts.retain(|part| !part.is_empty());
    parts
}

/// Draws the status of each picture as a colour.
fn band(ui: &mut Ui, points: impl Iterator<Item = (f64, Option<Status>)>, range: [f64; 2]) {
    let (response, painter) = ui.allocate_painter(vec2(ui.available_width(), BAND), Sense::hover());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "status of each picture"));
    let rect = response.rect.shrink2(vec2(0.0, 2.0));
    painter.rect_filled(rect, 3, ui.visuals().extreme_bg_color);
    let x = |t: f64| rect.left() + ((t - range[0]) / (range[1] - range[0])) as f32 * rect.width();
    let mut last: Option<(f32, Color32)> = None;
    for (time_s, status) in points {
        let colour = status.map_or(Color32::GRAY, theme::status);
        let at = x(time_s);
        // Neighbours in the same column of pixels are drawn once.
        if last.is_some_and(|(before, c)| c == colour && at - before < 0.8) {
            continue;
        }
        let cell = Rect::from_min_max(pos2(at - 1.2, rect.top()), pos2(at + 0.2, rect.bottom()));
        painter.rect_filled(cell.intersect(rect), 0, colour);
        last = Some((at, colour));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_hour_is_drawn_with_its_extremes_and_its_gaps() {
        let value = |i: usize| match i {
            20_000 => 9.0,
            30_000..30_100 => f64::NAN,
            _ => (i as f64 * 0.01).sin(),
        };
        let values: Vec<[f64; 2]> = (0..36_000).map(|i| [i as f64 * 0.1, value(i)]).collect();
        let parts = polylines(&values, [0.0, 3600.0], 800);
        assert_eq!(parts.len(), 2);
        let points = parts.iter().flatten();
        assert!(points.clone().count() <= 2 * 802);
        assert!(points.clone().any(|p| p[1] == 9.0));
        assert!(points.clone().all(|p| !(3000.1..3009.8).contains(&p[0])), "nothing is drawn where nothing came");
    }
}
