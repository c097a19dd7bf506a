//! The memory of all decoders together.
//!
//! A thread asks for the memory that its picture needs before it decodes the picture. If other threads have taken too
//! much, it waits. Requests are served in their order, so that a large one is not overtaken for ever.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// Memory of all decoders together, in bytes. A larger request waits until it is alone.
const TOTAL: u64 = 512 << 20;

/// Memory that threads share.
#[derive(Debug)]
struct Memory {
    total: u64,
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug)]
struct State {
    taken: u64,
    /// Numbers of the waiting requests, in their order.
    waiting: VecDeque<u64>,
    next: u64,
}

static MEMORY: Memory = Memory::new(TOTAL);

impl Memory {
    const fn new(total: u64) -> Self {
        let state = State { taken: 0, waiting: VecDeque::new(), next: 0 };
        Self { total, state: Mutex::new(state), changed: Condvar::new() }
    }

    /// A thread that panics leaves the numbers whole.
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits until the memory is free, and returns how much was taken.
    fn take(&self, bytes: u64) -> u64 {
        let bytes = bytes.min(self.total);
        let mut state = self.state();
        let number = state.next;
        state.next += 1;
        state.waiting.push_back(number);
        while state.waiting.front() != Some(&number) || state.taken + bytes > self.total {
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        state.waiting.pop_front();
        state.taken += bytes;
        drop(state);
        // The next request may fit as well.
        self.changed.notify_all();
        bytes
    }

    fn give_back(&self, bytes: u64) {
        self.state().taken -= bytes;
        self.changed.notify_all();
    }
}

/// Memory that a thread has taken. It is free again when this value is dropped.
#[derive(Debug)]
pub struct Held {
    memory: &'static Memory,
    bytes: u64,
}

impl Default for Held {
    /// Holds nothing.
    fn default() -> Self {
        Self { memory: &MEMORY, bytes: 0 }
    }
}

impl Held {
    /// Gives the held memory back and takes `bytes`. A thread that waits here holds nothing, so that threads cannot
    /// wait for each other.
    pub(super) fn exchange(&mut self, bytes: u64) {
        self.memory.give_back(std::mem::take(&mut self.bytes));
        self.bytes = self.memory.take(bytes);
    }

    /// Takes `bytes` as [`Self::exchange`] does, unless as much is held already.
    pub(super) fn raise(&mut self, bytes: u64) {
        if bytes.min(self.memory.total) > self.bytes {
            self.exchange(bytes);
        }
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        self.memory.give_back(self.bytes);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU64, Ordering};

    use super::*;

    #[test]
    fn never_more_than_the_total_is_taken_and_large_requests_are_served() {
        static SMALL: Memory = Memory::new(100);
        static USED: AtomicU64 = AtomicU64::new(0);
        static MOST: AtomicU64 = AtomicU64::new(0);
        let work = |thread: u64| {
            for i in 0..2000 {
                let mut held = Held { memory: &SMALL, bytes: 0 };
                // Every thread asks for parts, for the whole, and for more than there is.
                let asked = [7, 40, 100, 1000, 1][((thread + i) % 5) as usize];
                held.exchange(3);
                held.raise(asked);
                assert_eq!(held.bytes, asked.clamp(3, 100));
                let used = USED.fetch_add(held.bytes, Ordering::SeqCst) + held.bytes;
                MOST.fetch_max(used, Ordering::SeqCst);
                USED.fetch_sub(held.bytes, Ordering::SeqCst);
            }
        };
        std::thread::scope(|scope| (0..8).for_each(|thread| drop(scope.spawn(move || work(thread)))));
        assert_eq!(MOST.load(Ordering::SeqCst), 100);
        let state = SMALL.state();
        assert_eq!((state.taken, state.waiting.len()), (0, 0));
    }
}
