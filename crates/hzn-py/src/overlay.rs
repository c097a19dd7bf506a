//! `hzn.overlay`.

use numpy::ndarray::Array3;
use numpy::{IntoPyArray, PyArray3};
use pyo3::prelude::*;

use crate::report::Report;
use crate::{drawing, errors};

#[doc = doc!("overlay")]
#[pyfunction]
#[pyo3(signature = (image, report, *, bits = None))]
pub(crate) fn overlay<'py>(
    py: Python<'py>,
    image: &Bound<'py, PyAny>,
    report: &Report,
    bits: Option<u8>,
) -> PyResult<Bound<'py, PyArray3<u8>>> {
    let drawn = drawing::draw(py, image, &report.drawing_of_all(), &report.title(), bits, report.camera.as_deref())?;
    let (width, height) = (drawn.width() as usize, drawn.height() as usize);
    Ok(Array3::from_shape_vec((height, width, 3), drawn.into_raw()).map_err(errors::image)?.into_pyarray(py))
}
