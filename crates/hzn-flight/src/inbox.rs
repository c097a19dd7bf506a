//! The receiver of telecommands: it finds whole packets among the bytes of a line that is not perfect.
//!
//! | danger | rule |
//! |---|---|
//! | a packet inside the data of another packet | the outer packet is taken or given up as a whole |
//! | a packet inside the data of a damaged packet | see below |
//! | a damaged length that claims many bytes | a packet is complete one second after its marker, or it is given up |
//! | bytes that make much work | [`Inbox::effort`] counts the work, and the loop limits it |
//!
//! A damaged packet does not say where it ends. For [`MAX_BYTES`] bytes after its marker, a packet is therefore taken
//! only if whole packets alone follow it, one after the other, up to a pause of the line or up to the end of these
//! bytes. A packet inside the damaged one is refused, also if others lie beside it there: the rest of the damaged
//! packet, at least its checksum, follows them without a pause. A marker with a few wrong bits, or without one of its
//! bytes, also begins a damaged packet.

use crate::packet::{self, HEADER, MAX_BYTES, Packet, SYNC};

/// A pause of the line, which no sender makes inside a packet.
const PAUSE_US: u64 = 100_000;
/// Time from the marker of a packet to its end, after which it is given up: a line must carry [`MAX_BYTES`] in less.
/// With the pause that confirms a packet it is one second, so no telecommand waits longer for its answer.
const COMPLETE_US: u64 = 900_000;
/// Arrival times are kept in units of 2^14 µs, modulo 256: about four seconds.
// A time has one byte, because 1029 of them are kept. A turn of more than four seconds can hide that a packet is late.
// It is then given up later, so that nothing is taken by mistake.
const TICK_LOG2: u32 = 14;
/// Rounded down, so that a pause is always noticed: from 82 ms on it may be one.
const PAUSE_TICKS: u8 = (PAUSE_US >> TICK_LOG2) as u8;
const COMPLETE_TICKS: u8 = (COMPLETE_US >> TICK_LOG2) as u8;

/// The longest packet, and the bytes after it that show a pause or another packet.
const CAPACITY: usize = MAX_BYTES + SYNC.len() + 1;

/// Most wrong bits of a marker that counts as damaged. Of random bytes, one in 800 000 is the end of such a marker.
// With more bits, a good telecommand in noise would wait for its confirmation more often.
const WRONG_BITS: u32 = 3;

/// Collects bytes as they come in. If it is not empty, it begins with a sync marker.
#[derive(Debug)]
pub struct Inbox {
    bytes: [u8; CAPACITY],
    /// Time of arrival of each byte, in ticks.
    arrived: [u8; CAPACITY],
    start: usize,
    end: usize,
    /// Number of bytes from which on [`Self::next`] has something to do.
    // It saves a look at the packet for every byte, because nothing changes before the header or the end is there.
    need: usize,
    /// The last four bytes outside a packet.
    window: u32,
    /// Number of bytes since the marker of the last damaged packet, up to [`MAX_BYTES`]; fewer bytes may belong to it.
    since_damage: usize,
    /// Number of bytes from the start that are whole packets with right checksums, one after the other.
    // A checksum is computed once, because `step` runs again for every byte that may confirm the packet.
    checked: usize,
    last_us: u64,
    effort: usize,
}

impl Default for Inbox {
    fn default() -> Self {
        Self::new()
    }
}

/// Why [`Inbox::fill`] took no more bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Filled {
    /// [`Inbox::next`] has something to do.
    Ready,
    /// There are no more bytes.
    Silent,
    /// The most bytes were taken, or there is no room for more.
    Full,
}

/// The state of the packet at the start.
enum Step {
    More,
    /// The number of bytes to leave out.
    Broken(usize),
    /// The number of bytes of the packet.
    Packet(usize),
}

/// What follows the packets whose checksums are right.
enum After {
    Pause,
    /// The marker of a packet at this place.
    Marker(usize),
    /// Too few bytes to tell.
    Open,
    Other,
}

