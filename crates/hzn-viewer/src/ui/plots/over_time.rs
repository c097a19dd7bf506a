//! Plots of a quantity over all pictures.

use egui::{Color32, Id, Rangef, Ui, vec2};
use egui_plot::{Axis, Line, LineStyle, MarkerShape, Plot, PlotUi, Points, Span, VLine};
use hzn_core::status::Status;
use hzn_mcap::Row;

use super::axis::{axis_labels, polylines, robust_range, tick_label, unwrap_deg, widen};
use super::frame::{heading, set_label, shared_plot, value_axis};
use crate::model::quantity::{Quantity, RowValue};
use crate::ui::theme;
use crate::ui::viewer::Viewer;

/// Part of the time axis that is free before the first picture and behind the last one.
pub(in crate::ui) const MARGIN: f32 = 0.01;
/// Width in points that a picture needs for a marker of its own.
const MARKER_EVERY: f32 = 8.0;

/// Results that a line shows.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Source {
    /// The results of the current parameters.
    Current,
    /// The results of earlier parameters, where they are not the current ones.
    Earlier,
    /// The results of the sensor that is compared with.
    Other,
}

impl Source {
    fn row(self, viewer: &Viewer, index: usize) -> Option<&Row> {
        match self {
            Self::Current => viewer.rows.current(index, viewer.body),
            Self::Earlier => viewer.rows.earlier(index, viewer.body),
            Self::Other => viewer.rows.other(index, viewer.body),
        }
    }
}

/// The horizontal axis: the time since the first picture, or the number of the picture if the times are not known.
pub(in crate::ui) struct TimeAxis {
    /// Place of each picture, if it has one.
    places: Vec<Option<f64>>,
    /// The unit of the labels; empty for numbers of pictures.
    unit: &'static str,
    /// Time of the first picture, s; `None` if the times are not known.
    start_s: Option<f64>,
}

impl TimeAxis {
    pub(in crate::ui) fn new(viewer: &Viewer) -> Self {
        let entries = &viewer.sequence.entries;
        // Times may be large numbers, so the plots start at the first picture with time zero.
        let start_s = entries.iter().find_map(|e| e.time_s);
        match start_s {
            Some(start) => {
                Self { places: entries.iter().map(|e| Some(e.time_s? - start)).collect(), unit: " s", start_s }
            }
            None => Self { places: (1..=entries.len()).map(|i| Some(i as f64)).collect(), unit: "", start_s },
        }
    }
    /// Returns the place of a time, s, if it lies within the sequence.
    pub(super) fn place_of_time(&self, time_s: f64) -> Option<f64> {
        let ([first, last], place) = (self.ends(), time_s - self.start_s?);
        let room = 0.01 * (last - first);
        (first - room..=last + room).contains(&place).then_some(place)
    }
    /// Returns the times of the first and the last picture, s, if times are known.
    pub(super) fn span_s(&self) -> Option<[f64; 2]> {
        let start = self.start_s?;
        Some(self.ends().map(|place| place + start))
    }
    /// Returns the label of the axis.
    pub(super) fn label(&self) -> &'static str {
        if self.unit.is_empty() { "picture" } else { "time since the first picture, s" }
    }
    pub(super) fn place(&self, index: usize) -> Option<f64> {
        self.places.get(index).copied().flatten()
    }
    /// Returns the first and the last place.
    pub(super) fn ends(&self) -> [f64; 2] {
        let mut known = self.places.iter().flatten().copied();
        let first = known.next().unwrap_or(0.0);
        let last = known.next_back().unwrap_or(first);
        [first, last.max(first + 1e-3)]
    }
    /// Returns the picture that is nearest to a place.
    fn nearest(&self, x: f64) -> Option<usize> {
        let distance = |(i, p): (usize, &Option<f64>)| Some((i, (p.as_ref()? - x).abs()));
        self.places.iter().enumerate().filter_map(distance).min_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i)
    }
    /// Describes the place of a picture in words: its time as the player tells it, and its place on the axis if this
    /// is another number.
    fn text(&self, viewer: &Viewer, index: usize) -> String {
        let time = viewer.sequence.time_text(index).map(|time| format!(", {time}"));
        let since = self.place(index).filter(|_| self.start_s.is_some_and(|start| start != 0.0));
        let since = since.map(|s| format!(" ({s:.3} s since the first picture)"));
        format!("picture {}{}{}", index + 1, time.unwrap_or_default(), since.unwrap_or_default())
    }
    /// Returns where each picture begins and the last one ends, as parts of the axis from its first to its last
    /// picture: a picture reaches halfway to its neighbours. Without an order in time all pictures are equally wide.
    pub(in crate::ui) fn borders(&self) -> Vec<f64> {
        let count = self.places.len();
        let places: Vec<f64> = self.places.iter().copied().flatten().collect();
        if count < 2 || places.len() < count || !places.is_sorted() {
            return (0..=count).map(|i| i as f64 / count.max(1) as f64).collect();
        }
        let [first, last] = self.ends();
        let middles = places.windows(2).map(|pair| ((pair[0] + pair[1]) / 2.0 - first) / (last - first));
        std::iter::once(0.0).chain(middles).chain([1.0]).collect()
    }
}

