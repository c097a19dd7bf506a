//! The functions that a board provides. A port is one implementation of this trait.

/// A picture that the camera has written to memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Picture {
    /// Bytes that the camera wrote.
    pub bytes: usize,
    /// Time of the exposure, µs since the start.
    pub exposure_us: u64,
    /// Pictures lost since the last one, because both buffers were full.
    pub lost: u32,
}

/// A board: clock, line, camera, memory, watchdog.
pub trait Board {
    /// Returns the microseconds since the start. The time never goes back.
    fn now_us(&mut self) -> u64;
    /// Returns the next byte that was received, if there is one.
    fn receive(&mut self) -> Option<u8>;
    /// Sends bytes. Returns when the line has taken them.
    fn send(&mut self, bytes: &[u8]);
    /// Returns whether there is the lift-off signal: its plug is pulled out when the rocket leaves.
    fn lift_off(&mut self) -> bool;
    /// Returns whether there is a warning that power will be cut.
    fn power_fails(&mut self) -> bool;
    /// Returns whether the watchdog caused the last reset.
    fn was_watchdog_reset(&mut self) -> bool;
    /// Tells the watchdog that the program makes progress.
    fn feed_watchdog(&mut self);
    /// Returns whether the camera answers.
    fn camera_answers(&mut self) -> bool;
    /// Takes the newest picture that was not taken yet, if there is one. The camera gets the buffer of the picture
    /// before.
    fn next_picture(&mut self) -> Option<Picture>;
    /// Returns the pixels of the picture that was taken last: one byte per pixel, row by row.
    fn pixels(&self) -> &[u8];
    /// Reads copy 1 or 2 of the parameters from memory.
    fn read_copy(&mut self, copy: u8, into: &mut [u8]);
    /// Writes copy 1 or 2 of the parameters. Returns false if the memory refuses.
    fn write_copy(&mut self, copy: u8, bytes: &[u8]) -> bool;
    /// Returns the largest use of the stack since the start in bytes; 0 if unknown.
    fn stack_bytes(&mut self) -> u32;
}
