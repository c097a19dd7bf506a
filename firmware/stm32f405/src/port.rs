//! The port of the flight software. Camera and flash are files of the emulator's host; a port for a real board replaces
//! them.

use hzn_firmware::camera::{Camera, Header};
use hzn_firmware::flash::Flash;
use hzn_firmware::{image, watermark};
use hzn_flight::board::{BUILD, Board, Image, Picture, RETAINED_WORDS, image_crc};
use hzn_flight::view::{ROWS_HELD, RowMemory, Viewer};

use crate::board::{self, Timer, Uart, Watchdog};

/// Size of the camera's pictures in pixels.
pub const WIDTH: usize = 640;
const HEIGHT: usize = 480;
/// The memory for the rows of a picture.
pub type Rows = RowMemory<{ ROWS_HELD as usize * WIDTH }, HEIGHT, 8192, 2560>;

/// The board for the flight software.
#[derive(Debug)]
pub struct Stm32F405 {
    timer: Timer,
    uart: Uart,
    watchdog: Watchdog,
    camera: Camera,
    flash: Flash,
    rows: &'static mut Rows,
    row: &'static mut [u8; WIDTH],
    /// Bytes of the picture that the camera is about to send.
    picture_bytes: usize,
    us: u32,
    wraps: u64,
}

impl Stm32F405 {
    /// Takes the board. Returns `None` the second time.
    pub fn take(rows: &'static mut Rows, row: &'static mut [u8; WIDTH]) -> Option<Self> {
        let board = board::Board::take()?;
        Some(Self {
            timer: board.timer,
            uart: board.uart,
            watchdog: board.watchdog,
            camera: Camera::open(),
            flash: Flash::open(),
            rows,
            row,
            picture_bytes: 0,
            us: 0,
            wraps: 0,
        })
    }
    /// Leaves out the rest of the picture.
    fn skip(&mut self) {
        while self.picture_bytes > 0 {
            let part = self.row.len().min(self.picture_bytes);
            let read = self.row.get_mut(..part).is_some_and(|row| self.camera.read(row));
            self.picture_bytes = if read { self.picture_bytes - part } else { 0 };
        }
    }
}

impl Board for Stm32F405 {
    fn now_us(&mut self) -> u64 {
        // The timer wraps after 71 minutes; the loop reads it far more often.
        let us = self.timer.us();
        self.wraps += u64::from(us < self.us);
        self.us = us;
        self.wraps << 32 | u64::from(us)
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
        // This board has no lift-off line: flight begins by command.
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
        // A picture that was refused before it was shown is still in the camera.
        self.skip();
        let Header { bytes, lost } = self.camera.next_header()?;
        self.picture_bytes = bytes;
        Some(Picture { bytes, exposure_us: self.now_us(), lost })
    }
    fn show(&mut self, viewer: &mut Viewer<'_>) {
        let Some(mut view) = viewer.rows(self.rows) else { return };
        while self.picture_bytes >= WIDTH && self.camera.read(self.row) {
            self.picture_bytes -= WIDTH;
            view.push(self.row);
        }
        view.finish();
    }
    fn read_copy(&mut self, copy: u8, into: &mut [u8]) {
        self.flash.read_copy(copy, into);
    }
    fn write_copy(&mut self, copy: u8, bytes: &[u8]) -> bool {
        self.flash.write_copy(copy, bytes)
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