/// Draws the labels of the horizontal axis below all plots. Returns where the axis begins and ends on the screen, and
/// where the picture `frame` lies, if it is in view. `hint` says what the numbers are.
pub(super) fn ruler(
    ui: &mut Ui,
    axis: &TimeAxis,
    frame: usize,
    height: f32,
    hint: Option<&str>,
) -> (Rangef, Option<f32>) {
    let plot = with_axis(shared_plot("ruler", height), axis)
        .show_axes([true, true])
        .show_grid([false, false])
        .y_axis_formatter(|_, _| String::new())
        .include_y(0.0)
        .allow_drag([true, false])
        .x_axis_formatter(axis_labels(axis.unit));
    let shown = plot.show(ui, |_| ());
    set_label(&shown.response, "time axis");
    if let Some(hint) = hint {
        shown.response.clone().on_hover_text(hint);
    }
    let span = shown.transform.frame().x_range();
    let x = axis.place(frame).map(|place| shown.transform.position_from_point_x(place));
    (span, x.filter(|x| span.contains(*x)))
}

fn with_axis<'a>(plot: Plot<'a>, axis: &TimeAxis) -> Plot<'a> {
    let [first, last] = axis.ends();
    // The plots cover the whole sequence, also where there are no values, and all of them share their axis.
    plot.include_x(first)
        .include_x(last)
        .link_cursor(Id::unique("time"), [true, false])
        .link_axis(Id::unique("time"), [true, false])
        .set_margin_fraction(vec2(MARGIN, 0.0))
}

/// Returns the values of a line for all pictures. Angles do not jump by 360°.
pub(super) fn series(viewer: &Viewer, quantity: &Quantity, value_of: RowValue, source: Source) -> Vec<Option<f64>> {
    let value = |i: usize| {
        let row = source.row(viewer, i)?;
        value_of(row, viewer.truth_of(&row.file, &row.body)).filter(|x| x.is_finite())
    };
    let all = (0..viewer.sequence.len()).map(value);
    if quantity.unit == "°" { unwrap_deg(all) } else { all.collect() }
}

/// The picture under the pointer, and whether it was clicked.
pub(super) type Pointed = Option<(usize, bool)>;

/// Plots a quantity of all pictures; returns the picture under the pointer.
pub(super) fn show(viewer: &Viewer, ui: &mut Ui, quantity: &Quantity, axis: &TimeAxis, height: f32) -> Pointed {
    let dark = ui.visuals().dark_mode;
    let count = viewer.sequence.len();
    let mut sources = [Source::Earlier, Source::Other, Source::Current]
        .map(|source| quantity.lines.iter().map(|(_, of)| series(viewer, quantity, *of, source)).collect::<Vec<_>>());
    let is_log = viewer.settings.log_plots && sources.iter().flatten().flatten().flatten().all(|x| *x > 0.0);
    if is_log {
        sources.iter_mut().flatten().flatten().flatten().for_each(|x| *x = x.log10());
    }
    let [earlier, other, current] = sources;
    let range = |lines: &[Vec<Option<f64>>]| robust_range(lines.iter().flatten().copied().flatten());
    let title = title(quantity) + if is_log { ", log" } else { "" };
    let ranges = [range(&current), range(&earlier), range(&other)];
    let Some(range) = ranges.into_iter().flatten().reduce(widen) else {
        heading(ui, &title, &[], "");
        ui.weak(why_empty(viewer, quantity));
        return None;
    };
    let band = quantity.band.map(|band| shown_band(band, is_log, range));
    // The whole band is seen: a value is judged by it.
    let [low, high] = band.map_or(range, |[from, to]| {
        let room = 0.08 * (to - from);
        [range[0].min(from - room), range[1].max(to + room)]
    });
    let values_of = |i: usize| {
        let row = Source::Current.row(viewer, i);
        values_text(quantity, |value_of| value_of(row?, viewer.truth_of(&row?.file, &row?.body)))
    };
    let at = viewer.hovered_frame.unwrap_or(viewer.playback.frame());
    let mut legend = legend(quantity, ranges[1].is_some(), ranges[2].is_some(), dark);
    legend.extend(band.map(|_| ("within 3σ", band_colour(dark).to_opaque())));
    heading(ui, &title, &legend, &values_of(at));
    frame_plot(viewer, ui, quantity.name, axis, [low, high], is_log, height, &values_of, |ui, column| {
        if let Some([from, to]) = band {
            ui.span(Span::new("", from..=to).axis(Axis::Y).fill(band_colour(dark)));
        }
        let sources = [(&earlier, Style::Faint), (&other, Style::Dashed), (&current, Style::Plain)];
        for (lines, style) in sources {
            for (n, ((name, _), values)) in quantity.lines.iter().zip(lines).enumerate() {
                let value = |i: usize| Some([axis.place(i)?, (*values.get(i)?)?]);
                let within = |[x, y]: [f64; 2]| [x, y.clamp(low, high)];
                let colour = theme::line(n, dark);
                let parts = polylines(count, column, |i| value(i).map(within));
                parts.into_iter().for_each(|part| draw(ui, name, part, colour, style));
                outside(ui, name, (0..count).filter_map(value), [low, high], colour);
            }
        }
    })
}

