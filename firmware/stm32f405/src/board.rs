//! The registers: timer, serial line, watchdog. Names and addresses are those of the reference manual RM0090.
//!
//! The processor keeps its clock after a reset, the internal one of 16 MHz. A port for a real board starts a faster
//! one.

use core::sync::atomic::{AtomicBool, Ordering};

/// Reset and clock control: AHB1ENR (0x30), APB1ENR (0x40), APB2ENR (0x44), CSR (0x74).
const RCC: usize = 0x4002_3800;
/// Port A: MODER (0x00), AFRH (0x24). USART1 has the pins 9 and 10.
const GPIOA: usize = 0x4002_0000;
/// USART1: SR (0x00), DR (0x04), BRR (0x08), CR1 (0x0C).
const USART1: usize = 0x4001_1000;
/// Timer 2, which has 32 bits: CR1 (0x00), EGR (0x14), CNT (0x24), PSC (0x28), ARR (0x2C).
const TIM2: usize = 0x4000_0000;
/// The independent watchdog: KR (0x00), PR (0x04), RLR (0x08).
const IWDG: usize = 0x4000_3000;

/// Clock of the timer in MHz. QEMU counts with 1 GHz, whatever the clock of the processor is; the part has 16 MHz.
const TIMER_MHZ: u32 = 1000;
/// 115 200 baud at 16 MHz.
const BAUD_DIVIDER: u32 = 139;

/// Words that a reset leaves unchanged: at the end of the SRAM, behind the RAM of `memory.x`.
const BACKUP: usize = 0x2001_FF00;
/// Number of these words.
const RETAINED_WORDS: usize = 4;

static TAKEN: AtomicBool = AtomicBool::new(false);

fn read(address: usize) -> u32 {
    // SAFETY: every address in this file is that of a register or of a word of RAM that nothing else uses. Reading has
    // no effect but that of the data register of the USART, which has only one owner.
    unsafe { (address as *const u32).read_volatile() }
}
fn write(address: usize, value: u32) {
    // SAFETY: as in `read`. No register in this file makes the processor or a DMA write to memory.
    unsafe { (address as *mut u32).write_volatile(value) };
}
fn set_bits(address: usize, bits: u32) {
    write(address, read(address) | bits);
}

/// The parts of the board, which exist only once.
#[derive(Debug)]
pub struct Board {
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
        if TAKEN.swap(true, Ordering::Relaxed) {
            return None;
        }
        set_bits(RCC + 0x30, 1); // GPIOAEN
        set_bits(RCC + 0x40, 1); // TIM2EN
        set_bits(RCC + 0x44, 1 << 4); // USART1EN
        Some(Self { timer: Timer::start(), uart: Uart::start(), watchdog: Watchdog::new() })
    }
}

/// A timer that counts microseconds and wraps at 32 bits.
#[derive(Debug)]
pub struct Timer(());

impl Timer {
    fn start() -> Self {
        write(TIM2 + 0x28, TIMER_MHZ - 1);
        write(TIM2 + 0x2C, u32::MAX);
        write(TIM2 + 0x14, 1); // UG takes over the prescaler
        write(TIM2, 1); // CEN
        Self(())
    }
    /// Returns the microseconds since the start, modulo 2³².
    pub fn us(&self) -> u32 {
        read(TIM2 + 0x24)
    }
}

/// A serial line.
#[derive(Debug)]
pub struct Uart(());

impl Uart {
    fn start() -> Self {
        // Pins 9 and 10: alternate function 7.
        write(GPIOA, read(GPIOA) & !(0b1111 << 18) | 0b1010 << 18);
        write(GPIOA + 0x24, read(GPIOA + 0x24) & !0xFF0 | 0x770);
        write(USART1 + 0x08, BAUD_DIVIDER);
        write(USART1 + 0x0C, 1 << 13 | 1 << 3 | 1 << 2); // UE, TE, RE
        Self(())
    }
    /// Returns a byte that has arrived, if there is one.
    pub fn receive(&mut self) -> Option<u8> {
        (read(USART1) & 1 << 5 != 0).then(|| read(USART1 + 0x04) as u8)
    }
    /// Sends a byte. Waits until there is room.
    pub fn send(&mut self, byte: u8) {
        while read(USART1) & 1 << 7 == 0 {}
        write(USART1 + 0x04, byte.into());
    }
}

/// The watchdog. It runs from the first call of `feed` on. QEMU does not emulate it.
#[derive(Debug)]
pub struct Watchdog {
    is_running: bool,
    was_reset: bool,
}

impl Watchdog {
    fn new() -> Self {
        let was_reset = read(RCC + 0x74) & 1 << 29 != 0; // IWDGRSTF
        set_bits(RCC + 0x74, 1 << 24); // RMVF
        Self { is_running: false, was_reset }
    }
    /// Starts the watchdog with 4 s, or restarts its time.
    pub fn feed(&mut self) {
        if !self.is_running {
            write(IWDG, 0x5555);
            write(IWDG + 0x04, 3); // 32 kHz / 32
            write(IWDG + 0x08, 4000 - 1);
            write(IWDG, 0xCCCC);
            self.is_running = true;
        }
        write(IWDG, 0xAAAA);
    }
    /// Returns whether the watchdog caused the last reset.
    pub fn was_reset(&self) -> bool {
        self.was_reset
    }
}

/// Returns the words that a reset leaves unchanged.
pub fn read_retained() -> [u32; RETAINED_WORDS] {
    core::array::from_fn(|word| read(BACKUP + 4 * word))
}
/// Keeps words for the time after a reset.
pub fn write_retained(words: [u32; RETAINED_WORDS]) {
    for (place, word) in words.into_iter().enumerate() {
        write(BACKUP + 4 * place, word);
    }
}
