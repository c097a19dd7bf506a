//! Files outside the folder that is open: the window does not write to them before the user agrees.

use std::path::{Path, PathBuf};

use super::Viewer;
use super::changes::Outside;
use crate::model::autosave;
use crate::ui::path_dialog::{PathDialog, Purpose};

impl Viewer {
    /// Returns the question about a file that lies outside the folder of the pictures. `None` if the file lies in it,
    /// if the user has agreed to this file before, or if no pictures are open.
    pub(super) fn question_outside(&self, path: &Path) -> Option<Outside> {
        if self.sequence.inputs.is_empty() {
            return None;
        }
        let (file, folder) = (real_path(path), real_path(&self.sequence.folder));
        if file.starts_with(&folder) || self.changes.agreed.as_ref() == Some(&file) {
            return None;
        }
        // A link in the folder leads to the same file, so it is no other choice.
        let has_choice = real_path(&folder.join("sensor.toml")) != file;
        Some(Outside { path: file, folder, has_choice })
    }

    /// Notes that the user wants this file to be written as long as these pictures are open.
    pub(super) fn agree_to_file(&mut self, path: &Path) {
        self.changes.agreed = Some(real_path(path));
    }

    /// Takes the answer "Save there".
    pub(in crate::ui) fn save_outside(&mut self) {
        if let Some(outside) = self.changes.outside.take() {
            self.changes.agreed = Some(outside.path);
            self.save();
        }
    }

    /// Takes the answer "Save into the folder": the name can still be changed.
    pub(in crate::ui) fn save_inside(&mut self) {
        if let Some(outside) = self.changes.outside.take() {
            self.ask(PathDialog::new(Purpose::SaveSensor, &outside.folder.join("sensor.toml")));
        }
    }
}

/// Returns the path without links, also of a file that does not exist.
fn real_path(path: &Path) -> PathBuf {
    let path = autosave::absolute(path);
    let of_folder = || Some(path.parent()?.canonicalize().ok()?.join(path.file_name()?));
    path.canonicalize().ok().or_else(of_folder).unwrap_or_else(|| path.clone())
}
