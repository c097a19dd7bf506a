//! Playing of the sequence.

use std::time::{Duration, Instant};

use super::Viewer;

/// Longest time that playing advances in one frame of the window, for example after the window stood still.
const LONGEST_PASS: Duration = Duration::from_millis(250);
/// Shortest wait between two frames of the window while the sequence is played.
const SHORTEST_WAIT: Duration = Duration::from_millis(4);

impl Viewer {
    /// Returns true while the sequence is played.
    pub fn is_playing(&self) -> bool {
        self.playback.is_playing()
    }
    /// Sets the speed of playing, as a multiple of the speed of the sequence.
    pub fn set_speed(&mut self, speed: f64) {
        self.playback.set_speed(speed);
    }
    /// Returns the speed of playing.
    pub fn speed(&self) -> f64 {
        self.playback.speed()
    }
    /// Goes to a picture.
    pub fn go(&mut self, frame: usize) {
        self.playback.go(frame, self.sequence.len());
    }

    /// Advances the time of playing. No picture is skipped because it is slow: each is drawn before the next one is
    /// requested. Returns true if the next picture is to be shown.
    pub(in crate::ui) fn advance(&mut self, ctx: &egui::Context) -> bool {
        let elapsed = std::mem::replace(&mut self.last, Instant::now()).elapsed();
        let duration_s = |frame| self.sequence.duration_s(frame);
        let mut is_next = false;
        if self.frame_view.as_ref().is_none_or(|s| s.index == self.playback.frame()) {
            // A window that stood still does not catch up; a window that waited for the next picture does.
            let longest = LONGEST_PASS + std::mem::take(&mut self.planned_wait);
            is_next = self.playback.advance(elapsed.min(longest), self.sequence.len(), duration_s);
        }
        if let Some(due) = self.playback.due(duration_s) {
            // The window draws nothing until the next picture is due.
            self.planned_wait = due.max(SHORTEST_WAIT);
            ctx.request_repaint_after(self.planned_wait);
        }
        is_next
    }
}
