//! A camera at the DCMI, whose pictures a DMA writes to memory.
//!
//! The memory has room for one picture: the next one is captured when the last one has been processed. Pictures that
//! the camera sends meanwhile are left out, and are not counted as lost.

use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicU32, Ordering, fence};

use stm32h7xx_hal::pac::{self, DCMI, DMA1, DMAMUX1, TIM2, interrupt};
use stm32h7xx_hal::timer::Timer;

/// Size of a picture in pixels.
const WIDTH: usize = 640;
const HEIGHT: usize = 480;
/// Bytes of a picture.
pub(crate) const BYTES: usize = WIDTH * HEIGHT;
/// Exposure time of the camera, µs. The exposure ends when the picture begins on its lines.
const EXPOSURE_US: u64 = 1000;
/// The DMA counts at most 65535 words, so the two halves of the picture are its two buffers.
const HALF_WORDS: u32 = (BYTES / 8) as u32;

// Bits of the DCMI: control register, and frame and start of a frame in the interrupt registers.
const CAPTURE: u32 = 1;
const SNAPSHOT: u32 = 1 << 1;
const ENABLE: u32 = 1 << 14;
const FRAME: u32 = 1;
const OVERRUN: u32 = 1 << 1;
const VSYNC: u32 = 1 << 3;
/// Request of the DCMI at the multiplexer of the DMA.
const DCMI_REQUEST: u8 = 75;
/// Stream 0: to memory, words on both sides, the memory address grows, two buffers, highest priority.
const STREAM: u32 = 0b10 << 11 | 0b10 << 13 | 1 << 10 | 1 << 18 | 0b11 << 16;
/// All flags of stream 0.
const STREAM_FLAGS: u32 = 0b11_1101;

/// The memory of the picture, which the start-up code does not clear.
#[unsafe(link_section = ".axisram")]
static mut PICTURE: MaybeUninit<[u8; BYTES]> = MaybeUninit::uninit();

/// Time of the last start of a picture, in ticks of the timer.
static STARTED: AtomicU32 = AtomicU32::new(0);

/// The camera.
pub(crate) struct Camera {
    dcmi: DCMI,
    dma: DMA1,
    timer: Timer<TIM2>,
    ticks: u32,
    wraps: u64,
    picture: &'static mut [u8; BYTES],
    is_capturing: bool,
}

impl Camera {
    pub(crate) fn start(dcmi: DCMI, dma: DMA1, multiplexer: &DMAMUX1, timer: Timer<TIM2>) -> Self {
        // SAFETY: there is only one DCMI, so this runs only once and nothing else has a reference. Zeros are a picture.
        // They are written in place, because the stack has no room for them.
        let picture = unsafe {
            let place = &raw mut PICTURE;
            place.write_bytes(0, 1);
            (*place).assume_init_mut()
        };
        // SAFETY: 75 is a request of this multiplexer.
        multiplexer.ccr[0].modify(|_, w| unsafe { w.dmareq_id().bits(DCMI_REQUEST) });
        // SAFETY: eight data lines, and the edges of most cameras: rising pixel clock, both syncs active low.
        dcmi.cr.write(|w| unsafe { w.bits(SNAPSHOT | ENABLE | 1 << 5) });
        // SAFETY: this asks for the interrupt at the start of a picture only.
        dcmi.ier.write(|w| unsafe { w.bits(VSYNC) });
        Self { dcmi, dma, timer, ticks: 0, wraps: 0, picture, is_capturing: false }
    }

    /// Returns the time since the start in µs.
    pub(crate) fn now_us(&mut self) -> u64 {
        // The timer wraps after 71 minutes; the loop reads it far more often.
        let now = self.timer.counter();
        self.wraps += u64::from(now < self.ticks);
        self.ticks = now;
        self.wraps << 32 | u64::from(now)
    }

    /// Returns whether there is a camera: its lines move, so that pictures start.
    pub(crate) fn answers(&self) -> bool {
        // A picture starts within a second: ten times 40 million cycles of the processor.
        (0..10).any(|_| {
            cortex_m::asm::delay(40_000_000);
            STARTED.load(Ordering::Relaxed) != 0
        })
    }

    /// Returns the time of the middle of the exposure when a picture is complete. Starts to capture the next one if
    /// none is on its way.
    pub(crate) fn take(&mut self) -> Option<u64> {
        if !self.is_capturing {
            self.capture();
            return None;
        }
        let flags = self.dcmi.ris.read().bits();
        if flags & FRAME == 0 {
            return None;
        }
        self.is_capturing = false;
        if flags & OVERRUN != 0 {
            // The DMA was too slow: the picture has gaps.
            return None;
        }
        fence(Ordering::Acquire);
        let now = self.now_us();
        let since = (now as u32).wrapping_sub(STARTED.load(Ordering::Relaxed));
        Some(now.saturating_sub(since.into()).saturating_sub(EXPOSURE_US / 2))
    }

    /// Returns the picture that was taken last.
    pub(crate) fn picture(&self) -> &[u8] {
        // While a picture is captured, the DMA writes to this memory.
        if self.is_capturing { &[] } else { self.picture }
    }

    fn capture(&mut self) {
        let stream = &self.dma.st[0];
        stream.cr.modify(|_, w| w.en().clear_bit());
        while stream.cr.read().en().bit_is_set() {}
        let start = self.picture.as_mut_ptr() as u32;
        // SAFETY: the stream writes the words of one picture from `start` on, which is memory of this camera. Nothing
        // reads it before the picture is complete, and the capture ends by itself after one picture.
        unsafe {
            self.dma.lifcr.write(|w| w.bits(STREAM_FLAGS));
            stream.par.write(|w| w.bits(self.dcmi.dr.as_ptr() as u32));
            stream.m0ar.write(|w| w.bits(start));
            stream.m1ar.write(|w| w.bits(start + 4 * HALF_WORDS));
            stream.ndtr.write(|w| w.bits(HALF_WORDS));
            stream.fcr.write(|w| w.bits(0b111)); // through the FIFO
            stream.cr.write(|w| w.bits(STREAM | 1));
            self.dcmi.icr.write(|w| w.bits(FRAME | OVERRUN));
            self.dcmi.cr.modify(|r, w| w.bits(r.bits() | CAPTURE));
        }
        self.is_capturing = true;
    }
}

#[interrupt]
fn DCMI() {
    // SAFETY: this clears a flag that only this handler uses, and reads the counter of a timer that always runs.
    unsafe {
        (*pac::DCMI::ptr()).icr.write(|w| w.bits(VSYNC));
        STARTED.store((*pac::TIM2::ptr()).cnt.read().bits(), Ordering::Relaxed);
    }
}
