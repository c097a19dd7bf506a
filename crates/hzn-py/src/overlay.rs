//! `hzn.overlay`.

use hzn_run::source::Picture;
use image::RgbImage;
use numpy::ndarray::Array3;
use numpy::{IntoPyArray, PyArray3};
use pyo3::prelude::*;

use crate::errors;
use crate::image::Array;
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
    let drawn = draw(py, image, report, bits)?;
    let (width, height) = (drawn.width() as usize, drawn.height() as usize);
    Ok(Array3::from_shape_vec((height, width, 3), drawn.into_raw()).map_err(errors::image)?.into_pyarray(py))
}

/// Returns the picture in colour with the annotations of the report.
pub(crate) fn draw(py: Python<'_>, image: &Bound<'_, PyAny>, report: &Report, bits: Option<u8>) -> PyResult<RgbImage> {
    let array = Array::from_object(image)?;
    let picture = Picture::new(array.to_samples(), array.layout(bits)?);
    let (drawing, title) = (report.drawing_of_all(), report.title());
    errors::detached(py, || hzn_run::overlay::draw_annotations(picture.to_rgb(), &drawing, &title))
}
