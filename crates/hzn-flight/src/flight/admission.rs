//! Admission on a board with keys: which telecommands are carried out.

use crate::authentication::{KEY_BYTES, KEYS, Key, RESERVED, TRAILER_BYTES};
use crate::board::Board;
use crate::bytes::Reader;
use crate::messages::{Code, Function};
use crate::packet::ApidBase;

/// What becomes of a telecommand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Admitted {
    /// It is taken. Its user data, without the trailer, have this length.
    Taken(usize),
    /// It is taken, but it may come from a stranger, so that its sequence count must not count.
    Anonymous,
    /// It is refused.
    Refused(Code),
}

/// The counters of the last telecommands that were taken. All zeros mean that none was taken since the start.
#[derive(Debug)]
pub(super) struct Admission {
    counters: [Counter; KEYS],
}

/// The counter of a key.
#[derive(Debug, Clone, Copy)]
struct Counter {
    last: u64,
    /// The inverse of `last`. If a flipped bit made them disagree, the counters in memory hold.
    inverse: u64,
}

impl Admission {
    pub(super) const fn new() -> Self {
        Self { counters: [Counter { last: 0, inverse: 0 }; KEYS] }
    }

    /// Judges a telecommand. `user` are its user data, with the trailer if it has one.
    // Not inlined, because the hash needs a stack of its own.
    #[inline(never)]
    pub(super) fn admit(&mut self, board: &mut impl Board, base: ApidBase, sequence: u16, user: &[u8]) -> Admitted {
        if !board.has_keys() {
            return Admitted::Taken(user.len());
        }
        if let &[function] = user
            && [Function::Ping as u8, Function::Report as u8].contains(&function)
        {
            return Admitted::Anonymous;
        }
        let stored = user.len().checked_sub(TRAILER_BYTES).filter(|bytes| *bytes > 0);
        let Some((bytes, trailer)) = stored.and_then(|bytes| Some((bytes, user.get(bytes..)?))) else {
            return Admitted::Refused(Code::NoTrailer);
        };
        let mut from = Reader::new(trailer);
        let (Some(number), Some(counter)) = (from.u8(), from.u64()) else {
            return Admitted::Refused(Code::NoTrailer);
        };
        // The keys are read each time, so that no copy of them waits in RAM, where a bit can flip.
        let mut is_readable = false;
        for (place, slot) in (0u8..).zip(&mut self.counters) {
            let mut bytes_of_key = [0xFF; KEY_BYTES];
            board.read_key(place, &mut bytes_of_key);
            let Some(key) = Key::from_bytes(&bytes_of_key) else { continue };
            is_readable = true;
            if key.number == number && key.is_right(base, sequence, user) {
                return match slot.take(board, place, counter) {
                    Ok(()) => Admitted::Taken(bytes),
                    Err(code) => Admitted::Refused(code),
                };
            }
        }
        Admitted::Refused(if is_readable { Code::Stranger } else { Code::Closed })
    }
}

impl Counter {
    /// Takes a counter if it is above the last one.
    fn take(&mut self, board: &mut impl Board, place: u8, counter: u64) -> Result<(), Code> {
        // The counters up to this one may have been taken before the reset.
        let reserved = board.read_counter(place).ok_or(Code::Closed)?;
        let last = if self.last == !self.inverse { self.last } else { reserved };
        if counter <= last {
            return Err(Code::Replay);
        }
        if counter > reserved {
            // Before the telecommand is carried out: a reset in the middle of it must not make it new again.
            let until = counter.saturating_add(RESERVED);
            let is_kept = board.write_counter(place, until) && board.read_counter(place) == Some(until);
            is_kept.then_some(()).ok_or(Code::Closed)?;
        }
        (self.last, self.inverse) = (counter, !counter);
        Ok(())
    }
}
