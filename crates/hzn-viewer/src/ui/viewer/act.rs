//! The actions of keys, menus and buttons.

use std::path::{Path, PathBuf};

use hzn_core::Preset;

use super::Viewer;
use crate::model::{CircleEdit, Look, MaskEdit, Session};
use crate::ui::Command;
use crate::ui::panels::Panel;
use crate::ui::path_dialog::{Answer, PathDialog, Purpose};

impl Viewer {
    /// Executes a command.
    pub fn run(&mut self, command: Command, ctx: &egui::Context) {
        let count = self.sequence.len();
        match command {
            Command::Open => self.ask(PathDialog::new(Purpose::Open, &self.sequence.folder)),
            Command::OpenFolder => self.ask_folder(),
            Command::OpenPath => self.path_dialog = Some(PathDialog::new(Purpose::Open, &self.sequence.folder)),
            Command::Save => self.save(),
            Command::SaveAs => {
                if let Some(session) = &self.session {
                    self.ask(PathDialog::new(Purpose::SaveSensor, session.home()));
                }
            }
            Command::Undo => self.session.iter_mut().for_each(Session::undo),
            Command::Redo => self.session.iter_mut().for_each(Session::redo),
            Command::Reset => self.session.iter_mut().for_each(Session::reset),
            Command::Diff => self.showing_diff = !self.showing_diff,
            Command::Play => self.toggle_playing(),
            Command::Next => self.playback.step(1, count),
            Command::Back => self.playback.step(-1, count),
            Command::Next10 => self.playback.step(10, count),
            Command::Back10 => self.playback.step(-10, count),
            Command::First => self.playback.go(0, count),
            Command::Last => self.playback.go(usize::MAX, count),
            Command::NextRefused | Command::BackRefused => self.go_refused(command == Command::BackRefused),
            Command::Worst => self.go_worst(),
            Command::Faster => self.playback.change_speed(true),
            Command::Slower => self.playback.change_speed(false),
            Command::Fit | Command::Actual | Command::ZoomIn | Command::ZoomOut => self.zoom(command, ctx),
            Command::Colour => self.settings.look = Look::Colour,
            Command::Grey => self.settings.look = Look::Grey,
            Command::Level => self.settings.look = Look::Level,
            Command::FalseColour => self.settings.look = Look::FalseColour,
            Command::Undistorted => self.settings.undistorted = !self.settings.undistorted,
            Command::Mask => self.toggle_mask(),
            Command::Circle => self.toggle_circle(),
            Command::Layers => self.layers_hidden = !self.layers_hidden,
            Command::Compare => match self.other.take() {
                Some(_) => {}
                None => self.compare_with_preset(Preset::default()),
            },
            Command::ProcessAll => self.process_again(),
            Command::Rerun => {
                if self.session.is_some() && count > 0 {
                    let name = format!("{}-again.mcap", self.sequence.stem());
                    self.ask(PathDialog::new(Purpose::Rerun, &self.sequence.default_output_path(&name)));
                }
            }
            Command::ExportPicture => {
                let name = hzn_run::overlay::file_name(self.frame_view.as_ref().map_or("picture", |s| &s.name));
                let name = format!("overlay-{name}");
                self.ask(PathDialog::new(Purpose::Picture, &self.sequence.default_output_path(&name)));
            }
            Command::Stages => self.panels.toggle(Panel::Stages, &mut self.settings),
            Command::Answer => self.panels.toggle(Panel::Answer, &mut self.settings),
            Command::Plots => self.panels.toggle(Panel::Plots, &mut self.settings),
            Command::Theme => self.settings.dark = !self.settings.dark,
            Command::Help => self.showing_help = !self.showing_help,
        }
    }

    /// Starts or stops playing.
    fn toggle_playing(&mut self) {
        // The first picture is shown for its full time.
        self.last = std::time::Instant::now();
        self.playback.toggle(self.sequence.len());
    }

    /// Asks for a folder and opens it.
    fn ask_folder(&mut self) {
        let mut dialog = PathDialog::new(Purpose::Open, &self.sequence.folder);
        if self.native_dialogs {
            dialog.browse_only(true);
        }
        self.path_dialog = Some(dialog);
    }

    fn save(&mut self) {
        let Some(session) = &self.session else { return };
        let Some(path) = session.path().map(Path::to_owned) else {
            // The text comes from a recording, so the user has to confirm the path.
            self.ask(PathDialog::new(Purpose::SaveSensor, session.home()));
            return;
        };
        self.save_to(&path);
    }

