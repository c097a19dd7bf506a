//! The field of view of a camera of which nothing is known, for `hzn init`.

use hzn_files::FrameData;
use hzn_files::start::CameraFacts;
use hzn_run::diagnosis::{FieldOfView, find_field_of_view};
use hzn_run::open::{Request, frames_path, load_frames};
use hzn_run::source::{self, Picture};

use crate::exit::{Stop, usage};

/// Number of pictures that are looked at. The error that all pictures share is larger than that of eight pictures.
const PICTURES: u64 = 8;

/// Finds the field of view from the limb in some pictures, which have the `known` altitude or one in frames.csv. `None`
/// if no altitude is known.
///
/// # Errors
/// A file cannot be read, or no picture shows a limb that says the field of view.
pub(crate) fn find(request: &Request, known: &CameraFacts) -> Result<Option<FieldOfView>, Stop> {
    let mut source = source::open(&request.inputs, None, None)?;
    let frames = frames_path(request, source.as_ref()).map(|path| load_frames(&path, source.as_ref())).transpose()?;
    let knows = |data: &FrameData| data.position_km.is_some() || data.altitude_km.is_some();
    // The pictures of a folder are spread over it. A sequence of unknown length gives its first ones.
    let step = source.total().map_or(1, |total| (total / PICTURES).max(1));
    let mut pictures: Vec<(Picture, Option<FrameData>)> = Vec::new();
    let mut index = 0;
    while let Some(item) = source.next() {
        let mut item = item?;
        index += 1;
        if (index - 1) % step != 0 {
            continue;
        }
        let data = item.take_prior(frames.as_ref()).filter(knows);
        if known.altitude_km.is_none() && data.is_none() {
            continue;
        }
        if let Ok((picture, _)) = item.payload.decode(None) {
            pictures.push((picture, data));
        }
        if pictures.len() as u64 >= PICTURES {
            break;
        }
    }
    if pictures.is_empty() {
        return Ok(None);
    }
    let found = find_field_of_view(&pictures, known).ok_or_else(|| {
        usage(format!(
            "the field of view is not known (no --fov, no usable EXIF), and the limb in {} pictures does not say it; \
             add the field of view over the whole width, for example --fov 60, and --lens fisheye or --lens pinhole",
            pictures.len()
        ))
    })?;
    Ok(Some(found))
}
