//! Pictures with annotations.

use hzn_mcap::Annotations;
use hzn_run::overlay;
use hzn_run::source::Picture;
use image::RgbImage;
use pyo3::prelude::*;

use crate::errors;
use crate::image::Array;

/// Returns the picture in colour with annotations and a title.
pub(crate) fn draw(
    py: Python<'_>,
    image: &Bound<'_, PyAny>,
    annotations: &Annotations,
    title: &str,
    bits: Option<u8>,
) -> PyResult<RgbImage> {
    let array = Array::from_object(image)?;
    let picture = Picture::new(array.to_samples(), array.layout(bits)?);
    errors::detached(py, || overlay::draw_annotations(picture.to_rgb(), annotations, title))
}
