//! The actions of keys, menus and buttons.

use std::path::Path;

use hzn_core::Preset;

use super::Viewer;
use crate::model::{Look, Session};
use crate::ui::dialogs::{Asking, Purpose};
use crate::ui::{Command, picture};

impl Viewer {
    /// Executes a command.
    pub fn run(&mut self, command: Command, ctx: &egui::Context) {
        let count = self.sequence.len();
        match command {
            Command::Open => self.asking = Some(Asking::new(Purpose::Open, &self.sequence.folder)),
            Command::Save => self.save(),
            Command::SaveAs => {
                if let Some(session) = &self.session {
                    self.asking = Some(Asking::new(Purpose::SaveSensor, session.home()));
                }
            }
            Command::Undo => self.session.iter_mut().for_each(Session::undo),
            Command::Redo => self.session.iter_mut().for_each(Session::redo),
            Command::Reset => self.session.iter_mut().for_each(Session::reset),
            Command::Diff => self.showing_diff = !self.showing_diff,
            Command::Play => self.playback.toggle(count),
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
            Command::Fit | Command::Actual | Command::ZoomIn | Command::ZoomOut => picture::zoom(self, command, ctx),
            Command::Colour => self.settings.look = Look::Colour,
            Command::Grey => self.settings.look = Look::Grey,
            Command::Level => self.settings.look = Look::Level,
            Command::Undistorted => self.settings.undistorted = !self.settings.undistorted,
            Command::Mask => picture::toggle_mask(self),
            Command::Layers => self.layers_hidden = !self.layers_hidden,
            Command::Compare => match self.other.take() {
                Some(_) => {}
                None => self.compare_with_preset(Preset::default()),
            },
            Command::ProcessAll => self.process_all(None),
            Command::Rerun => {
                if self.session.is_some() && count > 0 {
                    let name = format!("{}-again.mcap", self.sequence.stem());
                    self.asking = Some(Asking::new(Purpose::Rerun, &self.sequence.beside(&name)));
                }
            }
            Command::ExportPicture => {
                let name = hzn_run::overlay::file_name(self.sight.as_ref().map_or("frame", |s| &s.name));
                let name = format!("overlay-{name}");
                self.asking = Some(Asking::new(Purpose::Picture, &self.sequence.beside(&name)));
            }
            Command::Stages => self.settings.stages = !self.settings.stages,
            Command::Plots => self.settings.plots = !self.settings.plots,
            Command::Theme => self.settings.dark = !self.settings.dark,
            Command::Help => self.showing_help = !self.showing_help,
        }
    }

    fn save(&mut self) {
        let Some(session) = &self.session else { return };
        let Some(path) = session.path().map(Path::to_owned) else {
            // The text comes from a recording, so the user has to confirm the path.
            self.asking = Some(Asking::new(Purpose::SaveSensor, session.home()));
            return;
        };
        self.save_to(&path);
    }

    /// Saves the sensor.toml to `path`, which becomes the file of the session.
    pub(in crate::ui) fn save_to(&mut self, path: &Path) {
        match self.session.as_mut().map(|s| s.save(path)) {
            Some(Ok(())) => self.say(format!("Saved: {}", path.display())),
            Some(Err(why)) => self.say_bad(why),
            None => {}
        }
    }

    fn go_refused(&mut self, back: bool) {
        match self.rows.next_refused(self.playback.frame(), back, self.body) {
            Some(frame) => self.playback.go(frame, self.sequence.len()),
            None => self.say("All processed frames have an answer."),
        }
    }

    /// Goes to the worst picture: by error if the truth is known, otherwise by sigma.
    fn go_worst(&mut self) {
        let known = !self.truth.is_empty();
        let badness = |row: &hzn_mcap::Row| {
            if known {
                crate::model::rows::error_deg(row, self.truth_of(&row.file, &row.body))
            } else {
                row.sigma_max_deg
            }
        };
        let worst = self.rows.worst(self.body, badness);
        if worst.is_empty() {
            return;
        }
        // If the shown picture is the worst one of the last call, the next worst follows.
        let at = worst.iter().position(|&i| i == self.playback.frame());
        self.worst = if at == Some(self.worst) { (self.worst + 1) % worst.len() } else { 0 };
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
                    self.say_bad(problem.to_string());
                    return;
                }
                let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
                self.other = Some((name, session));
            }
            Err(problem) => self.say_bad(problem.to_string()),
        }
    }
}
