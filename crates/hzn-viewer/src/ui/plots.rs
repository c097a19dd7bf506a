//! Plots over time, and the residuals along the limb of the shown picture.

use std::ops::RangeInclusive;

use egui::{Color32, Id, Rangef, Response, RichText, Ui, vec2};
use egui_plot::{GridInput, GridMark, HLine, HoverPosition, Line, Plot, PlotPoints, Points, VLine};

use super::theme;
use super::viewer::Viewer;
use crate::model::rows::{QUANTITIES, Quantity, RowValue};
use crate::work::frame_view::Residual;

/// Name of the plot of residuals.
pub(super) const RESIDUALS: &str = "Residuals";

pub(super) fn show(viewer: &mut Viewer, ui: &mut Ui) {
    let height = viewer.settings.plots_height;
    let panel = egui::Panel::bottom("plots").resizable(true).default_size(height).size_range(110.0..=600.0);
    let shown = panel.show(ui, |ui| {
        // The contents fill the whole panel. Otherwise the panel would shrink a little with every frame of the window.
        ui.expand_to_include_rect(ui.max_rect());
        ui.add_space(4.0);
        // A single picture has no plot over time.
        let single = viewer.sequence.complete && viewer.sequence.len() == 1;
        let chosen = if single {
            vec![RESIDUALS.to_owned()]
        } else {
            quantity_choice(viewer, ui);
            viewer.settings.plotted.clone()
        };
        let count = chosen.len().max(1);
        let gap = ui.spacing().item_spacing.x;
        let width = (ui.available_width() - gap * (count as f32 - 1.0)) / count as f32;
        let height = ui.available_height() - 2.0;
        let (mut go, mut look) = (None, None);
        ui.horizontal(|ui| {
            for name in &chosen {
                ui.allocate_ui(vec2(width, height), |ui| {
                    ui.vertical(|ui| {
                        if name == RESIDUALS {
                            look = residuals(viewer, ui).or(look);
                        } else if let Some(quantity) = QUANTITIES.iter().find(|q| q.name == name) {
                            go = over_time(viewer, ui, quantity).or(go);
                        }
                    });
                });
            }
            if chosen.is_empty() {
                ui.weak("Choose the plots above.");
            }
        });
        if let Some(frame) = go {
            viewer.playback.go(frame, viewer.sequence.len());
        }
        if let Some(point) = look {
            viewer.look_at(point);
        }
    });
    viewer.settings.plots_height = shown.response.rect.height();
}

fn quantity_choice(viewer: &mut Viewer, ui: &mut Ui) {
    ui.horizontal_wrapped(|ui| {
        for name in QUANTITIES.iter().map(|q| q.name).chain([RESIDUALS]) {
            if name == "Error" && viewer.truth.is_empty() {
                continue;
            }
            let on = viewer.settings.plotted.iter().any(|p| p == name);
            if ui.selectable_label(on, RichText::new(name).size(12.5)).clicked() {
                if on {
                    viewer.settings.plotted.retain(|p| p != name);
                } else {
                    viewer.settings.plotted.push(name.to_owned());
                }
            }
        }
    });
}

fn title(quantity: &Quantity) -> String {
    if quantity.unit.is_empty() { quantity.name.to_owned() } else { format!("{} [{}]", quantity.name, quantity.unit) }
}

/// Draws title and legend of a plot above it, because a legend inside would cover the lines.
fn heading(ui: &mut Ui, title: &str, lines: &[(&str, Color32)]) {
    ui.horizontal(|ui| {
        ui.label(RichText::new(title).size(12.5));
        for (name, colour) in lines {
            let (rect, _) = ui.allocate_exact_size(vec2(10.0, 10.0), egui::Sense::hover());
            ui.painter().rect_filled(rect.shrink(1.0), 2, *colour);
            ui.weak(RichText::new(*name).size(12.0));
        }
    });
}

/// Names the plot for screen readers.
fn set_label(response: &Response, name: &str) {
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, format!("Plot {name}")));
}

