//! Checks of input paths, and their endings.

use std::fs::File;
use std::io;
use std::path::Path;

use crate::error::{Error, unusable};

/// Checks that an input file exists. Returns the ending of its kind, and whether an unfinished run left it. An
/// unfinished file has the ending of its kind before `.part`.
///
/// # Errors
/// The file does not exist, or is not a regular file.
pub fn check_exists(file: &Path) -> Result<(String, bool), Error> {
    if !file.is_file() {
        let what = match (file.is_dir(), file.exists()) {
            (true, _) => "is a folder; a file is expected here",
            (_, true) => "is a device, a pipe or a socket; a file is expected here",
            _ => "no such file",
        };
        return Err(unusable(format!("{}: {what}", file.display())));
    }
    let unfinished = ending(file) == "part";
    Ok((if unfinished { ending(&file.with_extension("")) } else { ending(file) }, unfinished))
}

/// Returns the file's ending in lower case, without the dot.
pub fn ending(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}

/// Opens a regular file. A device can have no end, and to open a pipe waits for its other end, so these are refused.
///
/// # Errors
/// It cannot be opened, or is not a regular file.
pub fn open_file(path: &Path) -> io::Result<File> {
    let meta = std::fs::metadata(path)?;
    match (meta.is_file(), meta.is_dir()) {
        (true, _) => File::open(path),
        (_, true) => Err(io::Error::new(io::ErrorKind::IsADirectory, "is a folder")),
        _ => Err(io::Error::new(io::ErrorKind::InvalidInput, "is a device, a pipe or a socket, not a file")),
    }
}