/// Returns the ends of a band on the axis. The logarithm of 0 lies below every value.
fn shown_band(band: [f64; 2], is_log: bool, [low, _]: [f64; 2]) -> [f64; 2] {
    band.map(|x| match is_log {
        true if x > 0.0 => x.log10(),
        true => low,
        false => x,
    })
}

fn band_colour(dark: bool) -> Color32 {
    theme::line(2, dark).gamma_multiply(0.16)
}

/// Draws arrows at the border of a plot for the values outside of it.
fn outside(
    ui: &mut PlotUi<'_>,
    name: &str,
    points: impl Iterator<Item = [f64; 2]>,
    [low, high]: [f64; 2],
    colour: Color32,
) {
    let (mut above, mut below) = (Vec::new(), Vec::new());
    let inset = 0.04 * (high - low);
    for [x, y] in points {
        if y > high {
            above.push([x, high - inset]);
        } else if y < low {
            below.push([x, low + inset]);
        }
    }
    for (points, shape) in [(above, MarkerShape::Up), (below, MarkerShape::Down)] {
        if !points.is_empty() {
            ui.points(Points::new(name, points).color(colour).shape(shape).radius(4.0));
        }
    }
}

/// Draws a plot over the pictures: `contents` gets the width of a column of pixels on the time axis, and `values_of`
/// returns the values of a picture as text. Returns the picture under the pointer.
pub(super) fn frame_plot(
    viewer: &Viewer,
    ui: &mut Ui,
    name: &str,
    axis: &TimeAxis,
    [low, high]: [f64; 2],
    is_log: bool,
    height: f32,
    values_of: &dyn Fn(usize) -> String,
    contents: impl FnOnce(&mut PlotUi<'_>, f64),
) -> Pointed {
    let dark = ui.visuals().dark_mode;
    let plot = with_axis(shared_plot(("plot", name), height), axis)
        .show_axes([false, true])
        .custom_y_axes(vec![value_axis(is_log)])
        .include_y(low)
        .include_y(high)
        .allow_boxed_zoom(true)
        // A drag of the cursor does not move the plot.
        .allow_drag(!viewer.panels.cursor.is_dragged)
        .label_formatter(|_| None);
    let response = plot.show(ui, |ui| {
        shade_refused(viewer, ui, axis, dark);
        let column = ui.transform().dvalue_dpos()[0].abs();
        contents(ui, column);
        if let Some(now) = axis.place(viewer.playback.frame()) {
            // This colour differs from the grid's.
            let ink = if dark { theme::LIMB } else { theme::REJECTED };
            ui.vline(VLine::new("", now).color(ink).width(1.5).allow_hover(false));
        }
        let at = ui.response().hovered().then(|| ui.pointer_coordinate()).flatten();
        // Every plot below the pointer would take the drag, so only the one counts in which it began.
        let is_slid = viewer.panels.cursor.is_dragged && ui.response().is_pointer_button_down_on();
        let slid = is_slid.then(|| ui.ctx().input(|i| i.pointer.latest_pos())).flatten();
        (slid.map(|at| ui.plot_from_screen(at)).or(at), slid.is_some() || ui.response().clicked())
    });
    set_label(&response.response, name);
    let (at, clicked) = response.inner;
    let pointer = response.response.hover_pos();
    if viewer.panels.cursor.is_dragged || pointer.is_some_and(|at| viewer.panels.cursor.is_near(at.x)) {
        response.response.ctx.set_cursor_icon(egui::CursorIcon::ResizeHorizontal);
    }
    let nearest = axis.nearest(at?.x)?;
    let text = format!("{}\n{}", axis.text(viewer, nearest), values_of(nearest));
    response.response.on_hover_text_at_pointer(text.trim_end());
    Some((nearest, clicked))
}

/// Style of a line.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Style {
    Plain,
    Dashed,
    Faint,
}

