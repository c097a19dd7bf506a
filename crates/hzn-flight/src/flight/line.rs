//! The line for telemetry.

use crate::board::Board;
use crate::bytes::Writer;
use crate::packet::{self, Apid, MAX_BYTES};

/// The line for telemetry, with a sequence count for each APID.
#[derive(Debug)]
pub(super) struct Line {
    /// Memory for the packet that is sent.
    pub(super) out: [u8; MAX_BYTES],
    sequences: [u16; Apid::ALL.len()],
}

impl Line {
    pub(super) const fn new() -> Self {
        Self { out: [0; MAX_BYTES], sequences: [0; Apid::ALL.len()] }
    }

    /// Sends a packet. `user` writes its user data.
    pub(super) fn send<B: Board>(&mut self, board: &mut B, apid: Apid, user: impl FnOnce(&mut Writer<'_>)) {
        let place = Apid::ALL.iter().zip(&mut self.sequences).find(|(a, _)| **a == apid);
        let sequence = place.map_or(0, |(_, n)| {
            let now = *n;
            *n = n.wrapping_add(1);
            now
        });
        let time_us = board.now_us();
        if let Some(bytes) = packet::write(&mut self.out, apid, sequence, time_us, user).and_then(|n| self.out.get(..n))
        {
            board.send(bytes);
        }
    }
}