/// Plots a quantity of all pictures; returns the picture that was clicked.
fn over_time(viewer: &Viewer, ui: &mut Ui, quantity: &Quantity) -> Option<usize> {
    let entries = &viewer.sequence.entries;
    // Times may be large numbers, so the plot starts at the first picture with time zero.
    let start = entries.iter().find_map(|e| e.time_s).unwrap_or(0.0);
    let dark = ui.visuals().dark_mode;
    let value = |i: usize, value_of: RowValue, current: bool| {
        let row = if current { viewer.rows.newest(i, viewer.body) } else { viewer.rows.recorded(i, viewer.body) }?;
        value_of(row, viewer.truth_of(&row.file, &row.body)).filter(|x| x.is_finite())
    };
    let changed = viewer.session.as_ref().is_some_and(|s| s.is_changed());
    heading(ui, &title(quantity), &legend(quantity, changed, dark));
    let end_s = entries.iter().rev().find_map(|e| e.time_s).map_or(1.0, |t| (t - start).max(1e-3));
    let plot = time_plot(quantity, ui.available_height(), end_s);
    let response = plot.show(ui, |ui| {
        let column = ui.transform().dvalue_dpos()[0].abs();
        let line = |value_of: RowValue, current: bool| {
            polylines(entries.len(), column, |i| Some([entries.get(i)?.time_s? - start, value(i, value_of, current)?]))
        };
        for (n, (name, value_of)) in quantity.lines.iter().enumerate() {
            let colour = theme::line(n, dark);
            // Where the parameters have changed, the file's results are drawn faintly.
            if changed {
                for part in line(*value_of, false) {
                    ui.line(Line::new("file", part).color(colour.gamma_multiply(0.35)).width(1.0).allow_hover(false));
                }
            }
            for part in line(*value_of, true) {
                if let [one] = part.as_slice() {
                    ui.points(Points::new(*name, vec![*one]).color(colour).radius(2.0));
                } else {
                    ui.line(Line::new(*name, part).color(colour).width(1.6));
                }
            }
        }
        if let Some(now_s) = entries.get(viewer.playback.frame()).and_then(|e| e.time_s) {
            // This colour differs from the grid's.
            let ink = if dark { theme::LIMB } else { theme::REJECTED };
            ui.vline(VLine::new("", now_s - start).color(ink).width(1.5).allow_hover(false));
        }
        ui.response().clicked().then(|| ui.pointer_coordinate()).flatten()
    });
    set_label(&response.response, quantity.name);
    viewer.sequence.nearest(response.inner?.x + start)
}

/// Returns names and colours of the lines of a plot over time. A single line needs no name.
fn legend(quantity: &Quantity, changed: bool, dark: bool) -> Vec<(&'static str, Color32)> {
    let mut lines: Vec<_> =
        quantity.lines.iter().zip(0..).map(|((name, _), n)| (*name, theme::line(n, dark))).collect();
    if lines.len() == 1 {
        lines.clear();
    }
    if changed {
        lines.push(("as in the file", theme::line(0, dark).gamma_multiply(0.35)));
    }
    lines
}

/// Returns a plot over the time of the sequence, from 0 to `end_s`. All these plots share their time axis.
fn time_plot(quantity: &Quantity, height: f32, end_s: f64) -> Plot<'static> {
    shared_plot(("plot", quantity.name), height)
        // The plot covers the whole sequence, also where there are no values.
        .include_x(0.0)
        .include_x(end_s)
        .link_cursor(Id::unique("time"), [true, false])
        .link_axis(Id::unique("time"), [true, false])
        .allow_boxed_zoom(true)
        .set_margin_fraction(vec2(0.01, 0.12))
        .x_axis_formatter(axis_labels(" s"))
        .label_formatter(move |at| {
            let p = match at {
                HoverPosition::NearDataPoint { position, .. } | HoverPosition::Elsewhere { position } => position,
            };
            Some(format!("{:.3} s\n{:.5}", p.x, p.y))
        })
}

