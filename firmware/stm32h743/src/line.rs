//! The serial line: USART3, with a buffer for what arrives while a picture is processed.

use core::cell::RefCell;

use critical_section::Mutex;
use heapless::Deque;
use stm32h7xx_hal::pac::{USART3, interrupt};
use stm32h7xx_hal::prelude::*;
use stm32h7xx_hal::serial::{Rx, Serial, Tx};

/// What the interrupt and the program share: the receiver, and the bytes that arrived. At 115 200 baud the buffer takes
/// 178 ms; further bytes are lost, and the packet that they belong to is broken.
struct Receiver {
    from: Option<Rx<USART3>>,
    bytes: Deque<u8, 2048>,
}

static RECEIVER: Mutex<RefCell<Receiver>> = Mutex::new(RefCell::new(Receiver { from: None, bytes: Deque::new() }));

/// The serial line.
pub(crate) struct Line {
    to: Tx<USART3>,
}

impl Line {
    pub(crate) fn start(serial: Serial<USART3>) -> Self {
        let (to, mut from) = serial.split();
        from.listen();
        critical_section::with(|cs| RECEIVER.borrow_ref_mut(cs).from = Some(from));
        Self { to }
    }

    pub(crate) fn receive(&mut self) -> Option<u8> {
        critical_section::with(|cs| RECEIVER.borrow_ref_mut(cs).bytes.pop_front())
    }

    pub(crate) fn send(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            // Writing never fails; it waits for room.
            let _ = nb::block!(self.to.write(byte));
        }
    }
}

#[interrupt]
fn USART3() {
    critical_section::with(|cs| {
        let Receiver { from: Some(from), bytes } = &mut *RECEIVER.borrow_ref_mut(cs) else { return };
        // An error of the line, such as an overrun, is cleared by the read; the packet's checksum tells.
        while let Ok(byte) = from.read() {
            let _ = bytes.push_back(byte);
        }
    });
}
