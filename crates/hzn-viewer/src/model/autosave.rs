//! The autosaved session: changes that are not saved survive a crash of the window.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::{Fingerprint, Session, atomic_file};

/// Start of the names of autosaved sessions; the number of the process follows.
const STEM: &str = "unsaved-";

/// A session with changes that are not saved.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Unsaved {
    /// Path of the sensor.toml; for a text from a recording, the path at which it would be saved.
    pub home: PathBuf,
    /// True if `home` exists as the file of the session.
    pub is_file: bool,
    /// Fingerprint of the file as it was last read or written. Earlier versions did not store it.
    #[serde(default)]
    pub as_read: Option<Fingerprint>,
    /// True if the user opened the file himself, so that it stays when other pictures are opened.
    #[serde(default)]
    pub is_opened_by_user: bool,
    /// Text of the file, if the pictures added something to it. Earlier versions did not store it.
    #[serde(default)]
    pub on_file: Option<String>,
    /// Text as it was read or last saved.
    pub saved: String,
    /// Text with the changes.
    pub text: String,
    /// Files and folders that were open.
    pub inputs: Vec<PathBuf>,
}

impl Unsaved {
    /// Takes the changes of a session.
    pub fn of_session(session: &Session, inputs: &[PathBuf]) -> Self {
        Self {
            home: absolute(session.home()),
            is_file: session.path().is_some(),
            as_read: session.as_read(),
            is_opened_by_user: session.is_opened_by_user(),
            on_file: (session.on_file() != session.saved()).then(|| session.on_file().text().to_owned()),
            saved: session.saved().text().to_owned(),
            text: session.sheet().text().to_owned(),
            inputs: inputs.iter().map(|p| absolute(p)).collect(),
        }
    }
    /// Returns the session with its changes. Undo goes back to the saved text.
    pub fn into_session(self) -> Session {
        let as_read = self.is_file.then(|| self.as_read.unwrap_or_else(|| Fingerprint::of(&self.saved)));
        let session = Session::new(&self.saved, &self.home, as_read);
        let mut session = session.completed_from(self.on_file.as_deref().unwrap_or(&self.saved));
        session.set_text(&self.text);
        if self.is_opened_by_user { session.opened_by_user() } else { session }
    }
}

/// Returns the absolute path, also of a file that does not exist.
pub(crate) fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
}

/// The file that a window writes its changes to.
#[derive(Debug, Clone)]
pub struct Autosave {
    path: PathBuf,
}

impl Autosave {
    /// Returns the file of this process in `folder`.
    pub fn in_folder(folder: &Path) -> Self {
        Self { path: folder.join(format!("{STEM}{}.json", std::process::id())) }
    }
    /// Writes the changes.
    ///
    /// # Errors
    /// The file cannot be written; the message says why and what to do.
    pub fn write(&self, unsaved: &Unsaved) -> Result<(), String> {
        if let Some(folder) = self.path.parent() {
            std::fs::create_dir_all(folder).map_err(|e| hzn_run::disk::advice(folder, &e))?;
        }
        atomic_file::write(&self.path, &serde_json::to_vec(unsaved).map_err(|e| e.to_string())?)
    }
    /// Removes the file, because there are no changes that could be lost.
    pub fn remove(&self) {
        let _ = std::fs::remove_file(&self.path);
    }
    /// Returns the newest session of a window that ended without an answer to its changes, with its file.
    pub fn find_lost(folder: &Path) -> Option<(Unsaved, PathBuf)> {
        let files = std::fs::read_dir(folder).ok()?.filter_map(Result::ok);
        let lost = files.filter(|f| process_of(&f.file_name().to_string_lossy()).is_some_and(|id| !is_running(id)));
        let mut lost: Vec<_> = lost.filter_map(|f| Some((f.metadata().ok()?.modified().ok()?, f.path()))).collect();
        lost.sort();
        lost.into_iter().rev().find_map(|(_, path)| {
            let unsaved = serde_json::from_slice(&std::fs::read(&path).ok()?).ok()?;
            Some((unsaved, path))
        })
    }
}

/// Returns the number of the process that a file name has.
fn process_of(name: &str) -> Option<u32> {
    name.strip_prefix(STEM)?.strip_suffix(".json")?.parse().ok()
}

/// Returns true if a process runs. Where the system has no list of processes, only this process counts as running.
fn is_running(id: u32) -> bool {
    id == std::process::id() || Path::new("/proc").join(id.to_string()).exists()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_of_a_window_that_crashed_come_back() {
        let dir = tempfile::tempdir().unwrap();
        let text = "preset = \"hzn\"\n";
        // The number of bits was added to the text of the file.
        let as_read = Some(Fingerprint::of("before"));
        let session = Session::new(text, Path::new("/flight/sensor.toml"), as_read).completed_from("before");
        let mut session = session.opened_by_user();
        session.set("threshold", "scale", 0, Some(1.5.into()));
        let unsaved = Unsaved::of_session(&session, &[PathBuf::from("/flight")]);
        let own = Autosave::in_folder(dir.path());
        own.write(&unsaved).unwrap();
        assert_eq!(Autosave::find_lost(dir.path()), None, "this window still runs");
        // No process has this number.
        let lost = dir.path().join("unsaved-4294967295.json");
        std::fs::copy(&own.path, &lost).unwrap();
        std::fs::write(dir.path().join("unsaved-4294967294.json"), "{").unwrap();
        let (found, path) = Autosave::find_lost(dir.path()).unwrap();
        assert_eq!((&found, path), (&unsaved, lost));
        let mut again = found.into_session();
        assert!(again.is_changed() && again.sheet().text().contains("scale = 1.5"));
        assert!(again.as_read() == as_read && again.is_opened_by_user());
        assert_eq!(again.on_file().text(), "before");
        again.undo();
        assert!(!again.is_changed());
        own.remove();
        assert!(!own.path.exists());
    }
}
