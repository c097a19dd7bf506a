//! The time of the log: UTC, from the telecommand `time`, or else from the clock of the system.

use hzn_nav::time::unix_from_tai_s;

/// Seconds from 1958-01-01, where the time of packets begins, to 1970-01-01.
const UNIX_EPOCH_S: f64 = 4383.0 * 86_400.0;
/// A larger change of the system's clock is a step. A service that keeps a clock turns it by at most 0.5 ms a second.
const STEP_S: f64 = 0.1;

/// UTC as a function of the board's clock, which never jumps.
#[derive(Debug)]
pub(crate) struct LogClock {
    /// UTC minus the board's clock, s.
    offset_s: f64,
    /// Whether the telecommand `time` has set it.
    is_correlated: bool,
}

impl LogClock {
    /// Makes the clock; the clock of the system is at `system_s`, in seconds since 1970, when that of the board is at
    /// `board_us`.
    pub(crate) fn new(system_s: f64, board_us: u64) -> Self {
        Self { offset_s: system_s - board_us as f64 * 1e-6, is_correlated: false }
    }

    /// Follows the clock of the system, which a computer without a battery sets only after a while. Returns the change
    /// in seconds if it is a step.
    pub(crate) fn follow_system(&mut self, system_s: f64, board_us: u64) -> Option<f64> {
        // The ground's time is that of the packets, so that log and telemetry agree.
        (!self.is_correlated).then(|| self.set(system_s - board_us as f64 * 1e-6))?
    }

    /// Follows the telecommand `time`: it is `tai_us`, in microseconds of TAI since 1958, at `board_us`. Returns the
    /// change in seconds if it is a step.
    pub(crate) fn correlate(&mut self, tai_us: u64, board_us: u64) -> Option<f64> {
        self.is_correlated = true;
        self.set(unix_from_tai_s(tai_us as f64 * 1e-6 - UNIX_EPOCH_S) - board_us as f64 * 1e-6)
    }

    fn set(&mut self, offset_s: f64) -> Option<f64> {
        let change_s = offset_s - std::mem::replace(&mut self.offset_s, offset_s);
        (change_s.abs() > STEP_S).then_some(change_s)
    }

    /// Returns UTC in seconds since 1970.
    pub(crate) fn utc_s(&self, board_us: u64) -> f64 {
        self.offset_s + board_us as f64 * 1e-6
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_log_follows_steps_of_the_system_and_then_the_ground() {
        // The computer starts in 1970, because its clock has no battery.
        let mut clock = LogClock::new(3.0, 1_000_000);
        assert_eq!(clock.utc_s(2_000_000), 4.0);
        assert_eq!(clock.follow_system(4.0001, 2_000_000), None);
        assert!((clock.utc_s(2_000_000) - 4.0001).abs() < 1e-9);
        // A service sets it.
        let now_s = 1_795_000_000.0;
        assert!(clock.follow_system(now_s, 3_000_000).is_some_and(|step| (step - now_s).abs() < 10.0));
        assert_eq!(clock.utc_s(3_500_000), now_s + 0.5);
        // The ground knows better: TAI is 37 s ahead of UTC.
        let tai_us = (now_s + 2.0 + 37.0 + UNIX_EPOCH_S) as u64 * 1_000_000;
        let step = clock.correlate(tai_us, 4_000_000).unwrap();
        assert!((step - 1.0).abs() < 1e-6, "{step}");
        assert_eq!(clock.utc_s(4_000_000), now_s + 2.0);
        assert_eq!(clock.follow_system(now_s + 90.0, 5_000_000), None);
        assert_eq!(clock.utc_s(5_000_000), now_s + 3.0);
    }
}
