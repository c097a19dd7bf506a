//! Stores the settings a moment after each change, so that a window that crashes or is killed keeps them, too.

use std::time::{Duration, Instant};

use super::Viewer;

/// Time from the last change until the settings are stored, so that a border that is dragged does not write a file with
/// every step.
const STORE_AFTER: Duration = Duration::from_millis(700);

impl Viewer {
    /// Stores the settings if they have not changed for a moment.
    pub(in crate::ui) fn keep_settings(&mut self, ctx: &egui::Context) {
        let Some(path) = self.store.clone() else { return };
        // The settings of the start come from the file, or they are the defaults.
        let stored = self.kept.stored.get_or_insert_with(|| self.settings.clone());
        if *stored == self.settings {
            self.kept.seen = None;
            return;
        }
        let since = match &self.kept.seen {
            Some((seen, since)) if *seen == self.settings => *since,
            _ => {
                let now = Instant::now();
                self.kept.seen = Some((self.settings.clone(), now));
                now
            }
        };
        let left = STORE_AFTER.saturating_sub(since.elapsed());
        if !left.is_zero() {
            return ctx.request_repaint_after(left);
        }
        self.kept.stored = Some(self.settings.clone());
        if let Err(why) = self.settings.store(&path) {
            self.add_problem(format!("The settings of the window are not stored: {why}"));
        }
    }
}
