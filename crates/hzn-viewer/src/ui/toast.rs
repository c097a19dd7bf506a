//! A message that lies over the window and goes away by itself.

use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Time that a note is shown. A problem stays until it is closed.
const SHOWN_FOR: Duration = Duration::from_secs(8);
/// Largest number of messages on the screen; the oldest note gives way.
const MOST: usize = 6;

/// A message for the user.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Toast {
    pub(super) text: String,
    pub(super) bad: bool,
    /// A recording that can be recovered.
    pub(super) recover: Option<PathBuf>,
    since: Instant,
}

/// All messages on the screen, the newest last.
#[derive(Debug, Default)]
pub(super) struct Toasts {
    all: Vec<Toast>,
}

impl Toasts {
    /// Adds a message. A message with the same text starts its time again.
    pub(super) fn add(&mut self, text: String, bad: bool, recover: Option<PathBuf>) {
        self.all.retain(|t| t.text != text);
        self.all.push(Toast { text, bad, recover, since: Instant::now() });
        if self.all.len() > MOST {
            let oldest = self.all.iter().position(|t| !t.bad).unwrap_or(0);
            self.all.remove(oldest);
        }
    }
    /// Returns all messages, the newest last.
    pub(super) fn iter(&self) -> impl Iterator<Item = &Toast> {
        self.all.iter()
    }
    /// Returns the number of messages.
    pub(super) fn len(&self) -> usize {
        self.all.len()
    }
    /// Removes a message.
    pub(super) fn remove(&mut self, index: usize) {
        if index < self.all.len() {
            self.all.remove(index);
        }
    }
    /// Removes the first `count` messages.
    pub(super) fn remove_first(&mut self, count: usize) {
        self.all.drain(..count.min(self.all.len()));
    }
    /// Starts the time of a message again, because the pointer is on it.
    pub(super) fn keep(&mut self, index: usize) {
        if let Some(toast) = self.all.get_mut(index) {
            toast.since = Instant::now();
        }
    }
    /// Removes the notes whose time is over, and returns the time until the next one goes.
    pub(super) fn expire(&mut self, now: Instant) -> Option<Duration> {
        let left = |t: &Toast| SHOWN_FOR.saturating_sub(now.saturating_duration_since(t.since));
        self.all.retain(|t| t.bad || !left(t).is_zero());
        self.all.iter().filter(|t| !t.bad).map(left).min()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notes_go_and_problems_stay() {
        let mut toasts = Toasts::default();
        let now = Instant::now();
        toasts.add("written".into(), false, None);
        toasts.add("the disk is full".into(), true, None);
        assert!(toasts.expire(now + Duration::from_secs(1)).is_some_and(|d| d <= SHOWN_FOR));
        assert_eq!(toasts.expire(now + Duration::from_secs(60)), None);
        assert_eq!(toasts.iter().map(|t| t.text.as_str()).collect::<Vec<_>>(), ["the disk is full"]);
        for n in 0..20 {
            toasts.add(format!("note {n}"), false, None);
        }
        assert_eq!(toasts.len(), MOST);
        assert!(toasts.iter().any(|t| t.bad), "a problem does not give way to notes");
        toasts.add("note 18".into(), false, None);
        assert_eq!((toasts.len(), toasts.iter().last().unwrap().text.as_str()), (MOST, "note 18"));
    }
}
