//! The files that the user lets the window write. No file is replaced before the user agrees, and none gets a name that
//! belongs to another kind of file.

use std::path::{Path, PathBuf};

use super::Viewer;
use crate::model::{FileChange, Place, autosave};
use crate::ui::path_dialog::{Answer, PathDialog, Purpose};

impl Viewer {
    /// Saves the sensor.toml to its file, or asks first: for a path if the text comes from a recording, whether a file
    /// of another folder is meant, and what to do if another program changed the file.
    pub(super) fn save(&mut self) {
        let Some(session) = &self.session else { return };
        let outside = session.path().and_then(|path| self.question_outside(path));
        if outside.is_some() {
            self.changes.outside = outside;
            return;
        }
        match (session.path().map(Path::to_owned), session.file_change()) {
            (None, _) => self.ask(PathDialog::new(Purpose::SaveSensor, &autosave::absolute(session.home()))),
            (Some(_), Some(change)) => self.changes.of_file = Some(change),
            (Some(path), None) => self.save_to(&path),
        }
    }

    /// Saves the sensor.toml to `path`, which becomes the file of the session.
    fn save_to(&mut self, path: &Path) {
        match self.session.as_mut().map(|s| s.save(path)) {
            Some(Ok(())) => {
                self.agree_to_file(path);
                self.changes.is_sensor_kept = false;
                self.add_note(format!("Saved: {}", autosave::absolute(path).display()));
                self.continue_after_save();
            }
            Some(Err(why)) => {
                self.changes.after_save = None;
                self.add_problem(why);
            }
            None => {}
        }
    }

    /// Takes the answer "Overwrite" to the question about a file that another program changed.
    pub(in crate::ui) fn overwrite_file(&mut self) {
        (self.changes.of_file, self.changes.shows_difference) = (None, false);
        if let Some(path) = self.session.as_ref().and_then(|s| s.path()).map(Path::to_owned) {
            self.save_to(&path);
        }
    }

    /// Takes the answer "Reload" to the same question.
    pub(in crate::ui) fn reload_file(&mut self) {
        self.cancel_save();
        let Some(session) = &mut self.session else { return };
        match session.reload() {
            Ok(()) => {
                let home = autosave::absolute(session.home());
                self.add_note(format!("Reloaded: {}. Undo brings the text of this window back.", home.display()));
            }
            Err(problem) => self.add_problem(problem.to_string()),
        }
    }

    /// Takes the answer "Cancel" to the same question. What waited for the saved file does not happen.
    pub(in crate::ui) fn cancel_save(&mut self) {
        (self.changes.of_file, self.changes.after_save, self.changes.shows_difference) = (None, None, false);
        self.changes.outside = None;
    }

    /// Reads a sensor.toml again that another program changed while the window has no changes of its own, when the user
    /// comes back to the window.
    pub(super) fn reload_unchanged(&mut self, ctx: &egui::Context) {
        let comes_back = ctx.input(|i| i.events.contains(&egui::Event::WindowFocused(true)));
        let session = self.session.as_ref().filter(|session| comes_back && !session.is_changed());
        if !self.changes.is_asking() && session.is_some_and(|s| s.file_change() == Some(FileChange::Changed)) {
            self.reload_file();
        }
    }

    /// Takes the answer of the system's dialog for paths.
    pub(super) fn poll_path_dialog(&mut self) {
        match self.path_dialog.as_mut().map(PathDialog::take_answer) {
            Some(Answer::Accepted) => self.accept_path(),
            Some(Answer::Cancelled) => self.cancel_path(),
            _ => {}
        }
    }

    /// Closes the dialog without a path.
    pub(in crate::ui) fn cancel_path(&mut self) {
        self.path_dialog = None;
        self.changes.after_save = None;
    }

    /// Does what the path of the dialog is for, and closes the dialog. If the path cannot be written to, the dialog
    /// stays open with the reason. Every path comes here: typed, from the system's dialog, by key or by mouse.
    pub(in crate::ui) fn accept_path(&mut self) {
        let Some(dialog) = self.path_dialog.take() else { return };
        let purpose = dialog.purpose;
        let path = dialog.path();
        if !purpose.writes() {
            if !path.as_os_str().is_empty() {
                self.use_path(purpose, path);
            }
        } else if let Some(why) = self.refuse(purpose, &path) {
            self.path_dialog = Some(PathDialog { refused: Some(why), focus: true, ..dialog });
        } else if let Some(change) = self.change_of_own_file(purpose, &path) {
            self.changes.of_file = Some(change);
        } else if replaced(purpose, &path).is_some() {
            self.path_dialog = Some(PathDialog { replaces: true, ..dialog });
        } else {
            self.use_path(purpose, path);
        }
    }

