//! Messages to the user. The program decides where they go.

use std::sync::Arc;
use std::time::{Duration, Instant};

/// A function that shows one line to the user, from any thread.
pub type Tell = Arc<dyn Fn(&str) + Send + Sync>;

/// Shortest time between two messages of [`Rarely`].
const PAUSE: Duration = Duration::from_secs(60);

/// Shows a message that could come with every packet, but not more than once a minute.
pub(crate) struct Rarely {
    tell: Tell,
    last: Option<Instant>,
}

impl Rarely {
    pub(crate) fn new(tell: Tell) -> Self {
        Self { tell, last: None }
    }
    pub(crate) fn line(&mut self, text: &str) {
        if self.last.is_none_or(|last| last.elapsed() >= PAUSE) {
            self.last = Some(Instant::now());
            (self.tell)(text);
        }
    }
}
