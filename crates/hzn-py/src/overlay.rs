//! `hzn.overlay`.

use numpy::PyArray3;
use pyo3::prelude::*;

use crate::drawing;
use crate::report::Report;

#[doc = doc!("overlay")]
#[pyfunction]
#[pyo3(signature = (image, report, *, bits = None))]
pub(crate) fn overlay<'py>(
    py: Python<'py>,
    image: &Bound<'py, PyAny>,
    report: &Report,
    bits: Option<u8>,
) -> PyResult<Bound<'py, PyArray3<u8>>> {
    let drawn = drawing::draw(py, image, &report.drawing_of_all(), bits, report.camera.as_deref())?;
    drawing::to_array(py, drawn)
}
