//! Plots of the results of `hzn fuse`, on the time axis of the pictures.

use egui::{Color32, Ui};
use egui_plot::{HLine, MarkerShape, Points};
use hzn_fuse::sink::Phase;

use super::axis::{polylines, tick_label, unwrap_deg, value_range};
use super::frame::heading;
use super::over_time::{Pointed, Style, TimeAxis, draw, frame_plot};
use crate::model::navigation::{INNOVATIONS, InnovationSeries, NavQuantity, Navigation, StateValue};
use crate::ui::theme;
use crate::ui::viewer::Viewer;

/// Innovations beyond this many sigmas are drawn at the border of the plot.
const MOST_SIGMAS: f64 = 8.0;

/// Plots a quantity of the solutions; returns the picture under the pointer.
pub(super) fn show(viewer: &Viewer, ui: &mut Ui, quantity: &NavQuantity, axis: &TimeAxis, height: f32) -> Pointed {
    let nav = viewer.companions.navigation.as_ref()?;
    let dark = ui.visuals().dark_mode;
    let title = title(quantity);
    if let Some(why) = why_empty(nav, axis) {
        heading(ui, &title, &[], "");
        ui.weak(why);
        return None;
    }
    let within = |phase| nav.states(phase).iter().filter(|s| axis.place_of_time(s.time_s).is_some());
    let values = [Phase::Filter, Phase::Smoothed, Phase::Back].into_iter().flat_map(|phase| {
        let lines = quantity.lines.iter().map(move |(_, value_of)| line(nav, phase, quantity, *value_of, axis));
        lines.flatten().flatten().map(|[_, y]| y)
    });
    let range = value_range(values);
    let Some(range) = range else {
        heading(ui, &title, &[], "");
        ui.weak(format!("{} has no value of “{}” during the pictures.", nav.file, quantity.name));
        return None;
    };
    let mut legend: Vec<(&str, Color32)> =
        quantity.lines.iter().zip(0..).map(|((name, _), n)| (*name, theme::line(n, dark))).collect();
    let has = |phase| within(phase).next().is_some();
    if has(Phase::Smoothed) {
        legend.push(("dashed: smoothed", theme::line(0, dark)));
    }
    if has(Phase::Back) {
        legend.push(("faint: integrated back from the start", theme::line(0, dark).gamma_multiply(0.4)));
    }
    let at = viewer.hovered_frame.unwrap_or(viewer.playback.frame());
    heading(ui, &title, &legend, &values_text(viewer, nav, quantity, at));
    let values_of = |i: usize| values_text(viewer, nav, quantity, i);
    frame_plot(viewer, ui, quantity.name, axis, range, false, height, &values_of, |ui, column| {
        for (phase, style) in
            [(Phase::Back, Style::Faint), (Phase::Smoothed, Style::Dashed), (Phase::Filter, Style::Plain)]
        {
            for (n, (name, value_of)) in quantity.lines.iter().enumerate() {
                for part in parts(nav, phase, quantity, *value_of, axis, column) {
                    draw(ui, name, part, theme::line(n, dark), style);
                }
            }
        }
    })
}

/// Returns the rows of points of a line.
pub(super) fn parts(
    nav: &Navigation,
    phase: Phase,
    quantity: &NavQuantity,
    value_of: StateValue,
    axis: &TimeAxis,
    column: f64,
) -> Vec<Vec<[f64; 2]>> {
    let points = line(nav, phase, quantity, value_of, axis);
    polylines(points.len(), column, |i| *points.get(i)?)
}

/// Returns the points of a line. Angles do not jump by 360°.
fn line(
    nav: &Navigation,
    phase: Phase,
    quantity: &NavQuantity,
    value_of: StateValue,
    axis: &TimeAxis,
) -> Vec<Option<[f64; 2]>> {
    let within = || nav.states(phase).iter().filter_map(|s| Some((axis.place_of_time(s.time_s)?, s)));
    let values = within().map(|(_, state)| value_of(state).filter(|x| x.is_finite()));
    let values = if quantity.unit == "°" { unwrap_deg(values) } else { values.collect() };
    within().zip(values).map(|((x, _), y)| Some([x, y?])).collect()
}

