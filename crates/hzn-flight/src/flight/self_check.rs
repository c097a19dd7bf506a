//! The self-checks at the start.

use super::Flight;
use crate::board::Board;
use crate::messages::{Event, Mode};

/// The bit of `self_check` in housekeeping that says that no stored parameters can be used.
pub(super) const NO_PARAMETERS: u8 = 4;

impl<B: Board> Flight<'_, B> {
    /// Runs the self-checks of camera, memory and parameters. Default parameters fail the check: a sensor that was not
    /// configured is of no use, so the computer enters safe mode.
    pub(super) fn run_self_checks(&mut self, parameters: bool) {
        let camera = self.board.camera_answers();
        // The memory of the packets, because nothing in it must survive.
        let memory = memory_works(&mut self.buffers.line.out, |_| ());
        let failed = u8::from(!camera) | u8::from(!memory) << 1 | if parameters { 0 } else { NO_PARAMETERS };
        self.state.self_check = failed;
        if failed != 0 {
            self.send_event(Event::SelfCheck, u32::from(failed), 0);
            self.enter_mode(Mode::Safe);
        }
    }
}

/// Returns whether memory holds every bit, set and cleared. `meanwhile` changes the memory after each write; tests use
/// it for stuck bits.
fn memory_works(memory: &mut [u8], meanwhile: impl Fn(&mut [u8])) -> bool {
    // Each bit differs from its neighbours, so that two that are connected are noticed, too.
    [0x55u8, 0xAA].iter().all(|&pattern| {
        memory.fill(pattern);
        // Otherwise the compiler knows what was written, and reads nothing.
        meanwhile(core::hint::black_box(&mut *memory));
        core::hint::black_box(&*memory).iter().all(|&b| b == pattern)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packet::MAX_BYTES;

    #[test]
    fn a_bit_that_is_stuck_fails_the_self_check() {
        let mut memory = [0; MAX_BYTES];
        assert!(memory_works(&mut memory, |_| ()));
        // Each bit is a walk over the whole memory, which is long in Miri.
        for bit in (0..8 * MAX_BYTES).step_by(if cfg!(miri) { 97 } else { 1 }) {
            assert!(!memory_works(&mut memory, |m| m[bit / 8] |= 1 << (bit % 8)), "bit {bit} stuck at 1");
            assert!(!memory_works(&mut memory, |m| m[bit / 8] &= !(1 << (bit % 8))), "bit {bit} stuck at 0");
        }
    }
}
