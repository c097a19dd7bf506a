//! The files of a command. No output replaces a file that the command reads.

use std::path::{Path, PathBuf};

use hzn_files::{files_of_sensor, named_camera_file};
use hzn_run::disk;
use hzn_run::open::{Request, frames_path, sensor_path};
use hzn_run::source::{Source, ending};

use crate::exit::Stop;

/// Refuses outputs that are read as well, also with `force`. Without it, refuses outputs that exist, too.
///
/// # Errors
/// The first output that is refused, as wrong usage.
pub(crate) fn check_outputs(read: &[PathBuf], written: &[PathBuf], force: bool) -> Result<(), Stop> {
    disk::refuse_inputs(read, written)?;
    Ok(written.iter().try_for_each(|path| disk::refuse_existing(path, force))?)
}

/// Returns every file that is read for a sequence: the pictures, the sensor, its camera file, frames.csv.
pub(crate) fn of_sequence(source: &dyn Source, request: &Request) -> Vec<PathBuf> {
    let mut files = source.files();
    match (sensor_path(request, source), source.sensor_toml()) {
        (Some(path), _) => files.extend(files_of_sensor(&path)),
        (None, Some(text)) => files.extend(named_camera_file(text, &source.folder().join("sensor.toml"))),
        (None, None) => {}
    }
    files.extend(frames_path(request, source));
    files
}

/// Returns what a command that writes pictures into a folder can replace there: everything with the ending of a
/// picture.
pub(crate) fn pictures_in(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let is_picture =
        |path: &PathBuf| matches!(ending(path).as_str(), "png" | "jpg" | "jpeg" | "jpe" | "fits" | "fit" | "fts");
    entries.map(|entry| entry.path()).filter(is_picture).collect()
}
