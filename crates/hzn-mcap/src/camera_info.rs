//! Calibrations in recordings of ROS 2.

/// A calibration as `sensor_msgs/msg/CameraInfo` has it.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraInfo {
    /// Columns and rows of the pictures.
    pub size_px: [u32; 2],
    /// Name of the distortion model, for example `plumb_bob`.
    pub model: String,
    /// Coefficients of the distortion.
    pub distortion: Vec<f64>,
    /// The camera matrix, row by row.
    pub matrix: [f64; 9],
}

/// The schema of such messages.
pub(crate) const SCHEMA: &str = "sensor_msgs/msg/CameraInfo";

impl CameraInfo {
    /// Returns the calibration as the YAML file of ROS's camera calibrator.
    pub fn to_yaml(&self) -> String {
        let [width, height] = self.size_px;
        format!(
            "image_width: {width}\nimage_height: {height}\ncamera_name: camera\ncamera_matrix:\n  rows: 3\n  cols: \
             3\n  data: {:?}\ndistortion_model: {:?}\ndistortion_coefficients:\n  rows: 1\n  cols: {}\n  data: {:?}\n",
            self.matrix,
            self.model,
            self.distortion.len(),
            self.distortion
        )
    }
}

/// Returns which of these topics has the calibration of the pictures of a topic: the one in the same or the nearest
/// namespace above, such as `/front/camera_info` for `/front/image_raw/compressed`; the only one if there is one.
pub(crate) fn topic_of<'a>(pictures: &str, infos: impl Iterator<Item = &'a str> + Clone) -> Option<&'a str> {
    let space = |topic: &'a str| topic.rsplit_once('/').map_or("", |(space, _)| space);
    let holds = |space: &str| pictures.strip_prefix(space).is_some_and(|rest| rest.starts_with('/'));
    let nearest = infos.clone().filter(|topic| holds(space(topic))).max_by_key(|topic| space(topic).len());
    let mut all = infos;
    nearest.or_else(|| all.next().filter(|_| all.next().is_none()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_calibration_of_the_same_namespace_is_taken() {
        let two = ["/front/camera_info", "/rear/camera_info"];
        let of = |pictures| topic_of(pictures, two.into_iter());
        assert_eq!(of("/front/image_raw"), Some(two[0]));
        assert_eq!(of("/rear/image_raw/compressed"), Some(two[1]));
        assert_eq!(of("/frontal/image_raw"), None);
        assert_eq!(topic_of("/other/image", two.into_iter().take(1)), Some(two[0]));
        assert_eq!(topic_of("/image", ["/camera_info", "/a/camera_info"].into_iter()), Some("/camera_info"));
    }
}
