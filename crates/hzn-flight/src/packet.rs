//! CCSDS space packets on a serial line.
//!
//! ```text
//! bytes  field (most significant byte first)
//!     4  sync marker 1A CF FC 1D (CCSDS 131.0-B), to find the next packet after noise
//!     6  primary header (CCSDS 133.0-B): version 0, type, secondary header flag 1, APID; unsegmented, sequence count;
//!        length of what follows minus one
//!     8  secondary header: time in microseconds since the start of the computer (telecommands: 0)
//!     n  user data
//!     2  CRC-16 (CCITT, start FFFF) from the primary header to the end of the user data
//! ```

use crate::bytes::{Reader, Writer};
use crate::numbered::numbered_enum;

/// The sync marker before every packet.
pub const SYNC: [u8; 4] = [0x1A, 0xCF, 0xFC, 0x1D];
/// Most bytes of a packet, including the sync marker.
pub const MAX_BYTES: usize = 1024;
const HEADER: usize = 6;
const TIME: usize = 8;
const CRC: usize = 2;

const CRC16: crc::Crc<u16, crc::NoTable> = crc::Crc::<u16, crc::NoTable>::new(&crc::CRC_16_IBM_3740);

numbered_enum! {
    /// The subject of a packet: its application process identifier (APID). The numbers are frozen.
    pub enum Apid: u16 {
        /// State of the computer.
        Housekeeping = 0x100 => "housekeeping",
        /// The answer to one picture.
        Science = 0x101 => "science",
        /// An event.
        Event = 0x102 => "event",
        /// The outcome of a telecommand.
        Acknowledge = 0x103 => "acknowledgement",
        /// Values of parameters.
        Parameters = 0x104 => "parameters",
        /// A part of an edge.
        Edge = 0x105 => "edge",
        /// A telecommand.
        Command = 0x1C0 => "telecommand",
    }
}

/// Writes a packet with `user` as its user data into `out`. Returns its length; `None` if it does not fit into `out` or
/// into [`MAX_BYTES`].
pub fn write(
    out: &mut [u8],
    apid: Apid,
    sequence: u16,
    time_us: u64,
    user: impl FnOnce(&mut Writer<'_>),
) -> Option<usize> {
    let mut body = Writer::new(out.get_mut(SYNC.len() + HEADER..)?);
    body.u64(time_us);
    user(&mut body);
    let len = body.finish()?;
    let command = u16::from(apid == Apid::Command);
    let mut head = Writer::new(out);
    head.bytes(&SYNC);
    head.u16(command << 12 | 1 << 11 | apid as u16);
    head.u16(0b11 << 14 | sequence & 0x3FFF);
    head.u16(u16::try_from(len + CRC - 1).ok()?);
    head.finish()?;
    let end = SYNC.len() + HEADER + len;
    let crc = CRC16.checksum(out.get(SYNC.len()..end)?);
    out.get_mut(end..end + CRC)?.copy_from_slice(&crc.to_be_bytes());
    (end + CRC <= MAX_BYTES).then_some(end + CRC)
}

/// A received packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Packet<'a> {
    /// Number of the APID.
    pub apid: u16,
    /// Sequence count of this APID, 0 to 16383.
    pub sequence: u16,
    /// Time in microseconds since the start of the computer.
    pub time_us: u64,
    /// User data.
    pub user: &'a [u8],
}

/// The result of a search for a packet in received bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scan<'a> {
    /// There is no complete packet. The first `skip` bytes belong to no packet; the bytes after them may become one.
    More {
        /// Number of bytes to leave out.
        skip: usize,
    },
    /// A packet was found.
    Packet {
        /// Number of bytes up to the end of the packet.
        end: usize,
        /// The packet.
        packet: Packet<'a>,
    },
    /// There is a sync marker, but its packet is broken or cut off. The search goes on after `skip` bytes.
    Bad {
        /// Number of bytes to leave out.
        skip: usize,
    },
}

/// Searches for the first packet in `bytes`.
pub fn scan(bytes: &[u8]) -> Scan<'_> {
    let Some(marker) = bytes.windows(SYNC.len()).position(|w| w == SYNC) else {
        // The last bytes may be the beginning of a marker.
        return Scan::More { skip: bytes.len().saturating_sub(SYNC.len() - 1) };
    };
    let begin = marker + SYNC.len();
    let bad = Scan::Bad { skip: begin };
    let mut from = Reader::new(bytes.get(begin..).unwrap_or_default());
    let (Some(id), Some(sequence), Some(len)) = (from.u16(), from.u16(), from.u16()) else {
        return Scan::More { skip: marker };
    };
    let len = usize::from(len) + 1;
    if id >> 13 != 0 || id & 1 << 11 == 0 || len < TIME + CRC || SYNC.len() + HEADER + len > MAX_BYTES {
        return bad;
    }
    let end = begin + HEADER + len;
    let Some(packet_bytes) = bytes.get(begin..end) else { return Scan::More { skip: marker } };
    let Some((checked, crc)) = packet_bytes.split_last_chunk::<CRC>() else { return bad };
    if CRC16.checksum(checked) != u16::from_be_bytes(*crc) {
        return bad;
    }
    let mut from = Reader::new(checked.get(HEADER..).unwrap_or_default());
    let Some(time_us) = from.u64() else { return bad };
    let packet = Packet { apid: id & 0x7FF, sequence: sequence & 0x3FFF, time_us, user: from.rest() };
    Scan::Packet { end, packet }
}