/// Draws a part of a line; a single point is a dot.
pub(super) fn draw(ui: &mut PlotUi<'_>, name: &str, part: Vec<[f64; 2]>, colour: Color32, style: Style) {
    let (colour, width) = match style {
        Style::Plain => (colour, 1.6),
        Style::Dashed => (colour, 1.2),
        Style::Faint => (colour.gamma_multiply(0.4), 1.0),
    };
    if let [one] = part.as_slice() {
        ui.points(Points::new(name, vec![*one]).color(colour).radius(2.0));
        return;
    }
    // A few pictures are seen one by one.
    if style == Style::Plain && part.len() as f32 * MARKER_EVERY < ui.transform().frame().width() {
        ui.points(Points::new(name, part.clone()).color(colour).radius(2.2));
    }
    let line = Line::new(name, part).color(colour).width(width);
    ui.line(if style == Style::Dashed { line.style(LineStyle::dashed_loose()) } else { line });
}

/// Shades the pictures without an answer, in the colour of their status.
fn shade_refused(viewer: &Viewer, ui: &mut PlotUi<'_>, axis: &TimeAxis, dark: bool) {
    for (status, [from, to]) in refused(viewer, axis) {
        let colour = theme::status(status).gamma_multiply(if dark { 0.16 } else { 0.22 });
        ui.span(Span::new("", from..=to).fill(colour));
    }
}

/// Returns from where to where pictures have no answer, with their status. Neighbours of the same status are joined.
pub(super) fn refused(viewer: &Viewer, axis: &TimeAxis) -> Vec<(Status, [f64; 2])> {
    let status = |i: usize| viewer.rows.newest(i, viewer.body).map(|r| r.status).filter(|s| *s != Status::Ok);
    let count = viewer.sequence.len();
    // A picture reaches halfway to its neighbours.
    let middle = |a: usize, b: usize| Some((axis.place(a)? + axis.place(b)?) / 2.0);
    let (mut out, mut i) = (Vec::new(), 0);
    while i < count {
        let Some(here) = status(i) else {
            i += 1;
            continue;
        };
        let end = (i..count).find(|&k| status(k) != Some(here)).unwrap_or(count);
        let from = if i == 0 { axis.place(0) } else { middle(i - 1, i) };
        let to = if end == count { axis.place(end - 1) } else { middle(end - 1, end) };
        out.extend(from.zip(to).map(|(from, to)| (here, [from, to])));
        i = end;
    }
    out
}

pub(super) fn title(quantity: &Quantity) -> String {
    if quantity.unit.is_empty() { quantity.name.to_owned() } else { format!("{} [{}]", quantity.name, quantity.unit) }
}

/// Returns the values of a picture as text.
fn values_text(quantity: &Quantity, value: impl Fn(RowValue) -> Option<f64>) -> String {
    let text = |(name, value_of): &(&str, RowValue)| {
        let x = value(*value_of)?;
        let digits = tick_label(x, (x.abs() * 1e-4).max(1e-9));
        Some(if quantity.lines.len() > 1 { format!("{name} {digits}") } else { digits })
    };
    let each: Vec<String> = quantity.lines.iter().filter_map(text).collect();
    if each.is_empty() { String::new() } else { format!("{} {}", each.join("  "), quantity.unit) }
}

/// Returns names and colours of the lines. A single line needs no name.
fn legend(quantity: &Quantity, earlier: bool, other: bool, dark: bool) -> Vec<(&'static str, Color32)> {
    let named = quantity.lines.iter().zip(0..).map(|((name, _), n)| (*name, theme::line(n, dark)));
    let mut lines: Vec<_> = if quantity.lines.len() == 1 { Vec::new() } else { named.collect() };
    if earlier {
        lines.push(("before the change", theme::line(0, dark).gamma_multiply(0.4)));
    }
    if other {
        lines.push(("dashed: compared", theme::line(0, dark)));
    }
    lines
}

/// Returns why a plot has no values.
fn why_empty(viewer: &Viewer, quantity: &Quantity) -> String {
    let Some(session) = &viewer.session else {
        return "There is no sensor.toml, so there are no results.".into();
    };
    let answered =
        (0..viewer.sequence.len()).filter_map(|i| viewer.rows.newest(i, viewer.body)).any(|r| r.status == Status::Ok);
    match quantity.name {
        _ if viewer.rows.is_empty() => "No picture is processed yet.".into(),
        "Roll, pitch" if session.config().is_some_and(|c| c.mount.is_none()) => {
            "Roll and pitch need the mounting of the camera: set [mount] q_vehicle_from_camera_wxyz in sensor.toml."
                .into()
        }
        "Error (truth)" => "No answer has a truth to compare with.".into(),
        _ if !answered => "No picture has an answer yet, so there is nothing to plot.".into(),
        name => format!("No picture has a value of “{name}”."),
    }
}
