//! The port of the flight software.

use hzn_flight::board::{BUILD, Board, Image, Picture, RETAINED_WORDS, image_crc};
use hzn_flight::view::Viewer;
use stm32h7xx_hal::prelude::*;

use crate::board::{self, Parts};
use crate::camera;

unsafe extern "C" {
    /// Begin of the image, and end of its constants; the initial values of variables follow.
    static __vector_table: u8;
    static __sidata: u8;
    static __sdata: u8;
    static __edata: u8;
    static mut _stack_end: u32;
    static mut _stack_start: u32;
}

/// The board for the flight software.
pub(crate) struct Stm32H743 {
    parts: Parts,
    is_watched: bool,
}

impl Stm32H743 {
    /// Takes the board. Returns `None` the second time.
    pub(crate) fn take() -> Option<Self> {
        Some(Self { parts: board::start()?, is_watched: false })
    }
}

impl Board for Stm32H743 {
    fn now_us(&mut self) -> u64 {
        self.parts.camera.now_us()
    }
    fn receive(&mut self) -> Option<u8> {
        self.parts.line.receive()
    }
    fn send(&mut self, bytes: &[u8]) {
        self.parts.line.send(bytes);
    }
    fn lift_off(&mut self) -> bool {
        self.parts.lift_off.is_high()
    }
    fn power_fails(&mut self) -> bool {
        self.parts.power_good.is_low()
    }
    fn was_watchdog_reset(&mut self) -> bool {
        self.parts.was_reset
    }
    fn feed_watchdog(&mut self) {
        if !self.is_watched {
            // The erasure of a sector takes up to 4 s.
            self.parts.watchdog.start(8000.millis());
            self.is_watched = true;
        }
        self.parts.watchdog.feed();
    }
    fn camera_answers(&mut self) -> bool {
        self.parts.camera.answers()
    }
    fn next_picture(&mut self) -> Option<Picture> {
        let exposure_us = self.parts.camera.take()?;
        Some(Picture { bytes: camera::BYTES, exposure_us, lost: 0 })
    }
    fn show(&mut self, viewer: &mut Viewer<'_>) {
        viewer.see(self.parts.camera.picture());
    }
    fn read_copy(&mut self, copy: u8, into: &mut [u8]) {
        self.parts.parameters.read_copy(copy, into);
    }
    fn write_copy(&mut self, copy: u8, bytes: &[u8]) -> bool {
        self.parts.parameters.write_copy(copy, bytes)
    }
    fn stack_bytes(&mut self) -> u32 {
        let (end, start) = (&raw mut _stack_end, &raw mut _stack_start);
        let mut at = end;
        // SAFETY: this reads words between the linker's symbols `_stack_end` and `_stack_start`, which is RAM.
        while at < start && unsafe { at.read_volatile() } == cortex_m_rt::STACK_PAINT_VALUE {
            at = at.wrapping_add(1);
        }
        (start as usize - at as usize) as u32
    }
    fn image(&mut self) -> Image {
        let (begin, constants_end) = (&raw const __vector_table, &raw const __sidata);
        let variables = (&raw const __edata as usize).saturating_sub(&raw const __sdata as usize);
        let length = (constants_end as usize).saturating_sub(begin as usize) + variables;
        // SAFETY: the linker places the image in flash without gaps that are not mapped, and nothing writes to it.
        let image = unsafe { core::slice::from_raw_parts(begin, length) };
        Image { build: BUILD, crc: image_crc(image) }
    }
    fn read_retained(&mut self) -> [u32; RETAINED_WORDS] {
        core::array::from_fn(|word| self.parts.backup.bkpr.get(word).map_or(0, |register| register.read().bits()))
    }
    fn write_retained(&mut self, words: [u32; RETAINED_WORDS]) {
        for (register, word) in self.parts.backup.bkpr.iter().zip(words) {
            register.write(|w| w.bkp().bits(word));
        }
    }
}
