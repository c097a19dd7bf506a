//! The pictures of an earlier rendering in a folder.

use std::path::{Path, PathBuf};

use hzn_files::truth::Truth;
use hzn_run::disk;

use crate::exit::Stop;

/// Returns the pictures of an earlier rendering. These are the pictures that truth.csv in the folder lists, as only
/// rendered pictures have a truth.
pub(crate) fn pictures(folder: &Path) -> Vec<PathBuf> {
    let Ok(mut before) = csv::Reader::from_path(folder.join("truth.csv")) else { return Vec::new() };
    let truths = before.deserialize::<Truth>().map_while(Result::ok);
    let paths = truths.map(|truth| folder.join(Path::new(&truth.file).file_name().unwrap_or_default()));
    paths.filter(|path| path.is_file()).collect()
}

/// Removes the pictures of an earlier rendering, because new tables would not list them.
pub(crate) fn clear(folder: &Path) -> Result<(), Stop> {
    // A picture of several bodies is listed several times.
    for path in pictures(folder).into_iter().filter(|path| path.is_file()) {
        std::fs::remove_file(&path).map_err(|e| disk::cannot_write(&path, &e))?;
    }
    Ok(())
}
