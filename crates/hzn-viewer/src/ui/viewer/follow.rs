//! A sequence that grows while it is shown.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::{Leave, Viewer};
use crate::ui::follow::Follow;
use crate::work::background::{Background, Slot, Task};
use crate::work::open::{self, Request};

/// Shortest time between two starts of the work on the pictures that were not shown: the work gets a copy of the list.
const WORK_EVERY: Duration = Duration::from_secs(1);

impl Viewer {
    /// Begins to follow a sequence, or to show one that does not grow.
    pub(super) fn begin_following(&mut self) {
        let is_open = self.request.follow;
        self.follow = Follow { is_open, jumps: is_open, most: self.follow.most, ..Follow::default() };
    }

    /// Keeps at most this many pictures of a sequence that grows.
    pub fn keep_at_most(&mut self, pictures: usize) {
        self.follow.most = pictures.max(1);
    }

    /// Returns true while the newest picture is shown as soon as it is there.
    pub fn is_following(&self) -> bool {
        self.follow.is_open && self.follow.jumps
    }

    /// Returns what an empty window waits for: the first picture of a folder that it follows.
    pub(in crate::ui) fn awaited(&self) -> Option<String> {
        let folder = self.request.inputs.first().filter(|_| self.request.follow && self.opening.is_some())?;
        Some(format!("Waiting for the first picture in {}…", folder.display()))
    }

    /// Follows the sequence, or stops to.
    pub(in crate::ui) fn toggle_follow(&mut self) {
        if self.follow.is_open {
            self.follow.jumps = !self.follow.jumps;
            return self.show_newest();
        }
        if !self.sequence.title.is_empty() {
            let request = Request { follow: true, ..self.request.clone() };
            self.leave(Leave::Sequence(Box::new(request)), None);
        }
    }

    /// Stops to show the newest picture if the user went to another one.
    pub(super) fn notice_navigation(&mut self) {
        if self.follow.jumps && self.follow.shown.is_some_and(|shown| shown != self.playback.frame()) {
            self.follow.jumps = false;
        }
    }

    /// Takes note of pictures that were added: the oldest ones are forgotten, and the newest one is shown.
    pub(super) fn take_added(&mut self) {
        if !self.follow.is_open {
            return;
        }
        self.follow.newest = Some(Instant::now());
        self.forget(self.follow.surplus(self.sequence.len()));
        self.show_newest();
    }

    fn show_newest(&mut self) {
        if self.is_following() {
            self.playback.go(usize::MAX, self.sequence.len());
            self.follow.shown = Some(self.playback.frame());
        }
    }

    /// Forgets the oldest pictures. Work that knows them by their numbers begins again.
    fn forget(&mut self, count: usize) {
        if count == 0 {
            return;
        }
        self.sequence.entries.drain(..count.min(self.sequence.len()));
        self.rows.forget_first(count);
        self.engine.renumber();
        self.follow.forgotten += count;
        (self.work.running, self.requested, self.hovered_frame) = (None, None, None);
        let frame = self.playback.frame();
        // Whoever looks at a picture keeps it as long as it is there.
        self.playback.go(frame.saturating_sub(count), self.sequence.len());
        self.frame_view = self.frame_view.take().and_then(|mut view| {
            view.index = view.index.checked_sub(count)?;
            Some(view)
        });
    }

    /// Processes the pictures of a growing sequence that were not shown, or not with the current parameters.
    pub(super) fn work_on_added(&mut self, slots: Vec<Slot>) {
        let is_due = self.follow.worked.is_none_or(|at| at.elapsed() >= WORK_EVERY);
        if !is_due || self.work.running.is_some() || slots.is_empty() {
            return;
        }
        let missing = |i: &usize| self.rows.current(*i, self.body).is_none();
        let only: Vec<usize> = (0..self.sequence.len()).filter(missing).collect();
        if !only.is_empty() {
            self.follow.worked = Some(Instant::now());
            let (sequence, from) = (self.sequence.clone(), self.playback.frame());
            let task = Task { sequence, slots, from, flight: self.flight, only: Some(only) };
            self.work.running = Some(Background::start(task, Arc::clone(&self.wake)));
        }
    }

    /// Ends to follow a recording that is complete. It may have its final name now.
    pub(super) fn end_following(&mut self) {
        if !std::mem::take(&mut self.follow.is_open) {
            return;
        }
        self.work.due = Some(Instant::now());
        if let Some(recording) = self.sequence.recording.clone().filter(|path| !path.exists())
            && let Some(finished) = without_part(&recording).filter(|path| path.is_file())
        {
            if let Some(old) = self.request.inputs.first() {
                self.settings.rename_recent(old, &finished);
            }
            // The title is the name of the file, and this file has another name now.
            self.sequence.title = open::title(&finished);
            self.sequence.inputs = vec![finished.clone()];
            (self.request.inputs, self.sequence.recording) = (self.sequence.inputs.clone(), Some(finished));
        }
    }
}

/// Returns the final name of a recording.
fn without_part(path: &Path) -> Option<PathBuf> {
    path.to_str()?.strip_suffix(".part").map(PathBuf::from)
}
