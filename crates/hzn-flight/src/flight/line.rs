//! The line for telemetry, whose memory also holds a telecommand while it is carried out.

use super::clock::Clock;
use crate::board::Board;
use crate::bytes::Writer;
use crate::cuc::Cuc;
use crate::packet::{self, Apid, ApidBase, MAX_BYTES};

/// The line for telemetry, with a sequence count for each APID.
#[derive(Debug)]
pub(super) struct Line {
    /// Memory for the packet that is sent.
    pub(super) out: [u8; MAX_BYTES],
    // CCSDS 133.0-B counts each APID by itself, so that a receiver of one of them notices a lost packet.
    sequences: [u16; Apid::ALL.len()],
    /// The APIDs of this computer; `None` until the parameters are loaded.
    // `None` instead of the default, whose number is not 0: the buffers would no longer be all zeros.
    base: Option<ApidBase>,
    pub(super) clock: Clock,
}

impl Line {
    /// Makes a line. It is all zeros, so that it takes no flash.
    pub(super) const fn new() -> Self {
        Self { out: [0; MAX_BYTES], sequences: [0; Apid::ALL.len()], base: None, clock: Clock::new() }
    }

    pub(super) fn base(&self) -> ApidBase {
        self.base.unwrap_or_default()
    }
    pub(super) fn set_base(&mut self, base: ApidBase) {
        self.base = Some(base);
    }

    /// Sends a packet with a time. `user` writes its user data.
    pub(super) fn send<B: Board>(&mut self, board: &mut B, apid: Apid, time: Cuc, user: impl FnOnce(&mut Writer<'_>)) {
        let place = Apid::ALL.iter().zip(&mut self.sequences).find(|(a, _)| **a == apid);
        let sequence = place.map_or(0, |(_, n)| {
            let now = *n;
            *n = n.wrapping_add(1);
            now
        });
        let base = self.base();
        if let Some(bytes) =
            packet::write(&mut self.out, base, apid, sequence, Some(time), user).and_then(|n| self.out.get(..n))
        {
            board.send(bytes);
        }
    }
}