impl Inbox {
    /// Makes an empty inbox, of all zeros. The line may be in the middle of a packet, so the end of the first packet
    /// must be confirmed.
    pub const fn new() -> Self {
        Self {
            bytes: [0; CAPACITY],
            arrived: [0; CAPACITY],
            start: 0,
            end: 0,
            need: 0,
            window: 0,
            since_damage: 0,
            checked: 0,
            last_us: 0,
            effort: 0,
        }
    }

    /// Takes at most `most` bytes, which have arrived until `now_us`, from `receive`. It stops when [`Self::next`] has
    /// something to do, unless `reads_on` is set. Returns the number of bytes and why there are no more.
    pub fn fill(
        &mut self,
        now_us: u64,
        most: usize,
        reads_on: bool,
        mut receive: impl FnMut() -> Option<u8>,
    ) -> (usize, Filled) {
        let mut taken = 0;
        let filled = loop {
            let left = most - taken;
            let (count, is_silent) = if self.start == self.end {
                self.find_marker(now_us, left, &mut receive)
            } else {
                self.add(now_us, left, reads_on, &mut receive)
            };
            taken += count;
            let held = self.end - self.start;
            if is_silent {
                break Filled::Silent;
            } else if held > 0 && held >= self.need && !reads_on {
                break Filled::Ready;
            } else if taken >= most || held == CAPACITY {
                break Filled::Full;
            }
        };
        if taken > 0 {
            self.last_us = now_us;
        }
        self.effort += taken;
        (taken, filled)
    }

    /// Takes bytes outside a packet, up to the end of a marker. Returns their number, and whether there are no more.
    // Inlined, because it runs for every byte of noise, which costs 21 instructions in all (Cortex-M4F).
    #[inline(always)]
    fn find_marker(&mut self, now_us: u64, most: usize, receive: &mut impl FnMut() -> Option<u8>) -> (usize, bool) {
        for count in 0..most {
            let Some(byte) = receive() else { return (count, true) };
            if self.is_marker(byte) {
                self.begin(now_us);
                return (count + 1, false);
            }
        }
        (most, false)
    }

    /// Adds bytes to those of the packet. Returns their number, and whether there are no more.
    #[inline(always)]
    fn add(
        &mut self,
        now_us: u64,
        most: usize,
        reads_on: bool,
        receive: &mut impl FnMut() -> Option<u8>,
    ) -> (usize, bool) {
        // At least one byte is read before a packet of the last turn is judged, so that the pause before it is known.
        let held = self.end - self.start;
        let wanted = if reads_on { CAPACITY } else { self.need.max(held + 1).min(CAPACITY) };
        if self.start + wanted > CAPACITY {
            self.compact();
        }
        // All bytes of a turn get its time, because the serial port keeps none: a pause during a long turn is not seen.
        let (from, to, now) = (self.end, self.start + wanted, tick(now_us));
        let places = self.bytes.get_mut(from..to).unwrap_or_default().iter_mut();
        let mut count = 0;
        for (place, time) in places.zip(self.arrived.get_mut(from..to).unwrap_or_default()).take(most) {
            let Some(byte) = receive() else { break };
            (*place, *time) = (byte, now);
            count += 1;
        }
        self.end += count;
        (count, count < most && self.end < to)
    }

    /// Returns the work since the last call: the number of bytes that were examined, counted each time.
    pub fn effort(&self) -> usize {
        self.effort
    }
    /// Sets the work to zero.
    pub fn reset_effort(&mut self) {
        self.effort = 0;
    }

    /// Returns whether there is nothing for [`Self::next`] although bytes have come: all of them were left out. Without
    /// a pause before them, nothing else depends on the time.
    pub fn is_empty(&self) -> bool {
        self.start == self.end
    }