/// Returns a plot with the properties that all plots share.
fn shared_plot<'a>(id: impl egui::AsIdSalt, height: f32) -> Plot<'a> {
    Plot::new(id)
        .height(height)
        .allow_scroll(false)
        // There are few grid lines, and all of them are faint, so that the curve stands out.
        .grid_spacing(Rangef::new(8.0, 1500.0))
        .x_grid_spacer(|input| ticks(input, 8.0))
        .y_grid_spacer(|input| ticks(input, 4.0))
        .y_axis_formatter(|mark, _| tick_label(mark.value, mark.step_size))
        .y_axis_min_width(44.0)
}

/// Returns the labels along an axis. The very end has none, because the border of the window would cut it.
fn axis_labels(unit: &'static str) -> impl Fn(GridMark, &RangeInclusive<f64>) -> String {
    move |mark, range| {
        let room = 0.04 * (range.end() - range.start());
        let label = || tick_label(mark.value, mark.step_size) + unit;
        if mark.value > range.end() - room { String::new() } else { label() }
    }
}

/// Returns about `count` grid lines, at 1, 2 or 5 times a power of ten.
fn ticks(input: GridInput, count: f64) -> Vec<GridMark> {
    let (low, high) = input.bounds;
    let rough = (high - low) / count;
    if !(rough > 0.0 && rough.is_finite()) {
        return Vec::new();
    }
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|k| k * power).find(|s| *s >= rough).unwrap_or(rough);
    let first = (low / step).ceil() as i64;
    (first..first + 12)
        .map(|i| i as f64 * step)
        .take_while(|y| *y <= high)
        .map(|value| GridMark { value, step_size: step })
        .collect()
}

/// Formats the value of a tick with enough digits to differ from its neighbours.
fn tick_label(value: f64, step: f64) -> String {
    let digits = (-(step * 1.000_001).log10().floor()).clamp(0.0, 12.0) as usize;
    // A zero has no minus sign.
    let value = if value.abs() < step * 1e-6 { 0.0 } else { value };
    format!("{value:.digits$}")
}

/// Returns rows of points; a missing point starts a new row. Within the same `column` (a width; 0 for none) only about
/// the lowest and the highest points are kept. More cannot be seen, and a column may have thousands of pictures.
fn polylines(count: usize, column: f64, point: impl Fn(usize) -> Option<[f64; 2]>) -> Vec<Vec<[f64; 2]>> {
    let mut out: Vec<Vec<[f64; 2]>> = Vec::new();
    let (mut open, mut last, mut in_last) = (false, f64::NAN, 0);
    for p in (0..count).map(point) {
        let Some(p) = p else {
            open = false;
            continue;
        };
        let here = if column > 0.0 { (p[0] / column).floor() } else { f64::NAN };
        let part = match out.last_mut() {
            Some(part) if open => part,
            _ => out.push_mut(Vec::new()),
        };
        in_last = if open && here == last { in_last + 1 } else { 1 };
        (open, last) = (true, here);
        match part.as_mut_slice() {
            [.., a, b] if in_last > 2 => {
                let between =
                    |x: &[f64; 2], y: [f64; 2], z: [f64; 2]| (x[1].min(z[1])..=x[1].max(z[1])).contains(&y[1]);
                if between(a, p, *b) {
                    continue;
                }
                if !between(a, *b, p) {
                    *a = *b;
                }
                *b = p;
            }
            _ => part.push(p),
        }
    }
    out
}

