//! Files of OpenCV with several cameras: two of a stereo calibration (M1, D1, M2, D2), or a list of cameras.

use serde_json::{Map, Value};

use super::opencv::{MATRIX, VALUES, plain};
use super::values::matrix;

/// The cameras of a file, each with the values that one camera's file would have.
pub(super) type Cameras = Vec<(String, Map<String, Value>)>;

/// The names of the camera matrix that only files of several cameras have: M1 of OpenCV's stereo sample.
const STEREO_MATRIX: &str = "m";

/// Finds the cameras of a file that has several; the list is empty for another file.
pub(super) fn find(top: &Map<String, Value>) -> Cameras {
    if top.keys().any(|key| MATRIX.contains(&plain(key).as_str())) {
        return Vec::new();
    }
    let cameras = tagged(top);
    if !cameras.is_empty() {
        return cameras;
    }
    let direct = nested(top.iter().map(|(key, value)| (key.clone(), value)), top);
    if !direct.is_empty() {
        return direct;
    }
    top.values().map(|group| nested(members(group), top)).find(|cameras| !cameras.is_empty()).unwrap_or_default()
}

/// Returns the cameras whose number or side is part of the names: `M1`, `cameraMatrix1`, `K_left`, `left_K`.
fn tagged(top: &Map<String, Value>) -> Cameras {
    let mut cameras: Cameras = Vec::new();
    for (key, value) in top {
        let Some((name, tag)) = split(key) else { continue };
        let is_matrix = name == STEREO_MATRIX || MATRIX.contains(&name);
        if is_matrix && matrix(value).is_some_and(|m| m.len() == 9) {
            cameras.push((tag, shared(top)));
        }
    }
    for (key, value) in top {
        let Some((name, tag)) = split(key) else { continue };
        if let Some((_, camera)) = cameras.iter_mut().find(|(known, _)| *known == tag) {
            let name = if name == STEREO_MATRIX { MATRIX[0] } else { name };
            camera.insert(name.to_owned(), value.clone());
        }
    }
    cameras
}

/// Splits a key into the name of a value and the tag of its camera.
fn split(key: &str) -> Option<(&'static str, String)> {
    let plain = plain(key);
    let names = VALUES.iter().flat_map(|names| names.iter()).copied().chain([STEREO_MATRIX]);
    let tags = names.flat_map(|name| {
        let ends = [plain.strip_suffix(name), plain.strip_prefix(name)];
        ends.into_iter().flatten().filter(|tag| is_tag(tag)).map(|tag| (name, tag.to_owned())).collect::<Vec<_>>()
    });
    tags.max_by_key(|(name, _)| name.len())
}

/// Returns whether a part of a name is the number or the side of a camera.
fn is_tag(tag: &str) -> bool {
    let number = tag.strip_prefix("camera").or_else(|| tag.strip_prefix("cam")).unwrap_or(tag);
    let is_number = !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit());
    is_number || matches!(tag, "left" | "right" | "l" | "r")
}

/// Returns the cameras among named values: those with a camera matrix.
fn nested<'a>(members: impl Iterator<Item = (String, &'a Value)>, top: &Map<String, Value>) -> Cameras {
    let camera = |(name, value): (String, &Value)| {
        let own = value.as_object().filter(|own| own.keys().any(|key| MATRIX.contains(&plain(key).as_str())))?;
        let mut camera = shared(top);
        // The file's own size would be a second one next to the camera's.
        if own.keys().any(|key| SIZES.contains(&plain(key).as_str())) {
            camera.retain(|key, _| !SIZES.contains(&plain(key).as_str()));
        }
        camera.extend(own.clone());
        Some((name, camera))
    };
    members.filter_map(camera).collect()
}

/// The names of the picture's size.
const SIZES: &[&str] = &["imagewidth", "width", "imageheight", "height", "imagesize", "size", "resolution"];

/// Returns the members of a group with their names: its keys, or what its elements call themselves, or their places.
fn members(group: &Value) -> Box<dyn Iterator<Item = (String, &Value)> + '_> {
    match group {
        Value::Object(group) => Box::new(group.iter().map(|(key, value)| (key.clone(), value))),
        Value::Array(list) => Box::new(list.iter().enumerate().map(|(n, value)| {
            let own = ["name", "camera_name", "id"].iter().find_map(|key| match value.get(*key)? {
                Value::String(name) => Some(name.clone()),
                Value::Number(number) => Some(number.to_string()),
                _ => None,
            });
            (own.unwrap_or_else(|| n.to_string()), value)
        })),
        _ => Box::new(std::iter::empty()),
    }
}

/// Returns the values that all cameras share: those with the plain name of a value.
fn shared(top: &Map<String, Value>) -> Map<String, Value> {
    let is_value = |key: &str| VALUES.iter().any(|names| names.contains(&plain(key).as_str()));
    top.iter().filter(|(key, _)| is_value(key)).map(|(key, value)| (key.clone(), value.clone())).collect()
}
