//! The chosen plots, for a file.

use super::axis::polylines;
use super::over_time::{TimeAxis, refused, title};
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
            let parts = |is_other: bool| {
                polylines(count, 0.0, |i| {
                    let rows = &viewer.rows;
                    let row = if is_other { rows.other(i, viewer.body) } else { rows.current(i, viewer.body) }?;
                    let value = value_of(row, viewer.truth_of(&row.file, &row.body)).filter(|x| x.is_finite())?;
                    Some([axis.place(i)?, value])
                })
            };
            lines.push(((*name).to_owned(), parts(false)));
            lines.push((format!("{name} (compared)"), parts(true)));
        }
        lines.retain(|(_, parts)| !parts.is_empty());
        if !lines.is_empty() {
            rows.push(PlotRow { title: title(quantity), lines });
        }
    }
    let heading = format!("{}, {} frames; grey: without an answer", viewer.sequence.stem(), count);
    PlotSheet { heading, axis: axis.label(), ends: axis.ends(), refused: refused(viewer, &axis), rows }
}
