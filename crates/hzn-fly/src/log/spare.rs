//! Recordings that the log may remove when the disk is full: kept pictures are worth less than answers.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use super::folder;

/// The folders of the kept pictures. All clones are one.
#[derive(Debug, Clone, Default)]
pub(crate) struct Spare {
    folders: Arc<Mutex<Vec<PathBuf>>>,
    is_needed: Arc<AtomicBool>,
}

impl Spare {
    /// Adds a folder of recordings.
    pub(crate) fn add(&self, folder: &Path) {
        self.folders.lock().unwrap_or_else(PoisonError::into_inner).push(folder.to_owned());
    }

    /// Returns whether the log needs the disk, so that nothing else may be written from now on.
    pub(crate) fn is_needed(&self) -> bool {
        self.is_needed.load(Ordering::Relaxed)
    }

    /// Removes the recording with the smallest number in one of the folders. Returns its name; `None` if there is none.
    /// From now on [`Self::is_needed`] is true, so that no more are written.
    pub(super) fn remove_oldest(&self) -> Option<String> {
        // What is being written is left alone at first. Later it is a rest that the full disk did not let be finished.
        let was_needed = self.is_needed.swap(true, Ordering::Relaxed);
        let folders = self.folders.lock().unwrap_or_else(PoisonError::into_inner);
        folder::remove_oldest_of(&folders, was_needed)
    }
}
