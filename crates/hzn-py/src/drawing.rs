//! Pictures with annotations.

use hzn_mcap::Annotations;
use hzn_run::overlay;
use hzn_run::source::Picture;
use image::RgbImage;
use pyo3::prelude::*;

use crate::camera::Camera;
use crate::errors;
use crate::image::Array;

/// Returns the picture in colour with annotations and a title. `camera` took the picture that they belong to.
pub(crate) fn draw(
    py: Python<'_>,
    image: &Bound<'_, PyAny>,
    annotations: &Annotations,
    title: &str,
    bits: Option<u8>,
    camera: Option<&Camera>,
) -> PyResult<RgbImage> {
    let array = Array::from_object(image)?;
    let (width, height) = array.size();
    let expected = camera.map(|c| (usize::from(c.config.width), usize::from(c.config.height)));
    if let Some((w, h)) = expected.filter(|size| *size != (width, height)) {
        return Err(errors::image(format!(
            "the picture is {width} x {height} px, but the report is of a picture of {w} x {h} px"
        )));
    }
    let picture = Picture::new(array.to_samples(), array.layout(bits)?);
    errors::detached(py, || overlay::draw_annotations(picture.to_rgb(), annotations, title))
}
