//! The actions of keys, menus and buttons.

use std::path::Path;

use hzn_core::Preset;

use super::{Leave, Viewer};
use crate::model::{Look, Session, autosave};
use crate::ui::Command;
use crate::ui::panels::Panel;
use crate::ui::path_dialog::{PathDialog, Purpose};
use crate::work::open::Request;

impl Viewer {
    /// Executes a command.
    pub fn run(&mut self, command: Command, ctx: &egui::Context) {
        if self.go_epoch(command) {
            return;
        }
        let count = self.sequence.len();
        match command {
            Command::Open => self.ask(PathDialog::new(Purpose::Open, &self.sequence.folder)),
            Command::OpenFolder => self.ask_folder(),
            Command::OpenPath => self.path_dialog = Some(PathDialog::new(Purpose::Open, &self.sequence.folder)),
            Command::Reload => self.reload_pictures(),
            Command::Follow => self.toggle_follow(),
            Command::Save => self.save(),
            Command::SaveAs => {
                if let Some(session) = &self.session {
                    self.ask(PathDialog::new(Purpose::SaveSensor, &autosave::absolute(session.home())));
                }
            }
            Command::Undo => self.undo(),
            Command::Redo => self.redo(),
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
            Command::Compare => self.toggle_compare(),
            Command::ProcessAll => self.process_again(),
            Command::Rerun => {
                if self.session.is_some() && count > 0 {
                    let name = format!("{}-again.mcap", self.sequence.stem());
                    self.ask(PathDialog::new(Purpose::Rerun, &self.sequence.default_output_path(&name)));
                }
            }
            Command::ExportPicture => self.ask_export(),
            Command::Stages => self.panels.toggle(Panel::Stages, &mut self.settings),
            Command::Answer => self.panels.toggle(Panel::Answer, &mut self.settings),
            Command::Plots => self.panels.toggle(Panel::Plots, &mut self.settings),
            Command::Space => self.panels.toggle_space(),
            Command::Theme => self.settings.dark = !self.settings.dark,
            Command::Palette => self.toggle_palette(),
            Command::Help => self.showing_help = !self.showing_help,
        }
    }

    /// Compares with the default settings, or ends the comparison.
    fn toggle_compare(&mut self) {
        if self.other.take().is_none() {
            self.compare_with_preset(Preset::default());
        }
    }

    fn ask_export(&mut self) {
        let name = hzn_run::overlay::file_name(self.frame_view.as_ref().map_or("picture", |s| &s.name));
        let name = format!("overlay-{name}");
        self.ask(PathDialog::new(Purpose::Picture, &self.sequence.default_output_path(&name)));
    }

    /// Opens the same files again, at the same picture.
    fn reload_pictures(&mut self) {
        if !self.sequence.title.is_empty() {
            let request = Request { frame: self.playback.frame(), ..self.request.clone() };
            self.leave(Leave::Sequence(Box::new(request)), None);
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

    fn go_refused(&mut self, back: bool) {
        match self.rows.next_refused(self.playback.frame(), back, self.body, self.group.as_ref()) {
            Some(frame) => self.playback.go(frame, self.sequence.len()),
            None => self.add_note("All processed pictures have an answer."),
        }
    }

    /// Goes to the worst answer: by its error over its sigma if the truth is known, otherwise by sigma.
    fn go_worst(&mut self) {
        let known = !self.truth.is_empty();
        let badness = |row: &hzn_mcap::Row| {
            if known {
                crate::model::quantity::error_sigmas(row, self.truth_of(&row.file, &row.body))
            } else {
                row.sigma_max_deg
            }
        };
        let worst = self.rows.worst(self.body, badness);
        if worst.is_empty() {
            return self.add_note("No picture has an answer yet.");
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
            self.other = Some((format!("preset {}", preset.name()), session.under_preset(preset)));
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
                self.other = Some((name, session.opened_by_user()));
            }
            Err(problem) => self.add_problem(problem.to_string()),
        }
    }
}
