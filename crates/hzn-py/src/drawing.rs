//! Pictures with annotations.

use hzn_mcap::Annotations;
use hzn_run::overlay;
use hzn_run::source::Picture;
use image::RgbImage;
use numpy::ndarray::Array3;
use numpy::{IntoPyArray, PyArray3};
use pyo3::prelude::*;

use crate::camera::Camera;
use crate::errors;
use crate::image::Array;

/// Returns the picture in colour, as an array. `camera` took it.
pub(crate) fn draw_bare<'py>(
    py: Python<'py>,
    image: &Bound<'py, PyAny>,
    bits: Option<u8>,
    camera: Option<&Camera>,
) -> PyResult<Bound<'py, PyArray3<u8>>> {
    let picture = check(image, bits, camera)?;
    to_array(py, errors::detached(py, || picture.to_rgb())?)
}

/// Returns a drawn picture as an array.
pub(crate) fn to_array(py: Python<'_>, drawn: RgbImage) -> PyResult<Bound<'_, PyArray3<u8>>> {
    let (width, height) = (drawn.width() as usize, drawn.height() as usize);
    Ok(Array3::from_shape_vec((height, width, 3), drawn.into_raw()).map_err(errors::image)?.into_pyarray(py))
}

/// Returns the picture in colour with annotations. `camera` took the picture that they belong to.
pub(crate) fn draw(
    py: Python<'_>,
    image: &Bound<'_, PyAny>,
    annotations: &Annotations,
    bits: Option<u8>,
    camera: Option<&Camera>,
) -> PyResult<RgbImage> {
    let picture = check(image, bits, camera)?;
    errors::detached(py, || overlay::draw_plain(picture.to_rgb(), annotations, &[]))
}

/// Refuses a picture of another size than that of its camera.
fn check(image: &Bound<'_, PyAny>, bits: Option<u8>, camera: Option<&Camera>) -> PyResult<Picture> {
    let array = Array::from_object(image)?;
    let (width, height) = array.size();
    let expected = camera.map(|c| (usize::from(c.config.width), usize::from(c.config.height)));
    if let Some((w, h)) = expected.filter(|size| *size != (width, height)) {
        return Err(errors::image(format!(
            "the picture is {width} x {height} px, but the report is of a picture of {w} x {h} px"
        )));
    }
    Ok(Picture::new(array.to_samples(), array.layout(bits)?))
}
