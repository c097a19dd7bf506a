//! `hzn.overlay`.

use hzn_cli::input::Picture;
use numpy::ndarray::Array3;
use numpy::{IntoPyArray, PyArray3};
use pyo3::prelude::*;

use crate::errors;
use crate::image::Array;
use crate::report::Report;

/// Draws what a report stands on over its picture.
#[pyfunction]
#[pyo3(signature = (image, report, *, bits = None))]
pub(crate) fn overlay<'py>(
    py: Python<'py>,
    image: &Bound<'py, PyAny>,
    report: &Report,
    bits: Option<u8>,
) -> PyResult<Bound<'py, PyArray3<u8>>> {
    let array = Array::of(image)?;
    let layout = array.layout(bits)?;
    let picture = Picture { samples: array.samples().into_owned(), layout, exif_time_s: None };
    let drawn = hzn_cli::overlay::draw_annotations(picture.to_rgb(), &report.drawing, report.title());
    let (width, height) = (drawn.width() as usize, drawn.height() as usize);
    Ok(Array3::from_shape_vec((height, width, 3), drawn.into_raw()).map_err(errors::image)?.into_pyarray(py))
}
