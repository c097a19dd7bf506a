//! Changes that are not saved: the question before they go, and the autosaved session.

use std::time::{Duration, Instant};

use super::Viewer;
use super::changes::Leave;
use crate::model::{Fingerprint, Session, Unsaved, autosave};
use crate::work::open::Request;

/// Time between two writes of the autosaved session, so that a slider that moves does not write a file with every step.
/// The first change is written at once.
const AUTOSAVE_EVERY: Duration = Duration::from_millis(250);

impl Viewer {
    pub(super) fn has_changes(&self) -> bool {
        self.session.as_ref().is_some_and(Session::is_changed)
    }

    /// Does what the user wants, or asks first if changes would be lost.
    pub(in crate::ui) fn leave(&mut self, leave: Leave, ctx: Option<&egui::Context>) {
        if self.has_changes() {
            self.changes.question = Some(leave);
        } else {
            self.go_on(leave, ctx);
        }
    }

    /// Does what waited for the changes.
    fn go_on(&mut self, leave: Leave, ctx: Option<&egui::Context>) {
        match leave {
            Leave::Window => {
                self.changes.may_close = true;
                if let Some(ctx) = ctx {
                    ctx.send_viewport_cmd(egui::ViewportCommand::Close);
                }
            }
            Leave::Sequence(request) => self.open(*request),
            Leave::Sensor(session) => self.set_session(*session),
            Leave::NewSensor => {
                (self.session, self.changes.is_sensor_kept) = (None, false);
                self.open_wizard();
            }
        }
    }

    /// Lets the window close without a question.
    pub fn allow_close(&mut self) {
        self.changes.may_close = true;
    }

    /// Asks before the window closes, if changes would be lost.
    pub(in crate::ui) fn watch_close(&mut self, ctx: &egui::Context) {
        if ctx.input(|i| i.viewport().close_requested()) && self.has_changes() && !self.changes.may_close {
            ctx.send_viewport_cmd(egui::ViewportCommand::CancelClose);
            self.changes.question = Some(Leave::Window);
        }
    }

    /// Closes the window after its sensor.toml was saved.
    pub(in crate::ui) fn close_if_due(&mut self, ctx: &egui::Context) {
        if std::mem::take(&mut self.close_now) {
            ctx.send_viewport_cmd(egui::ViewportCommand::Close);
        }
    }

    /// Takes the answer "Save" to the question.
    pub(in crate::ui) fn save_and_leave(&mut self, ctx: &egui::Context) {
        let Some(leave) = self.changes.question.take() else { return };
        if self.session.is_none() {
            return self.go_on(leave, Some(ctx));
        }
        self.changes.after_save = Some(leave);
        self.save();
    }

    /// Takes the answer "Discard changes" to the question.
    pub(in crate::ui) fn discard_and_leave(&mut self, ctx: &egui::Context) {
        let Some(leave) = self.changes.question.take() else { return };
        self.session.iter_mut().for_each(Session::reset);
        self.go_on(leave, Some(ctx));
    }

    /// Goes on with what waited for a saved file.
    pub(super) fn continue_after_save(&mut self) {
        if let Some(leave) = self.changes.after_save.take() {
            // The window closes by itself at its next frame, because it may close now.
            let closes = matches!(leave, Leave::Window);
            self.go_on(leave, None);
            self.close_now |= closes;
        }
    }

    /// Brings the changes of a window that crashed back, together with its sequence.
    pub(in crate::ui) fn restore_lost(&mut self) {
        let Some((unsaved, path)) = self.changes.lost.take() else { return };
        let inputs = unsaved.inputs.clone();
        let session = unsaved.into_session();
        let here = self.request.inputs.iter().map(|path| autosave::absolute(path));
        if !inputs.is_empty() && !here.eq(inputs.iter().cloned()) {
            // The changes belong to another sequence than the one that is open.
            self.open(Request { inputs, fps: self.request.fps, ..Request::default() });
            self.restoring = Some((session, path));
        } else if self.opening.is_some() && self.sequence.inputs != self.request.inputs {
            self.restoring = Some((session, path));
        } else {
            let _ = std::fs::remove_file(path);
            self.set_session(session);
        }
    }

    /// Keeps the changes of a window that crashed for the next window.
    pub(in crate::ui) fn keep_lost(&mut self) {
        self.changes.lost = None;
    }

    /// Removes the changes of a window that crashed.
    pub(in crate::ui) fn forget_lost(&mut self) {
        if let Some((_, path)) = self.changes.lost.take() {
            let _ = std::fs::remove_file(path);
        }
    }

    /// Writes changes to the autosave file: the first one at once, and further ones a moment after the last write.
    pub(in crate::ui) fn autosave(&mut self, ctx: &egui::Context) {
        let Some(autosave) = self.changes.autosave.clone() else { return };
        let Some(session) = self.session.as_ref().filter(|s| s.is_changed()) else {
            if self.changes.autosaved.take().is_some() {
                autosave.remove();
            }
            return;
        };
        // A text with an error has no version of its own, and is worth keeping, too.
        let state = (session.version(), Fingerprint::of(session.sheet().text()));
        let since = match &self.changes.autosaved {
            Some((saved, _)) if *saved == state => return,
            Some((_, at)) => at.elapsed(),
            None => AUTOSAVE_EVERY,
        };
        let left = AUTOSAVE_EVERY.saturating_sub(since);
        if !left.is_zero() {
            return ctx.request_repaint_after(left);
        }
        let unsaved = Unsaved::of_session(session, &self.sequence.inputs);
        self.changes.autosaved = Some((state, Instant::now()));
        if let Err(why) = autosave.write(&unsaved) {
            self.add_problem(format!("The changes are not autosaved: {why}"));
        }
    }
}
