//! Reports of arrays, numbered in the order of the arrays.

use hzn_mcap::Row;
use pyo3::prelude::*;

use crate::report::Report;

/// Returns the same report, and those of the other bodies, with another index.
#[pyfunction]
#[pyo3(name = "_number")]
pub(crate) fn number(py: Python<'_>, report: &Report, index: u64) -> PyResult<Report> {
    let others = report.others.iter().map(|other| Py::new(py, number(py, other.get(), index)?));
    Ok(Report {
        row: Row { index, ..report.row.clone() },
        candidates: report.candidates.clone(),
        camera: report.camera.clone(),
        half_angle_rad: report.half_angle_rad,
        placed: report.placed.clone(),
        detail: report.detail.clone(),
        drawing: report.drawing.clone(),
        stage: report.stage.clone(),
        others: others.collect::<PyResult<_>>()?,
        nadir: report.nadir,
        shown: report.shown.as_ref().map(|shown| shown.clone_ref(py)),
        bits: report.bits,
        seen: report.seen.clone(),
    })
}
