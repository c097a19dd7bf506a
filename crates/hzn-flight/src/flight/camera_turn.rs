//! The flight loop watches the camera.

use super::Flight;
use crate::board::Board;
use crate::messages::{Event, Mode};

impl<B: Board> Flight<'_, B> {
    /// Sends an event if the camera should have sent a picture by now. Only flight mode expects pictures.
    pub(super) fn watch_camera(&mut self, now_us: u64) {
        if self.mode == Mode::Flight
            && let Some(waited_us) = self.camera.becomes_silent(now_us)
        {
            let waited_ms = u32::try_from(waited_us / 1000).unwrap_or(u32::MAX);
            self.send_event(Event::CameraSilent, waited_ms, self.number);
        }
    }
}
