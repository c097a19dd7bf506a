//! The board: external memory, timer, serial line and watchdog.

use core::sync::atomic::{AtomicBool, Ordering};

/// External memory (PSRAM).
#[cfg(feature = "an500")]
const PSRAM: usize = 0x6000_0000;
#[cfg(not(feature = "an500"))]
const PSRAM: usize = 0x2100_0000;

/// Size of one frame buffer in bytes.
pub const FRAME_BYTES: usize = 4 << 20;
/// Number of frame buffers: a camera fills one while the other is processed.
pub const FRAMES: usize = 2;

/// Timer 0 (CMSDK APB timer), which counts down at 25 MHz.
const TIMER: *mut u32 = 0x4000_0000 as *mut u32;

/// UART 0 (CMSDK APB UART): DATA (0), STATE (1), CTRL (2), BAUDDIV (4).
const UART: *mut u32 = 0x4000_4000 as *mut u32;

/// The watchdog (CMSDK APB watchdog), 25 MHz: LOAD (0), CONTROL (2), INTCLR (3), LOCK (0x300).
const WATCHDOG: *mut u32 = 0x4000_8000 as *mut u32;
/// One second. After one second without feeding the watchdog raises its interrupt, after another it resets the board.
const WATCHDOG_TICKS: u32 = 25_000_000;

static TAKEN: AtomicBool = AtomicBool::new(false);

/// The parts of the board, which exist only once.
#[derive(Debug)]
pub struct Board {
    /// Frame buffers in external memory.
    pub frames: [&'static mut [u8]; FRAMES],
    /// The timer, which runs.
    pub timer: Timer,
    /// The serial line.
    pub uart: Uart,
    /// The watchdog, which does not run yet.
    pub watchdog: Watchdog,
}

impl Board {
    /// Takes the board. Returns `None` the second time.
    pub fn take() -> Option<Self> {
        // A Cortex-M0+ can load and store a flag, but cannot exchange it.
        let taken = cortex_m::interrupt::free(|_| {
            let taken = TAKEN.load(Ordering::Relaxed);
            TAKEN.store(true, Ordering::Relaxed);
            taken
        });
        if taken {
            return None;
        }
        let frames = core::array::from_fn(|i| {
            // SAFETY: the board has 16 MiB of memory at PSRAM that no linker section uses. All bytes are valid u8, the
            // buffers do not overlap, and `TAKEN` ensures that they are handed out only once.
            unsafe { core::slice::from_raw_parts_mut((PSRAM + i * FRAME_BYTES) as *mut u8, FRAME_BYTES) }
        });
        Some(Self { frames, timer: Timer::start(), uart: Uart::start(), watchdog: Watchdog::new() })
    }
}

/// A timer that counts ticks of 40 ns and wraps at 32 bits.
#[derive(Debug, Clone, Copy)]
pub struct Timer(());

impl Timer {
    fn start() -> Self {
        // SAFETY: these are CTRL (0), VALUE (1) and RELOAD (2) of the timer, as in the CMSDK reference. Nothing else
        // uses them.
        unsafe {
            TIMER.add(2).write_volatile(u32::MAX);
            TIMER.add(1).write_volatile(u32::MAX);
            TIMER.write_volatile(1);
        }
        Self(())
    }

    /// Returns the ticks since the start, modulo 2³².
    #[inline(always)]
    pub fn ticks(&self) -> u32 {
        // SAFETY: this reads the timer's VALUE register.
        unsafe { !TIMER.add(1).read_volatile() }
    }
}

/// A serial line.
#[derive(Debug)]
pub struct Uart(());

impl Uart {
    fn start() -> Self {
        // SAFETY: this sets the divider (the smallest that is allowed) and enables both directions. Nothing else uses
        // the UART.
        unsafe {
            UART.add(4).write_volatile(16);
            UART.add(2).write_volatile(0b11);
        }
        Self(())
    }

    /// Returns a byte that has arrived, if there is one.
    pub fn receive(&mut self) -> Option<u8> {
        // SAFETY: bit 1 of STATE says that DATA has a byte; reading DATA removes it.
        unsafe { (UART.add(1).read_volatile() & 0b10 != 0).then(|| UART.read_volatile() as u8) }
    }

    /// Sends a byte. Waits until there is room.
    pub fn send(&mut self, byte: u8) {
        // SAFETY: bit 0 of STATE says that there is no room. DATA takes the byte.
        unsafe {
            while UART.add(1).read_volatile() & 0b01 != 0 {}
            UART.write_volatile(u32::from(byte));
        }
    }
}

/// The watchdog. It runs from the first call of `feed` on.
#[derive(Debug)]
pub struct Watchdog {
    running: bool,
    was_reset: bool,
}

/// Backup memory, which a reset leaves unchanged and power-on does not. It is at the end of the board's RAM, behind the
/// RAM of `memory.x`. It is in no section of the image: the emulator clears all sections at a reset.
const BACKUP: *mut u32 = 0x203F_FF00 as *mut u32;
/// Words of the backup memory for the flight software; the word after them shows that the program was running.
const RETAINED_WORDS: usize = 4;
const WAS_RUNNING: u32 = 0x5AFE_C0DE;

/// Reads a word of the backup memory.
fn read_backup(word: usize) -> u32 {
    // SAFETY: the board has RAM at BACKUP, and only `read_backup` and `write_backup` use it. Every word is a valid u32.
    unsafe { BACKUP.add(word).read_volatile() }
}
/// Writes a word of the backup memory.
fn write_backup(word: usize, value: u32) {
    // SAFETY: as in `read_backup`.
    unsafe { BACKUP.add(word).write_volatile(value) };
}

/// Returns the words that a reset leaves unchanged.
pub fn read_retained() -> [u32; RETAINED_WORDS] {
    core::array::from_fn(read_backup)
}
/// Keeps words for the time after a reset.
pub fn write_retained(words: [u32; RETAINED_WORDS]) {
    for (place, word) in words.into_iter().enumerate() {
        write_backup(place, word);
    }
}

impl Watchdog {
    fn new() -> Self {
        let was_reset = read_backup(RETAINED_WORDS) == WAS_RUNNING;
        write_backup(RETAINED_WORDS, WAS_RUNNING);
        Self { running: false, was_reset }
    }

    /// Starts the watchdog, or restarts its time.
    pub fn feed(&mut self) {
        // SAFETY: LOCK takes the key that allows writing. LOAD and CONTROL start the watchdog (interrupt and reset on).
        // INTCLR restarts its time. Nothing else uses the watchdog.
        unsafe {
            WATCHDOG.add(0x300).write_volatile(0x1ACC_E551);
            if !self.running {
                WATCHDOG.write_volatile(WATCHDOG_TICKS);
                WATCHDOG.add(2).write_volatile(0b11);
                self.running = true;
            }
            WATCHDOG.add(3).write_volatile(1);
        }
    }

    /// Returns whether the watchdog caused the last reset. These boards cannot report this, but nothing else on them
    /// resets a program while the power stays on.
    pub fn was_reset(&self) -> bool {
        self.was_reset
    }
}