    /// Takes the answer "Replace" to the question about a file that exists.
    pub(in crate::ui) fn replace_file(&mut self) {
        if let Some(dialog) = self.path_dialog.take() {
            self.use_path(dialog.purpose, dialog.path());
        }
    }

    /// Takes the other answer to this question: the dialog comes back, and the user changes the path.
    pub(in crate::ui) fn keep_file(&mut self) {
        if let Some(dialog) = &mut self.path_dialog {
            (dialog.replaces, dialog.focus) = (false, true);
        }
    }

    fn use_path(&mut self, purpose: Purpose, path: PathBuf) {
        match purpose {
            Purpose::Open => self.open_paths(vec![path]),
            Purpose::SaveSensor => self.save_to(&path),
            Purpose::Compare => self.compare_with_file(&path),
            Purpose::Picture => self.export_picture(path),
            Purpose::Video => self.export_video(path),
            Purpose::Table => self.export_table(path),
            Purpose::Plots => self.export_plots(path),
            Purpose::Rerun => self.run_into(path),
            Purpose::Boards => self.calibrate_board(path),
        }
    }

    /// Returns the reason why a path cannot be written to.
    fn refuse(&self, purpose: Purpose, path: &Path) -> Option<String> {
        let is_open = || {
            let file = files(purpose, path).find(|file| self.is_open(file))?;
            Some(format!("This window has opened {}; choose another name.", file.display()))
        };
        purpose.refuse(path).or_else(is_open)
    }

    /// Returns true if a file is a part of the sequence that is open.
    fn is_open(&self, path: &Path) -> bool {
        let Ok(path) = path.canonicalize() else { return false };
        let is_same = |file: &Path| file.canonicalize().is_ok_and(|file| file == path);
        let sequence = &self.sequence;
        let mut pictures = sequence.entries.iter().filter_map(|entry| match &entry.place {
            Place::File(file) | Place::RawFile(file, _) => Some(file),
            _ => None,
        });
        let tables = ["frames.csv", "truth.csv"].map(|name| sequence.folder.join(name));
        let named = [&sequence.recording, &self.request.frames, &self.request.truth].into_iter().flatten();
        let mut files = named.chain(&sequence.inputs).chain(&tables);
        files.any(|file| is_same(file)) || pictures.any(|file| is_same(file))
    }

    /// Returns what another program did to the session's own file, if `path` is this file.
    fn change_of_own_file(&self, purpose: Purpose, path: &Path) -> Option<FileChange> {
        let session = self.session.as_ref().filter(|_| purpose == Purpose::SaveSensor)?;
        let is_own = session.path()?.canonicalize().ok()? == path.canonicalize().ok()?;
        session.file_change().filter(|_| is_own)
    }
}

/// Returns the files that are written for a path: the file of this name, and for results the unfinished file. A run
/// that did not end may have left such a file, and its rows and pictures can be recovered.
fn files(purpose: Purpose, path: &Path) -> impl Iterator<Item = PathBuf> {
    let part = matches!(purpose, Purpose::Table | Purpose::Rerun).then(|| hzn_mcap::part_path(path));
    [Some(path.to_owned()), part].into_iter().flatten()
}