    /// Passes the next packet to `handle`, or `None` for a broken packet. Returns the result of `handle`; `None` if
    /// there is no packet yet. All bytes that have arrived until `now_us` must have been added.
    pub fn next<R>(&mut self, now_us: u64, handle: impl FnOnce(Option<Packet<'_>>) -> R) -> Option<R> {
        match self.step(now_us) {
            Step::More => None,
            Step::Broken(count) => {
                self.since_damage = 0;
                self.leave_out(count);
                Some(handle(None))
            }
            Step::Packet(length) => {
                let packet = self.bytes.get(self.start..self.start + length).and_then(packet::parse);
                let result = handle(packet);
                // The end of this packet is known, so the next one needs no confirmation.
                self.since_damage = MAX_BYTES;
                self.leave_out(length);
                Some(result)
            }
        }
    }

    #[inline(never)]
    fn step(&mut self, now_us: u64) -> Step {
        let is_quiet = now_us.saturating_sub(self.last_us) >= PAUSE_US;
        let held = self.bytes.get(self.start..self.end).unwrap_or_default();
        let Some(&began) = self.arrived.get(self.start).filter(|_| !held.is_empty()) else {
            // A pause ends the damaged packet, because no sender pauses inside a packet or a marker.
            if is_quiet {
                (self.since_damage, self.window) = (MAX_BYTES, 0);
            }
            return Step::More;
        };
        // A damaged length may have hidden another packet: it is searched for after the marker.
        const BROKEN: Step = Step::Broken(SYNC.len());
        let is_late = tick(now_us).wrapping_sub(began) >= COMPLETE_TICKS;
        let Some(header) = held.first_chunk() else {
            self.need = SYNC.len() + HEADER;
            return if is_late { BROKEN } else { Step::More };
        };
        // The header is judged before the rest has come, because a damaged length would hold back what follows.
        let Some(length) = packet::length(header) else { return BROKEN };
        let Some(whole) = held.get(..length) else {
            self.need = length;
            return if is_late { BROKEN } else { Step::More };
        };
        if self.checked == 0 {
            // The checksum counts as work, because packets inside packets would make it again for every marker.
            self.effort += length;
            if !packet::is_whole(whole) {
                return BROKEN;
            }
            self.checked = length;
        }
        if self.since_damage < MAX_BYTES { self.confirm(length, is_quiet, is_late) } else { Step::Packet(length) }
    }

    /// Finds out whether the packet at the start, of `length` bytes, is no part of the damaged packet, from what
    /// follows it.
    fn confirm(&mut self, length: usize, is_quiet: bool, is_late: bool) -> Step {
        // The damaged packet has ended before these bytes do.
        while self.since_damage + self.checked < MAX_BYTES {
            // All that was checked is left out, because what follows it refuses each of these packets.
            let refused = Step::Broken(self.checked);
            let held = self.bytes.get(self.start..self.end).unwrap_or_default();
            let (next, need) = match self.after_checked(is_quiet) {
                After::Pause => return Step::Packet(length),
                After::Other => return refused,
                After::Open => (None, held.len() + 1),
                After::Marker(at) => {
                    let rest = held.get(at..).unwrap_or_default();
                    match rest.first_chunk().map(packet::length) {
                        None => (None, at + SYNC.len() + HEADER),
                        Some(None) => return refused,
                        Some(Some(bytes)) => (rest.get(..bytes), at + bytes),
                    }
                }
            };
            let Some(next) = next else {
                // A packet that is cut off by a pause shows nothing. Without a pause, no more bytes than these are
                // kept.
                if is_quiet || is_late || need > CAPACITY {
                    return refused;
                }
                self.need = need;
                return Step::More;
            };
            self.effort += next.len();
            if !packet::is_whole(next) {
                return refused;
            }
            self.checked = need;
        }
        Step::Packet(length)
    }

    /// Returns what follows the packets whose checksums are right. One byte before the pause or the next marker does
    /// not matter: some drivers of a line add it when they switch off.
    fn after_checked(&self, is_quiet: bool) -> After {
        let held = self.bytes.get(self.start..self.end).unwrap_or_default();
        let times = self.arrived.get(self.start..self.end).unwrap_or_default();
        for at in self.checked..=self.checked + 1 {
            let is_pause = match (times.get(at - 1), times.get(at)) {
                (Some(last), Some(next)) => next.wrapping_sub(*last) >= PAUSE_TICKS,
                (Some(_), None) => is_quiet,
                _ => false,
            };
            if is_pause {
                return After::Pause;
            }
            if held.get(at..).is_some_and(|after| after.starts_with(&SYNC)) {
                return After::Marker(at);
            }
        }
        // Other bytes followed without a pause, so the packet may be in the data of the damaged one.
        if held.len() > self.checked + SYNC.len() || is_quiet { After::Other } else { After::Open }
    }

    /// Removes bytes from the start, and everything up to the next marker.
    fn leave_out(&mut self, count: usize) {
        let from = (self.start + count).min(self.end);
        (self.checked, self.window, self.need) = (0, 0, 0);
        for at in from..self.end {
            self.effort += 1;
            if self.bytes.get(at).copied().is_some_and(|byte| self.is_marker(byte)) {
                self.start = (at + 1).saturating_sub(SYNC.len());
                return;
            }
        }
        (self.start, self.end) = (0, 0);
    }

    /// Takes a byte outside a packet, and returns whether a marker ends with it.
    #[inline(always)]
    fn is_marker(&mut self, byte: u8) -> bool {
        self.window = self.window << 8 | u32::from(byte);
        if self.window == u32::from_be_bytes(SYNC) {
            self.window = 0;
            return true;
        }
        // A damaged marker has a byte of the marker in its place. Other bytes, nearly all, are known at a glance.
        // The four bytes are compared at once, because four comparisons for every byte of noise would cost more.
        if has_zero_byte(self.window ^ u32::from_be_bytes(SYNC)) && is_damaged_marker(self.window) {
            self.since_damage = 0;
        } else if self.since_damage < MAX_BYTES {
            self.since_damage += 1;
        }
        false
    }

    fn begin(&mut self, now_us: u64) {
        // The marker is stored again, because the functions of `packet` read a packet from its marker on.
        (self.start, self.end, self.need, self.checked) = (0, SYNC.len(), SYNC.len() + HEADER, 0);
        for (place, byte) in self.bytes.iter_mut().zip(SYNC) {
            *place = byte;
        }
        self.arrived.iter_mut().take(SYNC.len()).for_each(|time| *time = tick(now_us));
    }

    #[cold]
    fn compact(&mut self) {
        let held = self.end - self.start;
        // A loop instead of `copy_within`, which has a panic path.
        for i in 0..held {
            let from = self.start + i;
            if let (Some(&byte), Some(&time)) = (self.bytes.get(from), self.arrived.get(from))
                && let (Some(b), Some(t)) = (self.bytes.get_mut(i), self.arrived.get_mut(i))
            {
                (*b, *t) = (byte, time);
            }
        }
        self.effort += held;
        (self.start, self.end) = (0, held);
    }
}

/// Returns whether one of the four bytes is zero.
#[inline(always)]
const fn has_zero_byte(word: u32) -> bool {
    word.wrapping_sub(0x0101_0101) & !word & 0x8080_8080 != 0
}

/// Returns whether the last bytes are a marker with a few wrong bits, a marker without its first, second or third byte,
/// or one without its last byte and another byte.
#[cold]
fn is_damaged_marker(window: u32) -> bool {
    let [a, b, c, d] = SYNC;
    let three = window & 0xFF_FFFF;
    let word = |x: [u8; 3]| u32::from_be_bytes([0, x[0], x[1], x[2]]);
    let is_cut = three == word([b, c, d])
        || three == word([a, c, d])
        || three == word([a, b, d])
        || window >> 8 == word([a, b, c]);
    is_cut || (window ^ u32::from_be_bytes(SYNC)).count_ones() <= WRONG_BITS
}

fn tick(now_us: u64) -> u8 {
    (now_us >> TICK_LOG2) as u8
}
