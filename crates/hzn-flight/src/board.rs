//! What a board brings. A port is one implementation of this trait.

/// A picture that the camera has written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shot {
    /// Bytes that the camera wrote.
    pub bytes: usize,
    /// Exposure, µs since the start.
    pub exposure_us: u64,
    /// Pictures lost since the last one, because both buffers were full.
    pub lost: u32,
}

/// A board: clock, line, camera, memory, watchdog.
pub trait Board {
    /// Microseconds since the start; never goes back.
    fn now_us(&mut self) -> u64;
    /// The next byte that was received, if there is one.
    fn receive(&mut self) -> Option<u8>;
    /// Sends bytes; returns when they are on their way.
    fn send(&mut self, bytes: &[u8]);
    /// The lift-off signal: pulled out once the rocket leaves.
    fn lift_off(&mut self) -> bool;
    /// The warning that power will be cut.
    fn power_fails(&mut self) -> bool;
    /// Whether the last reset was the watchdog's.
    fn was_watchdog_reset(&mut self) -> bool;
    /// Tells the watchdog that there was progress.
    fn feed_watchdog(&mut self);
    /// Whether the camera answers.
    fn camera_answers(&mut self) -> bool;
    /// The newest picture that was not taken yet. The buffer that is given up is the camera's again.
    fn next_shot(&mut self) -> Option<Shot>;
    /// The bytes of the picture taken last: one a pixel, row by row.
    fn picture(&self) -> &[u8];
    /// A copy of the parameters, 1 or 2, as it stands in memory.
    fn read_copy(&mut self, copy: u8, into: &mut [u8]);
    /// Writes a copy of the parameters, 1 or 2; false when the memory refuses.
    fn write_copy(&mut self, copy: u8, bytes: &[u8]) -> bool;
    /// Most bytes of stack since the start; 0 when unknown.
    fn stack_bytes(&mut self) -> u32;
}