/// Returns the first file that would be lost.
pub(in crate::ui) fn replaced(purpose: Purpose, path: &Path) -> Option<PathBuf> {
    files(purpose, path).find(|file| file.symlink_metadata().is_ok())
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use crossbeam_channel::bounded;

    use super::*;
    use crate::model::{Session, Settings};

    fn viewer() -> Viewer {
        Viewer::new(Settings::default(), None, Arc::new(|| {}))
    }

    /// Returns a viewer in which the system's dialog has given this answer.
    fn browsed(purpose: Purpose, answer: Option<PathBuf>) -> Viewer {
        let mut viewer = viewer();
        let (send, receive) = bounded(1);
        viewer.path_dialog =
            Some(PathDialog { browsing: Some(receive), ..PathDialog::new(purpose, Path::new("/typed")) });
        viewer.poll_path_dialog();
        assert!(viewer.path_dialog.as_ref().is_some_and(|a| a.browsing.is_some()), "the user takes time");
        send.send(answer).unwrap();
        viewer.poll_path_dialog();
        viewer
    }

    #[test]
    fn the_dialog_of_the_system_needs_no_second_one() {
        let native = |age_ms: u64, answer: Option<&str>| {
            let mut dialog = PathDialog::new(Purpose::Table, Path::new("/typed"));
            let (send, receive) = bounded(1);
            dialog.browsing = Some(receive);
            dialog.native = std::time::Instant::now().checked_sub(std::time::Duration::from_millis(age_ms));
            assert!(dialog.is_hidden());
            send.send(answer.map(PathBuf::from)).unwrap();
            (dialog.take_answer(), dialog.is_hidden())
        };
        assert_eq!(native(5000, Some("/picked.csv")), (Answer::Accepted, false));
        assert_eq!(native(5000, None), (Answer::Cancelled, false));
        assert_eq!(native(0, None), (Answer::Open, false), "the system has no dialog, so the path is typed");
    }

    #[test]
    fn what_is_picked_is_opened_and_a_name_to_write_is_looked_at_first() {
        let dir = tempfile::tempdir().unwrap();
        let picked = dir.path().join("flight.mcap");
        std::fs::write(&picked, "").unwrap();
        let opened = browsed(Purpose::Open, Some(picked.clone()));
        assert!(opened.path_dialog.is_none() && opened.settings.recent == [picked.clone()]);
        let absent = browsed(Purpose::Open, Some(dir.path().join("absent")));
        assert!(absent.path_dialog.is_none() && absent.settings.recent.is_empty());
        let named = browsed(Purpose::Table, Some(picked.clone()));
        let text = picked.display().to_string();
        assert!(named.path_dialog.is_some_and(|a| a.text == text && a.browsing.is_none()));
        let left = browsed(Purpose::Open, None);
        assert!(left.path_dialog.is_some_and(|a| a.text == "/typed") && left.settings.recent.is_empty());
    }

    #[test]
    fn the_system_dialog_has_no_way_around_the_checks() {
        let dir = tempfile::tempdir().unwrap();
        let (recording, sensor) = (dir.path().join("flight.mcap"), dir.path().join("sensor.toml"));
        std::fs::write(&recording, b"8 MB").unwrap();
        std::fs::write(&sensor, "# another").unwrap();
        let accepted = |path: &Path| {
            let mut viewer = viewer();
            viewer.session = Some(Session::new("preset = \"hzn\"\n", &dir.path().join("own.toml"), None));
            let (send, receive) = bounded(1);
            let mut dialog = PathDialog::new(Purpose::SaveSensor, path);
            (dialog.browsing, dialog.native) = (Some(receive), Some(std::time::Instant::now()));
            viewer.path_dialog = Some(dialog);
            send.send(Some(path.to_owned())).unwrap();
            viewer.poll_path_dialog();
            viewer
        };
        let refused = accepted(&recording).path_dialog.unwrap();
        assert!(refused.refused.unwrap().contains("must end in .toml"));
        let mut asking = accepted(&sensor);
        assert!(asking.path_dialog.as_ref().is_some_and(|dialog| dialog.replaces));
        assert_eq!(std::fs::read(&sensor).unwrap(), b"# another");
        asking.replace_file();
        assert_eq!(std::fs::read(&sensor).unwrap(), b"preset = \"hzn\"\n");
        assert_eq!(std::fs::read(&recording).unwrap(), b"8 MB");
    }

    #[test]
    fn an_unfinished_recording_is_a_file_that_can_be_lost() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("again.mcap");
        assert_eq!(replaced(Purpose::Rerun, &path), None);
        let part = dir.path().join("again.mcap.part");
        std::fs::write(&part, b"finished pictures").unwrap();
        assert_eq!(replaced(Purpose::Rerun, &path), Some(part));
        std::fs::write(&path, b"complete").unwrap();
        assert_eq!(replaced(Purpose::Rerun, &path), Some(path.clone()));
    }
}