    /// Saves the sensor.toml to `path`, which becomes the file of the session.
    pub(in crate::ui) fn save_to(&mut self, path: &Path) {
        match self.session.as_mut().map(|s| s.save(path)) {
            Some(Ok(())) => {
                self.add_note(format!("Saved: {}", path.display()));
                self.continue_after_save();
            }
            Some(Err(why)) => self.add_problem(why),
            None => {}
        }
    }

    fn go_refused(&mut self, back: bool) {
        match self.rows.next_refused(self.playback.frame(), back, self.body, self.group.as_ref()) {
            Some(frame) => self.playback.go(frame, self.sequence.len()),
            None => self.add_note("All processed pictures have an answer."),
        }
    }

    /// Goes to the worst picture: by error if the truth is known, otherwise by sigma.
    fn go_worst(&mut self) {
        let known = !self.truth.is_empty();
        let badness = |row: &hzn_mcap::Row| {
            if known {
                crate::model::quantity::error_deg(row, self.truth_of(&row.file, &row.body))
            } else {
                row.sigma_max_deg
            }
        };
        let worst = self.rows.worst(self.body, badness);
        if worst.is_empty() {
            return;
        }
        // If the shown picture is the worst one of the last call, the next worst follows.
        let position = worst.iter().position(|&i| i == self.playback.frame());
        self.worst = if position == Some(self.worst) { (self.worst + 1) % worst.len() } else { 0 };
        if let Some(&frame) = worst.get(self.worst) {
            self.playback.go(frame, self.sequence.len());
        }
    }

    pub(in crate::ui) fn compare_with_preset(&mut self, preset: Preset) {
        if let Some(session) = &self.session {
            self.other = Some((preset.name().to_owned(), session.under_preset(preset)));
        }
    }

    pub(in crate::ui) fn compare_with_file(&mut self, path: &Path) {
        match Session::open(path) {
            Ok(session) => {
                if let Some(problem) = session.problem() {
                    self.add_problem(problem.to_string());
                    return;
                }
                let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
                self.other = Some((name, session));
            }
            Err(problem) => self.add_problem(problem.to_string()),
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

    /// Does what the path of the dialog is for, and closes the dialog.
    pub(in crate::ui) fn accept_path(&mut self) {
        let Some(path_dialog) = self.path_dialog.take() else { return };
        let path = PathBuf::from(path_dialog.text.trim());
        if path.as_os_str().is_empty() {
            return;
        }
        match path_dialog.purpose {
            Purpose::Open => self.open_paths(vec![path]),
            Purpose::SaveSensor => self.save_to(&path),
            Purpose::Compare => self.compare_with_file(&path),
            Purpose::Picture => self.export_picture(path),
            Purpose::Video => self.export_video(path),
            Purpose::Table => self.export_table(path),
            Purpose::Plots => self.export_plots(path),
            Purpose::Rerun => self.run_into(path),
        }
    }

    /// Starts or ends the drawing of the mask.
    pub(in crate::ui) fn toggle_mask(&mut self) {
        self.mask = match self.mask.take() {
            Some(_) => None,
            None if self.session.is_some() => Some(MaskEdit::default()),
            None => None,
        };
        self.circle = None;
    }

    /// Starts or ends the dragging of the image circle, which is a circle only in the camera's own picture.
    pub(in crate::ui) fn toggle_circle(&mut self) {
        let starts = self.circle.is_none() && self.session.as_ref().is_some_and(|s| s.config().is_some());
        self.circle = starts.then(CircleEdit::default);
        self.mask = None;
        self.settings.undistorted &= !starts;
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use crossbeam_channel::bounded;

    use super::*;
    use crate::model::Settings;

    /// Returns a viewer in which the system's dialog has given this answer.
    fn browsed(purpose: Purpose, answer: Option<PathBuf>) -> Viewer {
        let mut viewer = Viewer::new(Settings::default(), None, Arc::new(|| {}));
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
        let picked = PathBuf::from("/picked/flight.mcap");
        let opened = browsed(Purpose::Open, Some(picked.clone()));
        assert!(opened.path_dialog.is_none() && opened.settings.recent == [picked.clone()]);
        let named = browsed(Purpose::Table, Some(picked.clone()));
        assert!(named.path_dialog.is_some_and(|a| a.text == "/picked/flight.mcap" && a.browsing.is_none()));
        let left = browsed(Purpose::Open, None);
        assert!(left.path_dialog.is_some_and(|a| a.text == "/typed") && left.settings.recent.is_empty());
    }
}