/// Collects bytes as they come in.
#[derive(Debug)]
pub struct Inbox {
    bytes: [u8; MAX_BYTES],
    len: usize,
}

impl Default for Inbox {
    fn default() -> Self {
        Self::new()
    }
}

impl Inbox {
    /// Makes an empty inbox.
    pub const fn new() -> Self {
        Self { bytes: [0; MAX_BYTES], len: 0 }
    }
    /// Adds a byte. Returns false if there is no room; [`Self::next`] makes room.
    pub fn push(&mut self, byte: u8) -> bool {
        match self.bytes.get_mut(self.len) {
            Some(place) => {
                *place = byte;
                self.len += 1;
                true
            }
            None => false,
        }
    }
    /// Returns whether there are bytes that are not a packet yet.
    pub fn is_waiting(&self) -> bool {
        self.len > 0
    }
    /// Passes the next packet to `handle`, or `None` for a broken packet. Returns the result of `handle`; `None` if
    /// there is no packet yet.
    pub fn next<R>(&mut self, handle: impl FnOnce(Option<Packet<'_>>) -> R) -> Option<R> {
        let (used, result) = match scan(self.bytes.get(..self.len).unwrap_or_default()) {
            // A full inbox without a packet cannot become one.
            Scan::More { skip } => (if self.len == MAX_BYTES { skip.max(1) } else { skip }, None),
            Scan::Packet { end, packet } => (end, Some(handle(Some(packet)))),
            Scan::Bad { skip } => (skip, Some(handle(None))),
        };
        self.remove(used);
        result
    }
    /// Gives up the packet that has begun. The bytes after its sync marker may contain another packet.
    pub fn give_up(&mut self) {
        self.remove(SYNC.len());
    }
    fn remove(&mut self, count: usize) {
        let count = count.min(self.len);
        if let Some(bytes) = self.bytes.get_mut(..self.len)
            && count <= bytes.len()
        {
            bytes.rotate_left(count);
        }
        self.len -= count;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    fn sample(apid: Apid, data: &[u8]) -> Vec<u8> {
        let mut out = [0; MAX_BYTES];
        let n = write(&mut out, apid, 77, 123_456_789_012, |w| w.bytes(data)).unwrap();
        out[..n].to_vec()
    }

    #[test]
    fn the_bytes_are_those_of_the_standard() {
        let bytes = sample(Apid::Command, &[1, 2, 3]);
        assert_eq!(bytes[..10], [0x1A, 0xCF, 0xFC, 0x1D, 0x19, 0xC0, 0xC0, 77, 0, 12]);
        assert_eq!(bytes[10..18], 123_456_789_012u64.to_be_bytes());
        assert_eq!(bytes[18..21], [1, 2, 3]);
        // The check value of CRC-16/CCITT-FALSE.
        assert_eq!(CRC16.checksum(b"123456789"), 0x29B1);
        let bytes = sample(Apid::Science, &[]);
        assert_eq!(bytes[4..6], [0x09, 0x01]);
    }

    #[test]
    fn another_implementation_reads_the_header() {
        use spacepackets::{CcsdsPacket, PacketType, SpHeader};
        let bytes = sample(Apid::Event, &[9; 20]);
        let (header, _) = SpHeader::from_be_bytes(&bytes[SYNC.len()..]).unwrap();
        assert_eq!((header.apid().value(), header.seq_count().value()), (0x102, 77));
        assert_eq!((header.packet_type(), header.sec_header_flag()), (PacketType::Tm, true));
        assert_eq!(header.packet_len(), bytes.len() - SYNC.len());
    }

    #[test]
    fn a_stream_is_read_whatever_stands_between() {
        let (a, b) = (sample(Apid::Science, &[1; 40]), sample(Apid::Event, &[2; 5]));
        let mut stream = b"noise\x1A\xCF".to_vec();
        stream.extend(&a);
        stream.extend(&SYNC);
        stream.extend(&a[..20]);
        stream.extend(&b);
        stream.extend([0x1A; 7]);
        stream.extend(&b);
        let mut inbox = Inbox::new();
        let (mut good, mut bad) = (Vec::new(), 0);
        for byte in stream {
            assert!(inbox.push(byte));
            while let Some(apid) = inbox.next(|p| p.map(|p| (p.apid, p.user.len()))) {
                match apid {
                    Some(found) => good.push(found),
                    None => bad += 1,
                }
            }
        }
        // The packet that was cut off includes the start of the next packet, which is found nevertheless.
        assert_eq!(good, [(0x101, 40), (0x102, 5), (0x102, 5)]);
        assert!(bad >= 1, "{bad}");
    }

    #[test]
    fn a_packet_that_does_not_fit_is_not_written() {
        let mut out = [0; 40];
        assert_eq!(write(&mut out, Apid::Event, 0, 0, |w| w.bytes(&[0; 30])), None);
        let mut out = [0; 2000];
        assert_eq!(write(&mut out, Apid::Event, 0, 0, |w| w.bytes(&[0; 1500])), None);
    }

    proptest! {
        #[test]
        fn any_bytes_are_survived(
            bytes in proptest::collection::vec(
                prop_oneof![Just(0x1Au8), Just(0xCF), Just(0xFC), Just(0x1D), any::<u8>()],
                0..3000,
            ),
        ) {
            let mut inbox = Inbox::new();
            for byte in bytes {
                prop_assert!(inbox.push(byte));
                while inbox.next(|_| ()).is_some() {}
                // A full inbox is emptied.
                prop_assert!(inbox.len < MAX_BYTES);
            }
        }
    }
}
