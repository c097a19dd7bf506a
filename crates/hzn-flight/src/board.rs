//! The functions that a board provides. A port is one implementation of this trait.

use hzn_core::{Config, Report, Solution};

use crate::messages::Exposure;
use crate::packet::ApidBase;
use crate::table::CRC32;
use crate::view::Viewer;

/// A picture of the camera: in memory, or about to come row by row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Picture {
    /// Bytes that the camera wrote, or will send.
    pub bytes: usize,
    /// Time of the middle of the exposure, µs since the start. The values from navigation are moved to it.
    pub exposure_us: u64,
    /// Pictures lost since the last one, because both buffers were full.
    pub lost: u32,
}

/// The program in memory, as the board knows it; 0 means unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Image {
    /// Number of the build.
    pub build: u32,
    /// CRC-32 of the program image, as zlib computes it.
    pub crc: u32,
}

/// Number of the build, from the variable `HZN_BUILD` of the environment in which the program was built; 0 without it.
pub const BUILD: u32 = match option_env!("HZN_BUILD") {
    Some(digits) => match u32::from_str_radix(digits, 10) {
        Ok(build) => build,
        // This panic stops the compiler, so that no image has a wrong number. No image contains it.
        Err(_) => panic!("HZN_BUILD must be a whole number"),
    },
    None => 0,
};

/// Returns the CRC-32 of a program image, as zlib and `crc32` compute it.
pub fn image_crc(image: &[u8]) -> u32 {
    CRC32.checksum(image)
}

/// Number of words that a reset leaves unchanged.
pub const RETAINED_WORDS: usize = 4;

/// A board: clock, line, camera, memory, watchdog.
pub trait Board {
    /// Returns the microseconds since the start. The time never goes back.
    fn now_us(&mut self) -> u64;
    /// Returns the time of the last pulse per second, µs since the start; `None` if there was none, or if there is no
    /// such line. Capture it with a timer: its error is an error of every time in telemetry.
    fn pulse_us(&mut self) -> Option<u64> {
        None
    }
    /// Returns the next byte that was received, if there is one.
    // One byte at a time, so that the inbox can stop after a packet: the other bytes wait in the serial port.
    fn receive(&mut self) -> Option<u8>;
    /// Sends bytes. Returns when the line has taken them.
    // The port must be done with the bytes when it returns, because their memory is used for the next packet.
    fn send(&mut self, bytes: &[u8]);
    /// Returns whether there is the lift-off signal: its plug is pulled out when the rocket leaves.
    fn lift_off(&mut self) -> bool;
    /// Returns whether there is a warning that power will be cut.
    fn power_fails(&mut self) -> bool;
    /// Returns whether the watchdog caused the last reset.
    fn was_watchdog_reset(&mut self) -> bool;
    /// Tells the watchdog that the program makes progress.
    // The loop calls it once a turn. A timer must not, because it would run on when the loop hangs.
    fn feed_watchdog(&mut self);
    /// Returns whether the camera answers.
    fn camera_answers(&mut self) -> bool;
    /// Returns the temperature of the camera, °C, for a lens that changes with it (`camera.temperature`); `None` if
    /// there is no thermometer, or if it does not answer. Asked once for each picture.
    fn camera_temperature_c(&mut self) -> Option<f32> {
        None
    }
    /// Takes the newest picture that was not taken yet, if there is one. The camera gets the buffer of the picture
    /// before.
    fn next_picture(&mut self) -> Option<Picture>;
    /// Shows the picture that was taken last: all of its pixels with [`Viewer::see`], or its rows with
    /// [`Viewer::rows`], as the camera sends them. Called at most once for a picture.
    // Not part of `next_picture`, because size and prior are checked before, and rows are refused before they come.
    fn show(&mut self, viewer: &mut Viewer<'_>);
    /// Returns whether the picture that was shown last is an earlier one to the last bit, or at least along the limb
    /// that was found in it: the camera stands still, or gives an old buffer again. The noise of a camera never
    /// repeats. Its answer is then judged as `gates.fixed_edge` says. A board that cannot tell returns false.
    fn repeats_picture(&mut self, _limb: Option<&Solution<f32>>) -> bool {
        false
    }
    /// Reads copy 1 or 2 of the parameters from memory.
    fn read_copy(&mut self, copy: u8, into: &mut [u8]);
    /// Writes copy 1 or 2 of the parameters. Returns false if the memory refuses.
    fn write_copy(&mut self, copy: u8, bytes: &[u8]) -> bool;
    /// Returns whether keys were ever put into the memory of this board. Telecommands then need a trailer
    /// ([`crate::authentication`]), and a key that is missing or damaged closes the line.
    // Asked apart from the keys, because a damaged memory must not look like a board that never had any.
    fn has_keys(&mut self) -> bool {
        false
    }
    /// Reads the key at this place, from 0 to [`crate::authentication::KEYS`] - 1.
    fn read_key(&mut self, _place: u8, _into: &mut [u8; crate::authentication::KEY_BYTES]) {}
    /// Reads the counter that was written last for the key at this place; `None` if it is missing or damaged. The tool
    /// that stores a key also stores the counter 0.
    fn read_counter(&mut self, _place: u8) -> Option<u64> {
        None
    }
    /// Writes the counter for the key at this place, so that it survives a reset and a power cut. Returns false if the
    /// memory refuses.
    fn write_counter(&mut self, _place: u8, _counter: u64) -> bool {
        false
    }
    /// Returns whether another computer on the line has this base, so that a telecommand must not set it. A board that
    /// cannot tell returns false; in a rig, the loop of the rig tells each head.
    fn is_base_taken(&mut self, _base: ApidBase) -> bool {
        false
    }
    /// Takes note of the parameters of the sensor that is in use from now on, for a log, for example: at the start,
    /// after a telecommand, and after the repair of a memory error.
    fn note_sensor(&mut self, _config: &Config) {}
    /// Returns the largest use of the stack since the start in bytes; 0 if unknown.
    fn stack_bytes(&mut self) -> u32;
    /// Returns the program in memory. Called once, at the start.
    fn image(&mut self) -> Image {
        Image::default()
    }
    /// Returns words that a reset leaves unchanged and power-on does not; any words if there is no such memory.
    // Any words will do, because they have a checksum, which random words and zeros do not have.
    fn read_retained(&mut self) -> [u32; RETAINED_WORDS] {
        [0; RETAINED_WORDS]
    }
    /// Keeps words for the time after a reset.
    fn write_retained(&mut self, _words: [u32; RETAINED_WORDS]) {}
    /// Keeps an answer. Its packets were sent just now, unless the bit budget had no room. Most boards keep nothing.
    /// Returns false if this answer, or one shortly before it, could not be kept.
    fn keep_answer(&mut self, _exposure: &Exposure, _report: &Report<f32>) -> bool {
        true
    }
}
