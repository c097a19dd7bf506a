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
    /// Its topic. For rectified pictures it also names the field of the message that the lens comes from.
    pub from: String,
    /// The lens and the size of the pictures that it makes, after binning and the region of interest; or why they
    /// cannot be used.
    pub camera: Result<Config, String>,
    /// The fields of the message that the size follows from, with their values.
    pub size_fields: String,
}

/// Returns the calibration (`sensor_msgs/msg/CameraInfo`) of the pictures of a bag of ROS 2, or of a recording; `None`
/// if the input is something else or has none. `topic` is that of the pictures; without it, the first one.
///
/// # Errors
/// A recording cannot be read.
pub fn find_camera(inputs: &[PathBuf], topic: Option<&str>) -> Result<Option<RecordedCamera>, Error> {
    let [input] = inputs else { return Ok(None) };
    let files = if bag::is_bag(input) {
        bag::files(input).map(|[files, _]| files).unwrap_or_default()
    } else if input.is_file() && ending(input) == "mcap" {
        vec![input.clone()]
    } else {
        Vec::new()
    };
    for path in &files {
        let mut reader = ImageReader::open(path, topic).map_err(unusable)?;
        // The messages of another camera may come first, so that one calibration alone says nothing.
        let pictures = reader.by_ref().take(PICTURES).count();
        if let Some(found) = recorded(&reader) {
            return Ok(Some(found));
        }
        // The recordings at the beginning of a bag may have no pictures of the topic.
        if pictures > 0 {
            break;
        }
    }
    Ok(None)
}

/// Returns the calibration among the messages that were read so far.
fn recorded(reader: &ImageReader) -> Option<RecordedCamera> {
    let (topic, info) = reader.camera()?;
    let rectified = reader.is_rectified();
    let from = if rectified { format!("p of {topic} (the pictures are rectified)") } else { topic.to_owned() };
    let info = match info {
        Ok(info) => info,
        Err(why) => return Some(RecordedCamera { from, camera: Err(why.to_owned()), size_fields: String::new() }),
    };
    let read = camera_file::parse(&info.to_yaml(rectified), Path::new(topic), None);
    let camera = read.map_err(|problem| match problem.field {
        Some(field) => format!("{field}: {}", problem.what),
        None => problem.what,
    });
    Some(RecordedCamera { from, camera, size_fields: info.describe_size() })
}
