//! The port of the flight software: the only file, besides `board`, that a new board rewrites.

use hzn_flight::board::{Board, Image, Picture, RETAINED_WORDS, image_crc};

use crate::board::{self, FRAME_BYTES, Timer, Uart, Watchdog};
use crate::host::{File, exit};
use crate::watermark;

/// Ticks of the timer per microsecond.
const TICKS_PER_US: u64 = 25;

/// Number of the build, from the variable `HZN_BUILD` of the environment; 0 without it.
const BUILD: u32 = match option_env!("HZN_BUILD") {
    Some(digits) => match u32::from_str_radix(digits, 10) {
        Ok(build) => build,
        Err(_) => panic!("HZN_BUILD must be a whole number"),
    },
    None => 0,
};

/// The board for the flight software.
#[derive(Debug)]
pub struct Mps2 {
    timer: Timer,
    uart: Uart,
    watchdog: Watchdog,
    camera: Option<File>,
    frames: [&'static mut [u8]; board::FRAMES],
    /// Index of the buffer that is processed. The camera has the other one.
    current: usize,
    current_bytes: usize,
    ticks: u32,
    wraps: u64,
    /// Bytes that can still be written to flash before power is cut.
    power: Option<u32>,
}

impl Mps2 {
    /// Takes the board. Returns `None` the second time.
    pub fn take() -> Option<Self> {
        let board = board::Board::take()?;
        let mut word = [0; 4];
        let cut = File::open(c"cut.bin").is_some_and(|mut file| file.read(&mut word));
        Some(Self {
            timer: board.timer,
            uart: board.uart,
            watchdog: board.watchdog,
            camera: File::open(c"frames.bin"),
            frames: board.frames,
            current: 0,
            current_bytes: 0,
            ticks: 0,
            wraps: 0,
            power: cut.then(|| u32::from_le_bytes(word)),
        })
    }
}

impl Board for Mps2 {
    fn now_us(&mut self) -> u64 {
        // The timer wraps after 171 s; the loop reads it far more often.
        let now = self.timer.ticks();
        self.wraps += u64::from(now < self.ticks);
        self.ticks = now;
        (self.wraps << 32 | u64::from(now)) / TICKS_PER_US
    }
    fn receive(&mut self) -> Option<u8> {
        self.uart.receive()
    }
    fn send(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.uart.send(byte);
        }
    }
    fn lift_off(&mut self) -> bool {
        // These boards have no lift-off line: flight begins by command.
        false
    }
    fn power_fails(&mut self) -> bool {
        false
    }
    fn was_watchdog_reset(&mut self) -> bool {
        self.watchdog.was_reset()
    }
    fn feed_watchdog(&mut self) {
        self.watchdog.feed();
    }
    fn camera_answers(&mut self) -> bool {
        self.camera.is_some()
    }
    fn next_picture(&mut self) -> Option<Picture> {
        let camera = self.camera.as_mut()?;
        let mut header = [0; 16];
        if !camera.read(&mut header) {
            return None;
        }
        let word = |i: usize| header.get(4 * i..).and_then(|h| h.first_chunk()).map_or(0, |w| u32::from_le_bytes(*w));
        let (magic, bytes, lost) = (word(0), word(1) as usize, word(2));
        if magic == u32::from_le_bytes(*b"HANG") {
            // This wait never ends: only the watchdog can end it.
            loop {
                core::hint::spin_loop();
            }
        }
        if magic != u32::from_le_bytes(*b"FRAM") || bytes > FRAME_BYTES {
            return None;
        }
        // The camera fills the buffer that is not processed; then both buffers change roles.
        let next = (self.current + 1) % board::FRAMES;
        if !camera.read(self.frames.get_mut(next)?.get_mut(..bytes)?) {
            return None;
        }
        (self.current, self.current_bytes) = (next, bytes);
        Some(Picture { bytes, exposure_us: self.now_us(), lost })
    }
    fn pixels(&self) -> &[u8] {
        self.frames.get(self.current).and_then(|f| f.get(..self.current_bytes)).unwrap_or_default()
    }
    fn read_copy(&mut self, copy: u8, into: &mut [u8]) {
        // Erased flash reads as 0xFF.
        into.fill(0xFF);
        if let Some(mut file) = File::open(if copy == 1 { c"copy1.bin" } else { c"copy2.bin" }) {
            // A file that is shorter than the buffer fills only its beginning.
            let _ = file.read(into);
        }
    }
    fn write_copy(&mut self, copy: u8, bytes: &[u8]) -> bool {
        let Some(mut file) = File::create(if copy == 1 { c"copy1.bin" } else { c"copy2.bin" }) else { return false };
        // A flash is written in small pieces, and power can be cut between any two of them.
        for chunk in bytes.chunks(8) {
            if let Some(left) = &mut self.power {
                match left.checked_sub(chunk.len() as u32) {
                    Some(rest) => *left = rest,
                    None => exit(99),
                }
            }
            if !file.write(chunk) {
                return false;
            }
        }
        true
    }
    fn stack_bytes(&mut self) -> u32 {
        watermark::stack_bytes()
    }
    fn image(&mut self) -> Image {
        Image { build: BUILD, crc: image_crc(board::image()) }
    }
    fn read_retained(&mut self) -> [u32; RETAINED_WORDS] {
        board::read_retained()
    }
    fn write_retained(&mut self, words: [u32; RETAINED_WORDS]) {
        board::write_retained(words);
    }
}
