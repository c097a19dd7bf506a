//! The calibration that a recording of ROS 2 has beside its pictures.

use std::path::{Path, PathBuf};

use hzn_core::camera::Config;
use hzn_files::camera_file;
use hzn_mcap::ImageReader;

use super::bag;
use super::paths::ending;
use crate::error::{Error, unusable};

/// Number of pictures after which no calibration is expected. A driver sends one with every picture.
const PICTURES: usize = 16;

/// A calibration in a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedCamera {
    /// Its topic.
    pub topic: String,
    /// The lens and the size of the picture, or why they cannot be used.
    pub camera: Result<Config, String>,
}

/// Returns the calibration (`sensor_msgs/msg/CameraInfo`) of the pictures of a bag of ROS 2, or of a recording; `None`
/// if the input is something else or has none.
///
/// # Errors
/// The recording cannot be read.
pub fn find_camera(inputs: &[PathBuf]) -> Result<Option<RecordedCamera>, Error> {
    let [input] = inputs else { return Ok(None) };
    let first = if bag::is_bag(input) {
        bag::files(input).ok().and_then(|[files, _]| files.into_iter().next())
    } else {
        (input.is_file() && ending(input) == "mcap").then(|| input.clone())
    };
    let Some(path) = first else { return Ok(None) };
    let mut reader = ImageReader::open(&path, None).map_err(unusable)?;
    for _ in 0..PICTURES {
        if reader.next().is_none() || reader.camera().is_some() {
            break;
        }
    }
    let Some((topic, info)) = reader.camera() else { return Ok(None) };
    let camera = camera_file::parse(&info.to_yaml(), Path::new(topic), None).map_err(|problem| match problem.field {
        Some(field) => format!("{field}: {}", problem.what),
        None => problem.what,
    });
    Ok(Some(RecordedCamera { topic: topic.to_owned(), camera }))
}
