//! The rig whose heads are shown.

use std::path::Path;
use std::sync::Arc;

use super::Viewer;
use crate::model::Sequence;
use crate::ui::Command;
use crate::ui::rig_view::RigView;
use crate::work::rig::{Epoch, RigRun};

impl Viewer {
    /// Opens a rig.toml. Returns false if the file is another one. Pictures that are open are closed; their sensor.toml
    /// has its own question.
    pub(super) fn open_if_rig(&mut self, path: &Path) -> bool {
        if !(path.extension().is_some_and(|e| e == "toml") && hzn_files::rig::is_rig(path)) {
            return false;
        }
        (self.sequence, self.session, self.frame_view) = (Sequence::default(), None, None);
        (self.wizard, self.study, self.mask, self.circle) = (None, None, None, None);
        (self.live, self.opening) = (None, None);
        self.settings.add_recent(path);
        let run = RigRun::start(path.to_owned(), self.flight, Arc::clone(&self.wake));
        self.rig = Some(RigView::new(run, path.to_owned()));
        true
    }

    /// Goes to another epoch of the rig. Returns false if the command is another one, or no rig is open.
    pub(super) fn go_epoch(&mut self, command: Command) -> bool {
        let Some(view) = &mut self.rig else { return false };
        let now = view.epoch;
        view.go(match command {
            Command::Next => now + 1,
            Command::Back => now.saturating_sub(1),
            Command::Next10 => now + 10,
            Command::Back10 => now.saturating_sub(10),
            Command::First => 0,
            Command::Last => usize::MAX,
            _ => return false,
        });
        true
    }

    /// Returns the epochs of the rig that are processed, and the number of the shown one.
    pub fn epochs(&self) -> Option<(&[Epoch], usize)> {
        self.rig.as_ref().map(|view| (view.epochs.as_slice(), view.epoch))
    }

    /// Returns true if all epochs are processed and the pictures of the shown one are on the screen.
    pub(super) fn rig_is_settled(&self) -> Option<bool> {
        self.rig.as_ref().map(|view| view.is_complete && (view.shown == Some(view.epoch) || view.epochs.is_empty()))
    }
}
