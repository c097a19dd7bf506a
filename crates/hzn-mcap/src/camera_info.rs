//! Calibrations in recordings of ROS 2.

use std::collections::BTreeSet;

/// A calibration as `sensor_msgs/msg/CameraInfo` has it.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraInfo {
    /// Columns and rows of the whole picture of the camera, before binning and the region of interest.
    pub size_px: [u32; 2],
    /// Name of the distortion model, for example `plumb_bob`.
    pub model: String,
    /// Coefficients of the distortion.
    pub distortion: Vec<f64>,
    /// The camera matrix of the whole picture, row by row (`k`).
    pub matrix: [f64; 9],
    /// The projection of the rectified whole picture, three rows of four numbers (`p`).
    pub projection: [f64; 12],
    /// Number of columns, and of rows, that are summed to one; 0 is the same as 1.
    pub binning: [u32; 2],
    /// The part of the whole picture that the camera sends.
    pub roi: Region,
}

/// A part of a picture, in pixels of the whole picture (`sensor_msgs/msg/RegionOfInterest`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Region {
    /// Column and row of its first pixel.
    pub offset_px: [u32; 2],
    /// Its columns and rows; 0 is the whole picture.
    pub size_px: [u32; 2],
}

/// The schema of such messages.
pub(crate) const SCHEMA: &str = "sensor_msgs/msg/CameraInfo";

impl CameraInfo {
    /// Returns the calibration as a YAML file of ROS, with binning and region of interest: that of the pictures as the
    /// lens makes them, or that of rectified pictures, which have no distortion any more.
    pub fn to_yaml(&self, rectified: bool) -> String {
        let ([width, height], [bin_x, bin_y]) = (self.size_px, self.binning);
        let Region { offset_px: [x, y], size_px: [roi_width, roi_height] } = self.roi;
        let [fx, skew, cx, _, shear, fy, cy, _, zero_x, zero_y, one, _] = self.projection;
        let (matrix, model, distortion) = match rectified {
            true => ([fx, skew, cx, shear, fy, cy, zero_x, zero_y, one], "plumb_bob", &[0.0; 5][..]),
            false => (self.matrix, self.model.as_str(), &self.distortion[..]),
        };
        format!(
            "image_width: {width}\nimage_height: {height}\ncamera_name: camera\ncamera_matrix:\n  rows: 3\n  cols: \
             3\n  data: {matrix:?}\ndistortion_model: {model:?}\ndistortion_coefficients:\n  rows: 1\n  cols: {}\n  \
             data: {distortion:?}\nbinning_x: {bin_x}\nbinning_y: {bin_y}\nroi:\n  x_offset: {x}\n  y_offset: {y}\n  \
             width: {roi_width}\n  height: {roi_height}\n",
            distortion.len(),
        )
    }

    /// Returns the fields that the size of the pictures follows from, in words. A field that changes nothing is left
    /// out.
    pub fn describe_size(&self) -> String {
        let Region { offset_px: [x, y], size_px: [width, height] } = self.roi;
        let fields = [
            ("binning_x", self.binning[0], self.binning[0] > 1),
            ("binning_y", self.binning[1], self.binning[1] > 1),
            ("roi.x_offset", x, x > 0),
            ("roi.y_offset", y, y > 0),
            ("roi.width", width, width > 0),
            ("roi.height", height, height > 0),
        ];
        let used = fields.iter().filter(|(.., is_used)| *is_used).map(|(name, value, _)| format!(", {name} {value}"));
        format!("width {}, height {}{}", self.size_px[0], self.size_px[1], used.collect::<String>())
    }
}

/// Returns whether pictures of this topic are rectified, by the names that `image_proc` gives them: `image_rect`,
/// `image_rect_color`, and these with the name of a transport after them.
pub(crate) fn is_rectified(pictures: &str) -> bool {
    pictures.split('/').any(|part| part.starts_with("image_rect"))
}

/// Returns the namespace of a topic.
fn space(topic: &str) -> &str {
    topic.rsplit_once('/').map_or("", |(space, _)| space)
}

/// Returns whether a topic is in a namespace.
fn is_in(space: &str, topic: &str) -> bool {
    topic.strip_prefix(space).is_some_and(|rest| rest.starts_with('/'))
}

/// Returns which of these topics has the calibration of the pictures of a topic: the one in the same or the nearest
/// namespace above, such as `/front/camera_info` for `/front/image_raw/compressed`; or else the only one, unless it is
/// that of another camera, whose pictures are on one of `all_pictures`.
pub(crate) fn topic_of<'a>(
    pictures: &str,
    infos: impl Iterator<Item = &'a str> + Clone,
    all_pictures: &BTreeSet<String>,
) -> Option<&'a str> {
    let nearest = infos.clone().filter(|topic| is_in(space(topic), pictures)).max_by_key(|topic| space(topic).len());
    let mut all = infos;
    nearest.or_else(|| {
        let only = all.next().filter(|_| all.next().is_none());
        only.filter(|topic| !all_pictures.iter().any(|other| is_in(space(topic), other)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_calibration_of_the_same_namespace_is_taken() {
        let two = ["/front/camera_info", "/rear/camera_info"];
        let none = BTreeSet::new();
        let of = |pictures| topic_of(pictures, two.into_iter(), &none);
        assert_eq!(of("/front/image_raw"), Some(two[0]));
        assert_eq!(of("/rear/image_raw/compressed"), Some(two[1]));
        assert_eq!(of("/frontal/image_raw"), None);
        let only = |others: &BTreeSet<String>| topic_of("/other/image", two.into_iter().take(1), others);
        assert_eq!(only(&none), Some(two[0]));
        // The only calibration of a bag can be that of the other camera.
        assert_eq!(only(&BTreeSet::from(["/front/image_raw".to_owned()])), None);
        assert_eq!(only(&BTreeSet::from(["/frontal/image_raw".to_owned()])), Some(two[0]));
        assert_eq!(topic_of("/image", ["/camera_info", "/a/camera_info"].into_iter(), &none), Some("/camera_info"));
    }

    #[test]
    fn rectified_pictures_are_known_by_their_topic() {
        assert!(is_rectified("/front/image_rect") && is_rectified("/front/image_rect_color/compressed"));
        assert!(!is_rectified("/front/image_raw") && !is_rectified("/rect/image"));
    }
}
