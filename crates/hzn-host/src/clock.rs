//! The clock that measures the times of processing.

use std::cell::{Cell, RefCell};
use std::time::{Duration, Instant};

use hzn_core::Observer;

/// Returns the time. There is none in a browser, where the clock of the standard library panics; the times are then
/// zero.
pub fn now() -> Option<Instant> {
    (!cfg!(all(target_family = "wasm", target_os = "unknown"))).then(Instant::now)
}

/// An observer that measures only the time spent on each body.
#[derive(Debug, Clone, Default)]
pub struct Clock {
    since: Cell<Option<Instant>>,
    times: RefCell<Vec<Duration>>,
}

impl Clock {
    /// Returns the time spent on each body, in the order in which they were looked for.
    pub fn times(&self) -> Vec<Duration> {
        self.times.borrow().clone()
    }
}

impl<T> Observer<T> for Clock {
    fn body(&self, _: u8) {
        self.since.set(now());
    }
    fn leave(&self) {
        self.times.borrow_mut().push(self.since.get().map_or(Duration::ZERO, |since| since.elapsed()));
    }
}
