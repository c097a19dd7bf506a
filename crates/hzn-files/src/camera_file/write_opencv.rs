//! Writes OpenCV's FileStorage: YAML, XML and JSON.

use hzn_core::camera::{Config, Projection};

use super::format::{Format, UnsupportedLens, refuse_own_projection};
use super::numbers::{format_list, format_number, matrix};

/// What a file of OpenCV has.
struct Storage {
    width: u16,
    height: u16,
    fisheye: u8,
    matrix: [f64; 9],
    /// The coefficients are a column.
    coefficients: Vec<f64>,
}

impl Storage {
    fn new(c: &Config, format: Format) -> Result<Self, UnsupportedLens> {
        refuse_own_projection(c, format)?;
        let fisheye = c.model.projection() == Projection::Angle;
        let count = if fisheye { 4 } else { 5 };
        Ok(Self {
            width: c.width,
            height: c.height,
            fisheye: u8::from(fisheye),
            matrix: matrix(c),
            coefficients: (0..count).map(|i| c.coefficient(i)).collect(),
        })
    }
}

/// Writes YAML.
pub(super) fn write_yaml(c: &Config) -> Result<String, UnsupportedLens> {
    let s = Storage::new(c, Format::OpenCv)?;
    let matrix = |rows: usize, cols: usize, data: &[f64]| {
        format!("!!opencv-matrix\n   rows: {rows}\n   cols: {cols}\n   dt: d\n   data: {}", format_list(data))
    };
    Ok(format!(
        "%YAML:1.0\n---\nimage_width: {}\nimage_height: {}\nfisheye_model: {}\ncamera_matrix: {}\n\
         distortion_coefficients: {}\n",
        s.width,
        s.height,
        s.fisheye,
        matrix(3, 3, &s.matrix),
        matrix(s.coefficients.len(), 1, &s.coefficients)
    ))
}

/// Writes XML.
pub(super) fn write_xml(c: &Config) -> Result<String, UnsupportedLens> {
    let s = Storage::new(c, Format::OpenCvXml)?;
    let matrix = |name: &str, rows: usize, cols: usize, data: &[f64]| {
        let numbers: Vec<String> = data.iter().map(|x| format_number(*x)).collect();
        format!(
            "<{name} type_id=\"opencv-matrix\">\n  <rows>{rows}</rows>\n  <cols>{cols}</cols>\n  <dt>d</dt>\n  \
             <data>\n    {}</data></{name}>\n",
            numbers.join(" ")
        )
    };
    Ok(format!(
        "<?xml version=\"1.0\"?>\n<opencv_storage>\n<image_width>{}</image_width>\n<image_height>{}</image_height>\n\
         <fisheye_model>{}</fisheye_model>\n{}{}</opencv_storage>\n",
        s.width,
        s.height,
        s.fisheye,
        matrix("camera_matrix", 3, 3, &s.matrix),
        matrix("distortion_coefficients", s.coefficients.len(), 1, &s.coefficients)
    ))
}

/// Writes JSON.
pub(super) fn write_json(c: &Config) -> Result<String, UnsupportedLens> {
    let s = Storage::new(c, Format::OpenCvJson)?;
    let matrix = |rows: usize, cols: usize, data: &[f64]| {
        format!(
            "{{\n        \"type_id\": \"opencv-matrix\",\n        \"rows\": {rows},\n        \
             \"cols\": {cols},\n        \"dt\": \"d\",\n        \"data\": {}\n    }}",
            format_list(data)
        )
    };
    Ok(format!(
        "{{\n    \"image_width\": {},\n    \"image_height\": {},\n    \"fisheye_model\": {},\n    \
         \"camera_matrix\": {},\n    \"distortion_coefficients\": {}\n}}\n",
        s.width,
        s.height,
        s.fisheye,
        matrix(3, 3, &s.matrix),
        matrix(s.coefficients.len(), 1, &s.coefficients)
    ))
}
