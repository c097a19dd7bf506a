//! The mode after a reset, and its changes by the lines of the vehicle: lift-off, loss of power, end of the flight.

use super::Flight;
use super::recovery::{OLDER_AFTER, SAFE_AFTER};
use crate::board::Board;
use crate::messages::{Event, Mode};

impl<B: Board> Flight<'_, B> {
    /// Enters the mode for the time after the start. The self-checks have been done.
    pub(super) fn enter_first_mode(&mut self) {
        let resets = self.recovery.watchdog_resets;
        if resets >= OLDER_AFTER {
            self.send_event(Event::OlderParameters, self.state.parameter_copy.into(), resets.into());
        }
        // After lift-off nobody may be able to end safe mode: a sounding rocket often has no uplink.
        let may_be_safe = match self.operations.get().safe_after_resets {
            0 => false,
            1 => !self.recovery.has_lifted_off(),
            _ => true,
        };
        // Neither copy of the parameters ended the resets, so the computer processes nothing and listens.
        if resets >= SAFE_AFTER && may_be_safe {
            self.send_event(Event::SafeAfterResets, resets.into(), 0);
            self.enter_mode(Mode::Safe);
        } else if self.mode == Mode::Standby && (self.operations.get().boot_mode == 1 || self.recovery.has_lifted_off())
        {
            self.enter_mode(Mode::Flight);
        }
    }

    /// Follows the lines of the vehicle. Returns whether the computer has shut down.
    pub(super) fn follow_vehicle(&mut self, now_us: u64) -> bool {
        // The change counts and not the state, so that a commanded standby lasts. It is also noted outside standby,
        // because the time to the shut-down runs in every mode.
        let line_is_off = self.board.lift_off();
        if self.recovery.sees_lift_off(line_is_off, now_us) && self.mode == Mode::Standby {
            self.enter_mode(Mode::Flight);
        }
        self.recovery.keep_up(&mut self.board, now_us);
        let is_over = match (self.operations.get().shut_down_after_s, self.recovery.since_lift_off_s(now_us)) {
            (Some(limit_s), Some(since_s)) => f64::from(since_s) >= limit_s,
            _ => false,
        };
        if is_over || self.board.power_fails() {
            self.enter_mode(Mode::ShutDown);
        }
        self.mode == Mode::ShutDown
    }
}
