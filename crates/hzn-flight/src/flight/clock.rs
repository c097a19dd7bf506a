//! The time of packets: the computer's own clock, correlated with TAI by a command and kept by pulses.
//!
//! All of the flight loop runs on the board's clock, which never jumps. Only the times in packets are TAI.

use crate::cuc::{Cuc, Epoch};
use crate::messages::Code;

/// Oldest pulse that a command may speak of: there is one every second.
const OLDEST_PULSE_US: u64 = 1_500_000;
/// A pulse that is further from a whole second is a disturbance of its line. A clock that is wrong by 0.01 % needs a
/// quarter of an hour without pulses to be off by this much.
const FURTHEST_US: u64 = 100_000;
const SECOND_US: u64 = 1_000_000;

/// The correlation of the board's clock.
#[derive(Debug)]
pub(super) struct Clock {
    /// TAI minus the clock.
    offset_us: Option<u64>,
    /// Time of the last pulse on the clock.
    pulse_us: Option<u64>,
    /// Whether the last pulse was near a whole second.
    follows_pulses: bool,
}

impl Clock {
    pub(super) const fn new() -> Self {
        Self { offset_us: None, pulse_us: None, follows_pulses: false }
    }

    /// Returns the time code of a time on the board's clock.
    pub(super) fn at(&self, clock_us: u64) -> Cuc {
        match self.offset_us {
            Some(offset) => Cuc::tai(clock_us.wrapping_add(offset)),
            // Another P-field, so that the ground does not take the time since the start for TAI.
            None => Cuc::since_start(clock_us),
        }
    }

    /// Returns the time on the board's clock; `None` if the time is TAI and the clock is not correlated.
    pub(super) fn clock_us(&self, time: Cuc) -> Option<u64> {
        match time.epoch {
            Epoch::Start => Some(time.us),
            // Wrapping, so that values may be older than the start: their time is then negative in two's complement.
            Epoch::Tai => self.offset_us.map(|offset| time.us.wrapping_sub(offset)),
        }
    }

    /// Takes note of the last pulse: it comes with each whole second of TAI.
    pub(super) fn note_pulse(&mut self, pulse_us: Option<u64>) {
        // A board reports a pulse until the next one comes. It corrects the clock once.
        let Some(pulse) = pulse_us.filter(|_| pulse_us != self.pulse_us) else { return };
        self.pulse_us = Some(pulse);
        // The pulse is kept nevertheless, because the first telecommand `time` may speak of it.
        let Some(offset) = self.offset_us else { return };
        let tai = pulse.wrapping_add(offset);
        let nearest = (tai.wrapping_add(SECOND_US / 2)) / SECOND_US * SECOND_US;
        self.follows_pulses = nearest.abs_diff(tai) < FURTHEST_US;
        // A disturbance is not followed, because it would move the time of every packet.
        if self.follows_pulses {
            self.offset_us = Some(nearest.wrapping_sub(pulse));
        }
    }

    /// Correlates the clock: the time was `time` at the last pulse, or else at `now_us`. Returns the change of the
    /// offset in microseconds; `None` at the first time.
    pub(super) fn correlate(&mut self, time: Cuc, at_pulse: bool, now_us: u64) -> Result<Option<u64>, Code> {
        // The ground means the pulse of this second. An older one would make an error of whole seconds.
        let pulse = self.pulse_us.filter(|pulse| now_us.saturating_sub(*pulse) <= OLDEST_PULSE_US);
        let clock_us = if at_pulse { pulse.ok_or(Code::NoPulse)? } else { now_us };
        // A pulse comes at a whole second.
        if time.epoch != Epoch::Tai || at_pulse && !time.us.is_multiple_of(SECOND_US) {
            return Err(Code::Refused);
        }
        let offset = time.us.wrapping_sub(clock_us);
        self.follows_pulses = at_pulse;
        // The event has the change, so that the ground sees how far off the earlier times were.
        Ok(self.offset_us.replace(offset).map(|before| before.abs_diff(offset)))
    }

    /// Returns the state of the clock, as in housekeeping.
    pub(super) fn state(&self, now_us: u64) -> u8 {
        let has_pulse = self.pulse_us.is_some_and(|pulse| now_us.saturating_sub(pulse) <= OLDEST_PULSE_US);
        match self.offset_us {
            None => 0,
            Some(_) if self.follows_pulses && has_pulse => 2,
            Some(_) => 1,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TAI_US: u64 = 2_171_923_200_000_000;

    #[test]
    fn pulses_keep_a_clock_that_runs_too_fast() {
        let mut clock = Clock::new();
        clock.note_pulse(Some(500_000));
        assert_eq!(clock.correlate(Cuc::tai(TAI_US), true, 700_000), Ok(None));
        // The clock is 50 ppm too fast, for a day.
        for second in 1..=86_400u64 {
            clock.note_pulse(Some(500_000 + second * 1_000_050));
        }
        let last = 500_000 + 86_400 * 1_000_050;
        assert_eq!(clock.at(last), Cuc::tai(TAI_US + 86_400_000_000));
        assert_eq!((clock.state(last + 1_000_000), clock.state(last + 2_000_000)), (2, 1));
        // A disturbance is not followed.
        clock.note_pulse(Some(last + 300_000));
        assert_eq!(clock.at(last), Cuc::tai(TAI_US + 86_400_000_000));
        assert_eq!(clock.state(last + 300_000), 1);
    }

    #[test]
    fn a_time_that_cannot_be_is_refused() {
        let mut clock = Clock::new();
        assert_eq!(clock.correlate(Cuc::tai(TAI_US), true, 700_000), Err(Code::NoPulse));
        assert_eq!(clock.correlate(Cuc::since_start(5), false, 700_000), Err(Code::Refused));
        clock.note_pulse(Some(500_000));
        assert_eq!(clock.correlate(Cuc::tai(TAI_US + 1), true, 700_000), Err(Code::Refused));
        assert_eq!(clock.at(9), Cuc::since_start(9));
        assert_eq!(clock.clock_us(Cuc::tai(TAI_US)), None);
        assert_eq!(clock.correlate(Cuc::tai(TAI_US), false, 700_000), Ok(None));
        assert_eq!(clock.clock_us(Cuc::tai(TAI_US + 5)), Some(700_005));
        assert_eq!(clock.correlate(Cuc::tai(TAI_US + 3), false, 700_000), Ok(Some(3)));
    }
}
