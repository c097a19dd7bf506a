//! The line to a flight computer.

use std::sync::Arc;

use super::Viewer;
use crate::model::Live;
use crate::model::Sequence;
use crate::ui::live_view::LiveView;
use crate::work::{Computer, Line};

impl Viewer {
    /// Opens the line to a flight computer. Pictures that are open are closed; their sensor.toml has its own question.
    pub(super) fn open_line(&mut self, address: &str, computer: &Computer) {
        match Line::open(address, computer, Arc::clone(&self.wake)) {
            Ok(line) => {
                (self.sequence, self.session, self.frame_view) = (Sequence::default(), None, None);
                (self.wizard, self.study, self.mask, self.circle) = (None, None, None, None);
                self.rig = None;
                self.live = Some(LiveView::new(line));
            }
            Err(why) => self.add_problem(why),
        }
    }

    /// Returns what is known of the flight computer whose telemetry is shown.
    pub fn live<T>(&self, of: impl FnOnce(&Live) -> T) -> Option<T> {
        Some(of(&self.live.as_ref()?.line.live()))
    }
}
