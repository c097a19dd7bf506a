//! The board: external memory and the timer.

use core::sync::atomic::{AtomicBool, Ordering};

/// External memory (PSRAM).
#[cfg(feature = "an500")]
const PSRAM: usize = 0x6000_0000;
#[cfg(not(feature = "an500"))]
const PSRAM: usize = 0x2100_0000;

/// Bytes of one frame buffer.
pub const FRAME_BYTES: usize = 4 << 20;
/// Frame buffers: a camera fills one while the other is processed.
pub const FRAMES: usize = 2;

/// Timer 0 (CMSDK APB timer), 25 MHz, counting down.
const TIMER: *mut u32 = 0x4000_0000 as *mut u32;

static TAKEN: AtomicBool = AtomicBool::new(false);

/// The board's parts. There is one board.
#[derive(Debug)]
pub struct Board {
    /// Frame buffers in external memory.
    pub frames: [&'static mut [u8]; FRAMES],
    /// The timer, running.
    pub timer: Timer,
}

impl Board {
    /// Takes the board; `None` the second time.
    pub fn take() -> Option<Self> {
        if TAKEN.swap(true, Ordering::Relaxed) {
            return None;
        }
        let frames = core::array::from_fn(|i| {
            // SAFETY: the board has 16 MiB of memory at PSRAM that no linker section uses, any bytes are valid u8, the
            // buffers do not overlap, and `TAKEN` makes sure that they are handed out once.
            unsafe { core::slice::from_raw_parts_mut((PSRAM + i * FRAME_BYTES) as *mut u8, FRAME_BYTES) }
        });
        Some(Self { frames, timer: Timer::start() })
    }
}

/// A timer that counts ticks of 40 ns and wraps at 32 bits.
#[derive(Debug, Clone, Copy)]
pub struct Timer(());

impl Timer {
    fn start() -> Self {
        // SAFETY: CTRL (0), VALUE (1) and RELOAD (2) of the timer, as in the CMSDK reference; nothing else owns it.
        unsafe {
            TIMER.add(2).write_volatile(u32::MAX);
            TIMER.add(1).write_volatile(u32::MAX);
            TIMER.write_volatile(1);
        }
        Self(())
    }

    /// Ticks since the start, modulo 2³².
    #[inline(always)]
    pub fn ticks(&self) -> u32 {
        // SAFETY: reads the timer's VALUE register.
        unsafe { !TIMER.add(1).read_volatile() }
    }
}
