//! What survives a reset: how often the watchdog reset the computer, when it lifted off, and the count of the last
//! telecommand.
//!
//! | resets by the watchdog in a row | what the computer does |
//! |---|---|
//! | 1, 2 | it starts as usual |
//! | 3 to 5 | it uses the older parameters, because the newer ones may be the cause |
//! | 6 and more | it stays in safe mode, as `boot.safe_after_resets` says |
//!
//! After a minute without a reset the count starts again.

use crate::board::{Board, RETAINED_WORDS};
use crate::store::Choice;
use crate::table::CRC32;

/// Resets in a row after which the older parameters are used.
pub(super) const OLDER_AFTER: u8 = 3;
/// Resets in a row after which the computer stays in safe mode.
pub(super) const SAFE_AFTER: u8 = 6;
/// A computer that runs this long is not in a loop of resets.
const STABLE_US: u64 = 60_000_000;
/// Time for which the shut-down is armed.
const ARMED_US: u64 = 10_000_000;
/// A bit of the word with the sequence count of the last telecommand: there was one.
const HAS_SEQUENCE: u32 = 1 << 16;
/// Place of the sequence count of the last telecommand to the rig in this word, for the first head of a rig. A count
/// has
/// 14 bits.
const RIG_SEQUENCE_AT: u32 = 17;
/// A bit of this word: there was a telecommand to the rig.
const HAS_RIG_SEQUENCE: u32 = 1 << 31;
/// The value of "since lift-off" before lift-off.
const ON_THE_GROUND: u32 = u32::MAX;

/// Starts, resets and lift-off.
#[derive(Debug)]
pub(super) struct Recovery {
    pub(super) starts: u16,
    pub(super) watchdog_resets: u8,
    /// Time of the start minus the time since lift-off that was known then, µs. Negative if lift-off was before the
    /// start.
    lift_off_us: Option<i64>,
    /// Whether the lift-off line showed lift-off at the last turn.
    line_was_off: bool,
    armed_until_us: u64,
    /// Sequence count of the last telecommand that was taken.
    last_sequence: Option<u16>,
    /// The same for telecommands to the rig whose first head this is.
    rig_sequence: Option<u16>,
    /// Seconds since lift-off that are kept for a reset.
    kept_s: Option<u32>,
    is_stable: bool,
}

impl Recovery {
    /// Reads what the last run left, and counts this start.
    pub(super) fn begin(board: &mut impl Board) -> Self {
        let now_us = board.now_us();
        let [counts, since_ms, sequence, check] = board.read_retained();
        // A start was counted before words were kept, so that zeros are memory without any.
        let is_kept = counts != 0 && check == checksum([counts, since_ms, sequence]);
        let (starts, resets) = if is_kept { ((counts >> 16) as u16, counts as u8) } else { (0, 0) };
        let lift_off_us = (is_kept && since_ms != ON_THE_GROUND)
            .then(|| now_us.cast_signed().saturating_sub(i64::from(since_ms) * 1000));
        let mut recovery = Self {
            starts: starts.saturating_add(1),
            // Another reset ends the row, because the program did not hang.
            watchdog_resets: if board.was_watchdog_reset() { resets.saturating_add(1) } else { 0 },
            lift_off_us,
            line_was_off: false,
            armed_until_us: 0,
            last_sequence: (is_kept && sequence & HAS_SEQUENCE != 0).then_some(sequence as u16),
            rig_sequence: (is_kept && sequence & HAS_RIG_SEQUENCE != 0)
                .then_some((sequence >> RIG_SEQUENCE_AT & 0x3FFF) as u16),
            kept_s: None,
            is_stable: false,
        };
        // At once, because the count would miss a reset in the first turn.
        recovery.keep(board, now_us);
        recovery
    }

    /// Returns which parameters to use.
    pub(super) fn choice(&self) -> Choice {
        if self.watchdog_resets >= OLDER_AFTER { Choice::Older } else { Choice::Newer }
    }