/// Plots the residuals of the edge points along the fitted limb; returns the picture point that was clicked.
fn residuals(viewer: &Viewer, ui: &mut Ui) -> Option<[f64; 2]> {
    let threshold = viewer.frame_view.as_ref().and_then(|s| s.answers.first()).map(|o| o.config.reject.threshold_px);
    let all = viewer.answer().map(|a| &*a.residuals).unwrap_or_default();
    let points = |kept: bool| -> PlotPoints<'_> {
        all.iter().filter(|r| (r.weight > 0.0) == kept).map(|r| [r.azimuth_deg, r.distance_px]).collect()
    };
    if all.is_empty() {
        ui.weak("This plot shows the residuals along the limb if the picture has an answer.");
        return None;
    }
    heading(
        ui,
        "Residual [px] by azimuth about the axis",
        &[("inliers", theme::INLIER), ("outliers", theme::REJECTED)],
    );
    let plot = shared_plot("residuals", ui.available_height())
        .set_margin_fraction(vec2(0.01, 0.1))
        .x_axis_formatter(axis_labels("°"))
        .include_y(-1.0)
        .include_y(1.0);
    let shown = plot.show(ui, |ui| {
        if let Some(px) = threshold {
            for y in [px, -px] {
                ui.hline(HLine::new("threshold", y).color(theme::REJECTED.gamma_multiply(0.5)).allow_hover(false));
            }
        }
        ui.points(Points::new("outliers", points(false)).color(theme::REJECTED).radius(1.8));
        ui.points(Points::new("inliers", points(true)).color(theme::INLIER).radius(1.5));
    });
    set_label(&shown.response, RESIDUALS);
    let pointer = shown.response.interact_pointer_pos().filter(|_| shown.response.clicked())?;
    // The point that is nearest on the screen is returned.
    let distance = |r: &Residual| {
        let p = shown.transform.position_from_point(&[r.azimuth_deg, r.distance_px].into());
        p.distance_sq(pointer)
    };
    all.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))).map(|r| r.point)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_numbers() {
        let tick_values = |low: f64, high: f64| -> Vec<f64> {
            ticks(GridInput { bounds: (low, high), base_step_size: 0.0 }, 4.0).iter().map(|m| m.value).collect()
        };
        assert_eq!(tick_values(0.0, 10.0), [0.0, 5.0, 10.0]);
        assert_eq!(tick_values(-0.9, 7.2), [0.0, 5.0]);
        assert_eq!(tick_values(100.0, 103.5), [100.0, 101.0, 102.0, 103.0]);
        assert!(tick_values(1.0, 1.0).is_empty() && tick_values(f64::NAN, 1.0).is_empty());
    }

    #[test]
    fn no_two_ticks_read_the_same() {
        for (low, high) in [(0.08, 0.13), (100.2, 100.3), (0.0, 1.0), (-3e-5, 4e-5), (0.0, 2400.0)] {
            let marks = ticks(GridInput { bounds: (low, high), base_step_size: 0.0 }, 4.0);
            let labels: Vec<String> = marks.iter().map(|m| tick_label(m.value, m.step_size)).collect();
            let distinct: std::collections::HashSet<_> = labels.iter().collect();
            assert!(labels.len() > 1 && distinct.len() == labels.len(), "{labels:?}");
        }
        assert_eq!((tick_label(0.1, 0.02).as_str(), tick_label(-1e-17, 5.0).as_str()), ("0.10", "0"));
        let label = |value: f64| axis_labels(" s")(GridMark { value, step_size: 10.0 }, &(0.0..=101.0));
        assert_eq!((label(90.0).as_str(), label(100.0).as_str()), ("90 s", ""));
    }

    #[test]
    fn lines_are_broken_where_values_are_missing() {
        let value = |i: usize| (!i.is_multiple_of(4)).then_some([i as f64, 1.0]);
        for column in [0.0, 0.5, f64::NAN] {
            let lengths: Vec<usize> = polylines(10, column, value).iter().map(Vec::len).collect();
            assert_eq!(lengths, [3, 3, 1]);
        }
        assert!(polylines(3, 0.0, |_| None).is_empty());
    }

    #[test]
    fn what_a_column_cannot_show_is_left_out_and_its_extremes_are_not() {
        let value = |i: usize| Some([i as f64, ((i * 7919) % 1000) as f64]);
        let all: Vec<[f64; 2]> = (0..10_000).filter_map(value).collect();
        let thin = polylines(all.len(), 100.0, value).concat();
        assert_eq!(thin.len(), 200);
        assert!(thin.is_sorted_by(|a, b| a[0] < b[0]));
        for (these, those) in all.chunks(100).zip(thin.chunks(2)) {
            let ends = |points: &[[f64; 2]]| {
                let y = || points.iter().map(|p| p[1]);
                (y().fold(f64::INFINITY, f64::min), y().fold(f64::NEG_INFINITY, f64::max))
            };
            assert_eq!(ends(these), ends(those));
        }
    }
}
