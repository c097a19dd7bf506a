//! The chosen plots, for a file.

use hzn_fuse::sink::Phase;
use hzn_run::provenance;

use super::axis::polylines;
use super::navigation;
use super::over_time::{Source, TimeAxis, refused, series, title};
use super::sigma_parts::{self, SIGMA_PARTS};
use crate::model::navigation::{INNOVATIONS, NAV_QUANTITIES};
use crate::model::quantity::QUANTITIES;
use crate::ui::viewer::Viewer;
use crate::work::plots::{PlotRow, PlotSheet};

/// Returns the chosen plots over time that have a value: the current results, and those of the sensor that is compared
/// with.
pub(in crate::ui) fn sheet(viewer: &Viewer) -> PlotSheet {
    let axis = TimeAxis::new(viewer);
    let count = viewer.sequence.len();
    let mut rows = Vec::new();
    for quantity in QUANTITIES.iter().filter(|q| viewer.settings.plotted.iter().any(|name| name == q.name)) {
        let mut lines = Vec::new();
        for (name, value_of) in quantity.lines {
            let parts = |source: Source| {
                let values = series(viewer, quantity, *value_of, source);
                polylines(count, column(&axis), |i| Some([axis.place(i)?, (*values.get(i)?)?]))
            };
            lines.push(((*name).to_owned(), parts(Source::Current)));
            lines.push((format!("{name} (compared)"), parts(Source::Other)));
        }
        lines.retain(|(_, parts)| !parts.is_empty());
        if !lines.is_empty() {
            rows.push(PlotRow { title: title(quantity), lines, band: quantity.band });
        }
    }
    rows.extend(sigma_budget(viewer, &axis));
    rows.extend(navigation(viewer, &axis));
    let heading = format!("{}, {} pictures; grey: without an answer", viewer.sequence.stem(), count);
    let refused = refused(viewer, &axis).into_iter().map(|(_, ends)| ends).collect();
    let hash = viewer.session.as_ref().and_then(|session| provenance::hash(session.config()?));
    let provenance = provenance::line(hash.as_deref(), &provenance::command("hzn view"));
    PlotSheet { heading, axis: axis.label(), ends: axis.ends(), provenance, refused, rows }
}

/// Returns the width of a column of a plot on the horizontal axis. More points than two in each of them cannot be seen
/// on paper.
fn column(axis: &TimeAxis) -> f64 {
    let [first, last] = axis.ends();
    (last - first) / 2000.0
}

/// Returns the parts of sigma, if they are chosen. A file has lines instead of areas.
fn sigma_budget(viewer: &Viewer, axis: &TimeAxis) -> Option<PlotRow> {
    let is_chosen = viewer.settings.plotted.iter().any(|name| name == SIGMA_PARTS);
    let heights = if is_chosen { sigma_parts::heights(&sigma_parts::parts(viewer)) } else { Vec::new() };
    let line = |(name, values): (&str, Vec<Option<f64>>)| {
        let value = |i: usize| Some([axis.place(i)?, (*values.get(i)?)?]);
        (name.to_owned(), polylines(values.len(), column(axis), value))
    };
    let lines: Vec<_> = heights.into_iter().map(line).collect();
    (!lines.is_empty()).then(|| PlotRow { title: format!("{SIGMA_PARTS}, parts of 1σ [°]"), lines, band: None })
}

/// Returns the chosen plots of the results of `hzn fuse`.
fn navigation(viewer: &Viewer, axis: &TimeAxis) -> Vec<PlotRow> {
    let Some(nav) = &viewer.companions.navigation else { return Vec::new() };
    let chosen = |name: &str| viewer.settings.plotted.iter().any(|p| p == name);
    let column = column(axis);
    let mut rows = Vec::new();
    for quantity in NAV_QUANTITIES.iter().filter(|q| chosen(q.name)) {
        let mut lines = Vec::new();
        for (phase, more) in [(Phase::Filter, ""), (Phase::Smoothed, " (smoothed)"), (Phase::Back, " (back)")] {
            for (name, value_of) in quantity.lines {
                let parts = navigation::parts(nav, phase, quantity, *value_of, axis, column);
                lines.push((format!("{name}{more}"), parts));
            }
        }
        rows.push(PlotRow { title: navigation::title(quantity), lines, band: None });
    }
    if chosen(INNOVATIONS) {
        let dots = |points: Vec<[f64; 2]>| points.into_iter().map(|p| vec![p]).collect();
        let mut lines = Vec::new();
        for series in &nav.innovations {
            let [taken, refused] = navigation::innovation_points(series, axis, column);
            lines.push((series.name.clone(), dots(taken)));
            lines.push((format!("{} (refused)", series.name), dots(refused)));
        }
        rows.push(PlotRow { title: navigation::innovations_title(), lines, band: None });
    }
    for row in &mut rows {
        row.lines.retain(|(_, parts)| !parts.is_empty());
    }
    rows.retain(|row| !row.lines.is_empty());
    rows
}
