//! Results of other commands that belong to a sequence: the navigation of `hzn fuse`, and the residuals of a lens
//! calibration. They are read on a separate thread.

use std::path::{Path, PathBuf};

use crossbeam_channel::{Receiver, unbounded};
use hzn_calib::residual_table;
use hzn_fuse::read_back;

use super::Wake;
use crate::model::lens_residuals::{Arrow, LensResiduals};
use crate::model::navigation::Navigation;

/// Kind of a file of another command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Results of `hzn fuse`.
    Navigation,
    /// Residuals of `hzn calibrate board` or `hzn calibrate points`.
    Residuals,
}

/// Something that was read.
#[derive(Debug)]
pub enum Companion {
    /// Results of `hzn fuse`, and whether they must be proven to be of the shown pictures.
    Navigation(Navigation, bool),
    /// Residuals of a lens calibration.
    Residuals(LensResiduals),
    /// A file cannot be read, for this reason.
    Failed(String),
}

/// Returns the kind of a file; `None` for all other files. Only the beginning of the file is read.
pub fn kind_of(path: &Path) -> Option<Kind> {
    if !path.is_file() {
        None
    } else if read_back::is_solution(path) {
        Some(Kind::Navigation)
    } else if residual_table::is_table(path) {
        Some(Kind::Residuals)
    } else {
        None
    }
}

/// Returns the files that belong to a sequence by their names: `nav.mcap` or `nav.csv`, and `residuals.csv`. They lie
/// in one of these folders; the first one with a file counts. The flag of a file is true if it does not lie in `own`,
/// the folder of these pictures alone.
fn find(folders: &[PathBuf], own: Option<&Path>) -> Vec<(PathBuf, bool)> {
    let navigation = folders.iter().find_map(|folder| read_back::find_solution(folder));
    let residuals = folders.iter().find_map(|folder| residual_table::find(folder));
    navigation.into_iter().chain(residuals).map(|path| (path.clone(), path.parent() != own)).collect()
}

/// Starts to look in these folders and to read what is found. `own` is the folder that has these pictures alone.
pub fn search(folders: Vec<PathBuf>, own: Option<PathBuf>, wake: Wake) -> Receiver<Companion> {
    start(move || find(&folders, own.as_deref()), wake)
}

/// Starts to read a file that the user chose.
pub fn load(path: PathBuf, wake: Wake) -> Receiver<Companion> {
    start(move || vec![(path, false)], wake)
}

fn start(paths: impl FnOnce() -> Vec<(PathBuf, bool)> + Send + 'static, wake: Wake) -> Receiver<Companion> {
    let (send, receive) = unbounded();
    std::thread::spawn(move || {
        for (path, is_doubtful) in paths() {
            if send.send(read(&path, is_doubtful)).is_err() {
                return;
            }
            wake();
        }
    });
    receive
}

fn read(path: &Path, is_doubtful: bool) -> Companion {
    let read = match kind_of(path) {
        Some(Kind::Navigation) => read_back::read_solution(path)
            .map(|solution| Companion::Navigation(Navigation::new(path, &solution), is_doubtful))
            .map_err(|e| e.to_string()),
        Some(Kind::Residuals) => residual_table::read(path).map_err(|e| e.to_string()).map(|rows| {
            let arrow = |r: hzn_calib::board::Residual| Arrow { at: r.at_px, error: r.error_px, counts: r.counts };
            let rows = rows.into_iter().map(|(name, residual)| (name, arrow(residual)));
            Companion::Residuals(LensResiduals::new(path, rows))
        }),
        None => Err(format!("{}: is neither a result of hzn fuse nor a table of residuals", path.display())),
    };
    read.unwrap_or_else(Companion::Failed)
}