    /// Keeps the counts and the time since lift-off for the time after a reset.
    pub(super) fn keep(&mut self, board: &mut impl Board, now_us: u64) {
        let since_us = self.lift_off_us.map(|at| now_us.cast_signed().saturating_sub(at));
        let since_ms = since_us.map_or(ON_THE_GROUND, |us| u32::try_from(us / 1000).unwrap_or(ON_THE_GROUND - 1));
        // Only the kept count starts again, so that housekeeping still says why this run began.
        let resets = if self.is_stable { 0 } else { self.watchdog_resets };
        let sequence = self.last_sequence.map_or(0, |sequence| HAS_SEQUENCE | u32::from(sequence));
        let of_rig =
            self.rig_sequence.map_or(0, |sequence| HAS_RIG_SEQUENCE | u32::from(sequence & 0x3FFF) << RIG_SEQUENCE_AT);
        let words = [u32::from(self.starts) << 16 | u32::from(resets), since_ms, sequence | of_rig];
        let [counts, since_ms, sequence] = words;
        let kept: [u32; RETAINED_WORDS] = [counts, since_ms, sequence, checksum(words)];
        board.write_retained(kept);
        self.kept_s = self.since_lift_off_s(now_us);
    }

    /// Takes note of a telecommand, before it is carried out: after a reset in the middle its replay is refused, too.
    pub(super) fn note_sequence(&mut self, board: &mut impl Board, sequence: u16, now_us: u64) {
        self.last_sequence = Some(sequence);
        self.keep(board, now_us);
    }
    /// Takes note of a telecommand to the rig whose first head this is.
    pub(super) fn note_rig_sequence(&mut self, board: &mut impl Board, sequence: u16, now_us: u64) {
        self.rig_sequence = Some(sequence);
        self.keep(board, now_us);
    }
    pub(super) fn rig_sequence(&self) -> Option<u16> {
        self.rig_sequence
    }
    pub(super) fn last_sequence(&self) -> Option<u16> {
        self.last_sequence
    }

    /// Writes what has changed since the last turn.
    pub(super) fn keep_up(&mut self, board: &mut impl Board, now_us: u64) {
        let is_stable = now_us >= STABLE_US;
        // At most once a second, because `hzn fly` keeps the words in a file.
        if is_stable != self.is_stable || self.since_lift_off_s(now_us) != self.kept_s {
            self.is_stable = is_stable;
            self.keep(board, now_us);
        }
    }

    /// Returns whether the lift-off line has changed to lift-off since the last turn. The first turn after the start
    /// counts a line that shows lift-off as a change: a reset during flight must not end the flight.
    pub(super) fn sees_lift_off(&mut self, line_is_off: bool, now_us: u64) -> bool {
        let is_edge = line_is_off && !self.line_was_off;
        self.line_was_off = line_is_off;
        // The first lift-off counts, because a second change of the line would otherwise put off the shut-down.
        if is_edge && self.lift_off_us.is_none() {
            self.lift_off_us = Some(now_us.cast_signed());
        }
        is_edge
    }

    pub(super) fn has_lifted_off(&self) -> bool {
        self.lift_off_us.is_some()
    }
    /// Returns the whole seconds since lift-off.
    pub(super) fn since_lift_off_s(&self, now_us: u64) -> Option<u32> {
        let since_us = now_us.cast_signed().saturating_sub(self.lift_off_us?);
        u32::try_from(since_us / 1_000_000).ok()
    }
    /// Allows the mode shut-down from now on for ten seconds.
    pub(super) fn arm(&mut self, now_us: u64) {
        self.armed_until_us = now_us + ARMED_US;
    }
    pub(super) fn is_armed(&self, now_us: u64) -> bool {
        now_us < self.armed_until_us
    }
}

/// Returns the checksum of the words that a reset leaves unchanged. After power-on they are random.
fn checksum(words: [u32; RETAINED_WORDS - 1]) -> u32 {
    let mut digest = CRC32.digest();
    words.iter().for_each(|word| digest.update(&word.to_le_bytes()));
    digest.finalize()
}
