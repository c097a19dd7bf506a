//! The two copies of the parameters: the first two sectors of the second bank of the flash.

use core::arch::asm;

use cortex_m::peripheral::SCB;
use embedded_storage::nor_flash::NorFlash;
use stm32h7xx_hal::flash::{FlashExt, LockedFlashBank};
use stm32h7xx_hal::pac::FLASH;

/// Bytes of a sector.
const SECTOR: u32 = 128 << 10;
/// Bit of the register CCR: a handler of the priority −1 ignores bus faults.
const IGNORE_BUS_FAULTS: u32 = 1 << 8;

/// The memory of the parameters.
pub(crate) struct Parameters(LockedFlashBank);

impl Parameters {
    /// Returns `None` if the part has only one bank.
    pub(crate) fn new(flash: FLASH) -> Option<Self> {
        flash.split().1.map(Self)
    }

    /// Reads copy 1 or 2.
    pub(crate) fn read_copy(&mut self, copy: u8, into: &mut [u8]) {
        let from = self.0.read_all().get(start(copy) as usize..).unwrap_or_default();
        // If power was cut while a word of the flash was written, reading it is a bus fault. It must be ignored here:
        // the word that is read instead breaks the checksum, and the other copy is used.
        ignoring_bus_faults(|| {
            for (to, from) in into.iter_mut().zip(from) {
                // SAFETY: a reference is readable. The read must not be left out or moved.
                *to = unsafe { core::ptr::from_ref(from).read_volatile() };
            }
        });
    }

    /// Writes copy 1 or 2. Returns false if the flash refuses.
    pub(crate) fn write_copy(&mut self, copy: u8, bytes: &[u8]) -> bool {
        let (start, mut flash) = (start(copy), self.0.unlocked());
        flash.erase(start, start + SECTOR).is_ok() && flash.write(start, bytes).is_ok()
    }
}

fn start(copy: u8) -> u32 {
    if copy == 1 { 0 } else { SECTOR }
}

fn ignoring_bus_faults(read: impl FnOnce()) {
    // SAFETY: the register CCR belongs to this function. FAULTMASK raises the priority to −1, at which the processor
    // ignores bus faults of data; no interrupt runs meanwhile. Both are undone.
    unsafe {
        let ccr = &(*SCB::PTR).ccr;
        ccr.modify(|bits| bits | IGNORE_BUS_FAULTS);
        asm!("cpsid f", "dsb", "isb");
        read();
        asm!("dsb", "cpsie f");
        ccr.modify(|bits| bits & !IGNORE_BUS_FAULTS);
    }
}