/// Returns the innovations of a series, as taken and as refused ones. Within a column only the extremes are kept.
pub(super) fn innovation_points(series: &InnovationSeries, axis: &TimeAxis, column: f64) -> [Vec<[f64; 2]>; 2] {
    [true, false].map(|taken| {
        let all: Vec<_> = series.components.iter().filter(|c| c.taken == taken).collect();
        let point = |i: usize| {
            let c = all.get(i)?;
            Some([axis.place_of_time(c.time_s)?, c.sigmas.clamp(-MOST_SIGMAS, MOST_SIGMAS)])
        };
        polylines(all.len(), column, point).concat()
    })
}

/// Plots all innovations, each component over its sigma; returns the picture under the pointer.
pub(super) fn innovations(viewer: &Viewer, ui: &mut Ui, axis: &TimeAxis, height: f32) -> Pointed {
    let nav = viewer.companions.navigation.as_ref()?;
    let title = innovations_title();
    if let Some(why) = why_empty(nav, axis) {
        heading(ui, &title, &[], "");
        ui.weak(why);
        return None;
    }
    let series = || nav.innovations.iter().zip(0u32..);
    let mut legend: Vec<(&str, Color32)> = series().map(|(s, n)| (s.name.as_str(), theme::edge(n))).collect();
    legend.push(("×: refused", theme::edge(0)));
    heading(ui, &title, &legend, "");
    let inside = nav.innovations.iter().flat_map(|s| &s.components);
    let inside = inside.filter(|c| axis.place_of_time(c.time_s).is_some()).map(|c| c.sigmas.abs());
    let most = inside.fold(4.0, f64::max).min(MOST_SIGMAS) * 1.05;
    frame_plot(viewer, ui, INNOVATIONS, axis, [-most, most], false, height, &|_| String::new(), |ui, column| {
        for y in [-3.0, 3.0] {
            ui.hline(HLine::new("3σ", y).color(theme::REJECTED.gamma_multiply(0.6)).allow_hover(false));
        }
        for (s, n) in series() {
            let [taken, refused] = innovation_points(s, axis, column);
            ui.points(Points::new(s.name.as_str(), taken).color(theme::edge(n)).radius(1.6));
            let crosses = Points::new(s.name.as_str(), refused).color(theme::edge(n)).radius(3.5);
            ui.points(crosses.shape(MarkerShape::Cross));
        }
    })
}

/// Returns the heading of the plot of innovations.
pub(super) fn innovations_title() -> String {
    format!("{INNOVATIONS} [σ of each component; ±3σ is the line, ±{MOST_SIGMAS:.0}σ the border]")
}

pub(super) fn title(quantity: &NavQuantity) -> String {
    format!("{} [{}]", quantity.name, quantity.unit)
}

/// Returns the values of the filter at a picture.
fn values_text(viewer: &Viewer, nav: &Navigation, quantity: &NavQuantity, at: usize) -> String {
    let time_s = viewer.sequence.entries.get(at).and_then(|e| e.time_s);
    let Some(state) = time_s.and_then(|t| nav.nearest(t)) else { return String::new() };
    let text = |(name, value_of): &(&str, StateValue)| {
        let x = value_of(state)?;
        Some(format!("{name} {}", tick_label(x, (x.abs() * 1e-3).max(1e-6))))
    };
    let each: Vec<String> = quantity.lines.iter().filter_map(text).collect();
    if each.is_empty() { String::new() } else { format!("{} {}", each.join("  "), quantity.unit) }
}

/// Returns why the results of hzn fuse have no place on the time axis.
fn why_empty(nav: &Navigation, axis: &TimeAxis) -> Option<String> {
    let Some([first, last]) = axis.span_s() else {
        return Some(format!("The pictures have no times, so {} has no place on their axis.", nav.file));
    };
    let Some([from, to]) = nav.span_s() else { return Some(format!("{} has no solution.", nav.file)) };
    (to < first || from > last).then(|| {
        format!(
            "{} covers {from:.1} to {to:.1} s, the pictures {first:.1} to {last:.1} s: their clocks have other epochs.",
            nav.file
        )
    })
}
