//! The port of the flight software: the only file, besides `board`, that a new board rewrites.

use hzn_firmware::camera::{Camera, Header};
use hzn_firmware::flash::Flash;
use hzn_firmware::{image, watermark};
use hzn_flight::board::{BUILD, Board, Image, Picture, RETAINED_WORDS, image_crc};
use hzn_flight::view::Viewer;

use crate::board::{self, FRAME_BYTES, Timer, Uart, Watchdog};

/// Ticks of the timer per microsecond.
const TICKS_PER_US: u64 = 25;

/// The board for the flight software.
#[derive(Debug)]
pub struct Mps2 {
    timer: Timer,
    uart: Uart,
    watchdog: Watchdog,
    camera: Camera,
    flash: Flash,
    frames: [&'static mut [u8]; board::FRAMES],
    /// Index of the buffer that is processed. The camera has the other one.
    current: usize,
    current_bytes: usize,
    ticks: u32,
    wraps: u64,
}

impl Mps2 {
    /// Takes the board. Returns `None` the second time.
    pub fn take() -> Option<Self> {
        let board = board::Board::take()?;
        Some(Self {
            timer: board.timer,
            uart: board.uart,
            watchdog: board.watchdog,
            camera: Camera::open(),
            flash: Flash::open(),
            frames: board.frames,
            current: 0,
            current_bytes: 0,
            ticks: 0,
            wraps: 0,
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
        self.camera.answers()
    }
    fn next_picture(&mut self) -> Option<Picture> {
        let Header { bytes, lost } = self.camera.next_header().filter(|header| header.bytes <= FRAME_BYTES)?;
        // The camera fills the buffer that is not processed; then both buffers change roles.
        let next = (self.current + 1) % board::FRAMES;
        if !self.camera.read(self.frames.get_mut(next)?.get_mut(..bytes)?) {
            return None;
        }
        (self.current, self.current_bytes) = (next, bytes);
        Some(Picture { bytes, exposure_us: self.now_us(), lost })
    }
    fn show(&mut self, viewer: &mut Viewer<'_>) {
        viewer.see(self.frames.get(self.current).and_then(|f| f.get(..self.current_bytes)).unwrap_or_default());
    }
    fn read_copy(&mut self, copy: u8, into: &mut [u8]) {
        self.flash.read_copy(copy, into);
    }
    fn write_copy(&mut self, copy: u8, bytes: &[u8]) -> bool {
        self.flash.write_copy(copy, bytes)
    }
    #[cfg(feature = "keys")]
    fn has_keys(&mut self) -> bool {
        true
    }
    #[cfg(feature = "keys")]
    fn read_key(&mut self, place: u8, into: &mut [u8; hzn_flight::authentication::KEY_BYTES]) {
        hzn_firmware::keys::read(place, into);
    }
    #[cfg(feature = "keys")]
    fn read_counter(&mut self, place: u8) -> Option<u64> {
        hzn_firmware::keys::read_counter(place)
    }
    #[cfg(feature = "keys")]
    fn write_counter(&mut self, place: u8, counter: u64) -> bool {
        hzn_firmware::keys::write_counter(place, counter)
    }
    fn stack_bytes(&mut self) -> u32 {
        watermark::stack_bytes()
    }
    fn image(&mut self) -> Image {
        Image { build: BUILD, crc: image_crc(image::bytes()) }
    }
    fn read_retained(&mut self) -> [u32; RETAINED_WORDS] {
        board::read_retained()
    }
    fn write_retained(&mut self, words: [u32; RETAINED_WORDS]) {
        board::write_retained(words);
    }
}
