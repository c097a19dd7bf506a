//! Writes ROS's camera_info and Foxglove's CameraCalibration, both without rectification.

use hzn_core::camera::{Config, Projection};

use super::format::{Format, UnsupportedLens, unsupported_projection};
use super::numbers::{RECTIFICATION, format_list, matrix, projection};

/// Writes the YAML that camera_info_manager reads.
pub(super) fn write_ros(c: &Config) -> Result<String, UnsupportedLens> {
    let (model, k) = match c.model.projection() {
        Projection::Angle => ("equidistant", coefficients(c, 4)),
        Projection::Plane => ("plumb_bob", coefficients(c, 5)),
        Projection::Own => return Err(unsupported_projection(c, Format::Ros)),
    };
    let matrix_of = |rows: usize, cols: usize, data: &[f64]| {
        format!("\n  rows: {rows}\n  cols: {cols}\n  data: {}\n", format_list(data))
    };
    Ok(format!(
        "image_width: {}\nimage_height: {}\ncamera_name: camera\ncamera_matrix:{}distortion_model: {model}\n\
         distortion_coefficients:{}rectification_matrix:{}projection_matrix:{}",
        c.width,
        c.height,
        matrix_of(3, 3, &matrix(c)),
        matrix_of(1, k.len(), &k),
        matrix_of(3, 3, &RECTIFICATION),
        matrix_of(3, 4, &projection(c)),
    ))
}

/// Writes the JSON of the Protobuf message.
pub(super) fn write_foxglove(c: &Config) -> Result<String, UnsupportedLens> {
    let (model, k) = match c.model.projection() {
        Projection::Angle => ("kannala_brandt", coefficients(c, 4)),
        Projection::Plane => ("plumb_bob", coefficients(c, 5)),
        Projection::Own => return Err(unsupported_projection(c, Format::Foxglove)),
    };
    Ok(format!(
        "{{\n  \"timestamp\": {{\"sec\": 0, \"nsec\": 0}},\n  \"frame_id\": \"camera\",\n  \"width\": {},\n  \
         \"height\": {},\n  \"distortion_model\": \"{model}\",\n  \"D\": {},\n  \"K\": {},\n  \"R\": {},\n  \
         \"P\": {}\n}}\n",
        c.width,
        c.height,
        format_list(&k),
        format_list(&matrix(c)),
        format_list(&RECTIFICATION),
        format_list(&projection(c)),
    ))
}

fn coefficients(c: &Config, count: usize) -> Vec<f64> {
    (0..count).map(|i| c.coefficient(i)).collect()
}
