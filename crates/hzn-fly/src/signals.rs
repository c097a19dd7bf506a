//! The lines of the vehicle and the wish to stop, as signals.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use nix::sys::signal::{SigSet, Signal};

/// What the signals have said. Nothing is ever taken back.
#[derive(Debug, Default)]
pub(crate) struct Lines {
    stop: AtomicBool,
    power_fails: AtomicBool,
    lift_off: AtomicBool,
}

impl Lines {
    /// Returns whether the program should end: SIGTERM, SIGINT or SIGHUP.
    pub(crate) fn stop(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
    /// Returns whether power will be cut: SIGPWR.
    pub(crate) fn power_fails(&self) -> bool {
        self.power_fails.load(Ordering::Relaxed)
    }
    /// Returns whether the vehicle has lifted off: SIGUSR1.
    pub(crate) fn lift_off(&self) -> bool {
        self.lift_off.load(Ordering::Relaxed)
    }

    /// Listens to the signals from now on. Call it before other threads are started, because they inherit it.
    ///
    /// # Errors
    /// The system refuses.
    pub(crate) fn listen() -> io::Result<Arc<Self>> {
        let lines = Arc::new(Self::default());
        let signals =
            [Signal::SIGTERM, Signal::SIGINT, Signal::SIGHUP, Signal::SIGPWR, Signal::SIGUSR1].into_iter().collect();
        SigSet::thread_block(&signals)?;
        let of_thread = Arc::clone(&lines);
        thread::Builder::new().name("signals".into()).spawn(move || {
            while let Ok(signal) = signals.wait() {
                let line = match signal {
                    Signal::SIGPWR => &of_thread.power_fails,
                    Signal::SIGUSR1 => &of_thread.lift_off,
                    _ => &of_thread.stop,
                };
                line.store(true, Ordering::Relaxed);
            }
        })?;
        Ok(lines)
    }
}
