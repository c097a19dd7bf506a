//! CCSDS space packets on a serial line.
//!
//! ```text
//! bytes  field (most significant byte first)
//!     4  sync marker 1A CF FC 1D (CCSDS 131.0-B), to find the next packet after noise
//!     6  primary header (CCSDS 133.0-B): version 0, type, secondary header flag 1, APID; unsegmented, sequence count;
//!        length of what follows minus one
//!     8  secondary header: time, CUC of CCSDS 301.0-B with its P-field (telecommands: 0)
//!     n  user data
//!     2  CRC-16 (CCITT, start FFFF) from the primary header to the end of the user data
//! ```

use core::fmt;
use core::str::FromStr;

use crate::bytes::{Reader, Writer};
use crate::cuc::Cuc;
use crate::numbered::numbered_enum;

/// The sync marker before every packet.
// A space packet has no marker of its own, so a receiver would otherwise have to try every byte.
pub const SYNC: [u8; 4] = [0x1A, 0xCF, 0xFC, 0x1D];
/// Most bytes of a packet, including the sync marker.
// The length field allows 64 KiB. With this limit a damaged length asks for at most 89 ms of a line with 115 200 baud.
pub const MAX_BYTES: usize = 1024;
/// Number of bytes of a packet without its user data: marker, both headers, checksum.
pub const OVERHEAD: usize = SYNC.len() + HEADER + TIME + CRC;
pub(crate) const HEADER: usize = 6;
const TIME: usize = Cuc::BYTES;
const CRC: usize = 2;

/// The sequence flags of a packet that is not a segment of a larger one.
const UNSEGMENTED: u16 = 0b11;
/// The table makes a byte cost eight instructions; without it a byte costs about fifty.
// Polynomial and start are those of ECSS-E-ST-70-41C, so that ground systems know them.
const CRC16: crc::Crc<u16> = crc::Crc::<u16>::new(&crc::CRC_16_IBM_3740);

numbered_enum! {
    /// The subject of a packet: its application process identifier (APID). The numbers are frozen. They are those of
    /// the base 0x100; see [`ApidBase`].
    pub enum Apid: u16 {
        /// State of the computer.
        Housekeeping = 0x100 => "housekeeping",
        /// The answer to one picture.
        Science = 0x101 => "science",
        /// An event.
        Event = 0x102 => "event",
        /// The outcome of a telecommand.
        Acknowledge = 0x103 => "acknowledgement",
        /// Value of a parameter.
        Parameters = 0x104 => "parameters",
        /// A part of an edge.
        Edge = 0x105 => "edge",
        /// A candidate of a picture.
        Candidate = 0x106 => "candidate",
        /// Free fit and position of a picture.
        Position = 0x107 => "position",
        /// The values from navigation that a picture was processed with.
        Navigation = 0x108 => "navigation",
        /// The attitude and the Sun that a picture was processed with.
        Attitude = 0x109 => "attitude",
        /// The joint answer of the heads of a rig.
        Rig = 0x10A => "rig",
        /// How far the answer to a picture can be trusted.
        Integrity = 0x10B => "integrity",
        /// A telecommand.
        Command = 0x1C0 => "telecommand",
    }
}

/// The APID of housekeeping. The other APIDs have fixed distances from it, so that several computers can share a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ApidBase(u16);

impl Default for ApidBase {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl ApidBase {
    /// The base of a computer whose parameters do not name another.
    pub const DEFAULT: Self = Self(Apid::Housekeeping as u16);
    /// Distance between two bases: a computer has at most 16 subjects.
    pub const STEP: u16 = 16;
    /// Smallest base: the APID 0 belongs to the time packets of the space link (CCSDS 301.0-B).
    pub const MIN: u16 = 0x10;
    /// Largest base: the APIDs of telecommands must be below 0x7FF, which marks idle packets.
    pub const MAX: u16 = 0x700;

    /// Makes a base; `None` if the number is not within [`Self::MIN`] and [`Self::MAX`], or not a multiple of
    /// [`Self::STEP`].
    pub const fn try_new(number: u16) -> Option<Self> {
        let is_base = number >= Self::MIN && number <= Self::MAX && number.is_multiple_of(Self::STEP);
        if is_base { Some(Self(number)) } else { None }
    }
    /// Returns the number of the base, which is the APID of housekeeping.
    pub const fn number(self) -> u16 {
        self.0
    }
    /// Returns the number of an APID.
    pub const fn apid(self, apid: Apid) -> u16 {
        self.0 + (apid as u16 - Self::DEFAULT.0)
    }
    /// Returns the subject of a packet; `None` if the packet belongs to something else on the line.
    pub fn subject(self, packet: &Packet<'_>) -> Option<Apid> {
        let apid = Apid::ALL.iter().copied().find(|&a| self.apid(a) == packet.apid)?;
        // The type counts, because a telecommand of one base has the APID of housekeeping of the base 0xC0 above it. A
        // segment is refused, because a part of a telecommand would be carried out as a whole one.
        (packet.is_command == (apid == Apid::Command) && packet.is_whole).then_some(apid)
    }
}

/// The text is no base.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoBase;

impl fmt::Display for NoBase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (min, max, step) = (ApidBase::MIN, ApidBase::MAX, ApidBase::STEP);
        write!(f, "it must be a multiple of {step} from {min:#x} to {max:#x}")
    }
}

impl core::error::Error for NoBase {}

impl FromStr for ApidBase {
    type Err = NoBase;

    /// Reads a decimal number, or a hexadecimal one such as `0x110`.
    fn from_str(text: &str) -> Result<Self, NoBase> {
        let number = match text.strip_prefix("0x") {
            Some(digits) => u16::from_str_radix(digits, 16).ok(),
            None => text.parse().ok(),
        };
        number.and_then(Self::try_new).ok_or(NoBase)
    }
}

/// Writes a packet with `user` as its user data into `out`; a telecommand has no time. Returns its length; `None` if it
/// does not fit into `out` or into [`MAX_BYTES`].
pub fn write(
    out: &mut [u8],
    base: ApidBase,
    apid: Apid,
    sequence: u16,
    time: Option<Cuc>,
    user: impl FnOnce(&mut Writer<'_>),
) -> Option<usize> {
    // The user data are written before the header, because it has their length.
    let mut body = Writer::new(out.get_mut(SYNC.len() + HEADER..)?);
    // A telecommand has zeros in place of a time, so that both types have headers of one length.
    body.bytes(&time.map_or([0; TIME], Cuc::to_bytes));
    user(&mut body);
    let len = body.finish()?;
    let header = primary_header(base, apid, sequence, len.checked_sub(TIME)?)?;
    let mut head = Writer::new(out);
    head.bytes(&SYNC);
    head.bytes(&header);
    head.finish()?;
    let end = SYNC.len() + HEADER + len;
    let crc = CRC16.checksum(out.get(SYNC.len()..end)?);
    out.get_mut(end..end + CRC)?.copy_from_slice(&crc.to_be_bytes());
    // A longer packet is not sent, because `length` would refuse it at the receiver.
    (end + CRC <= MAX_BYTES).then_some(end + CRC)
}

/// Returns the primary header of a packet with so many bytes of user data; `None` if they do not fit into its length.
pub(crate) fn primary_header(base: ApidBase, apid: Apid, sequence: u16, user_bytes: usize) -> Option<[u8; HEADER]> {
    let mut header = [0; HEADER];
    let command = u16::from(apid == Apid::Command);
    let mut out = Writer::new(&mut header);
    out.u16(command << 12 | 1 << 11 | base.apid(apid));
    out.u16(UNSEGMENTED << 14 | sequence & 0x3FFF);
    // CCSDS 133.0-B counts from 0, because no packet is without data: 0 means one byte.
    out.u16(u16::try_from(TIME + user_bytes + CRC - 1).ok()?);
    out.finish()?;
    Some(header)
}

/// A received packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Packet<'a> {
    /// Number of the APID.
    pub apid: u16,
    /// Whether the type of the packet is telecommand.
    pub is_command: bool,
    /// Whether the packet is whole: false for a segment of a larger one.
    pub is_whole: bool,
    /// Sequence count of this APID, 0 to 16383.
    pub sequence: u16,
    /// Time of the packet; `None` if the secondary header is no such time.
    pub time: Option<Cuc>,
    /// User data.
    pub user: &'a [u8],
}

/// Returns the length of the packet that begins with this marker and this header, including the marker; `None` if no
/// packet has such a header.
pub(crate) fn length(header: &[u8; SYNC.len() + HEADER]) -> Option<usize> {
    let [.., i0, i1, _, _, n0, n1] = *header;
    let id = u16::from_be_bytes([i0, i1]);
    let following = usize::from(u16::from_be_bytes([n0, n1])) + 1;
    let whole = SYNC.len() + HEADER + following;
    // These bits are the same in all packets of hzn. A header without them is damaged, and would otherwise hold the
    // line until its length has come.
    let is_possible = id >> 13 == 0 && id & 1 << 11 != 0 && following >= TIME + CRC && whole <= MAX_BYTES;
    is_possible.then_some(whole)
}

/// Reads a packet from its marker to its checksum; `None` if the checksum is wrong.
pub(crate) fn read(bytes: &[u8]) -> Option<Packet<'_>> {
    is_whole(bytes).then(|| parse(bytes))?
}

/// Returns whether the checksum of a packet of a possible [`length`] is right. It reads no field, because the inbox
/// reads the fields later, once.
pub(crate) fn is_whole(bytes: &[u8]) -> bool {
    let parts = bytes.get(SYNC.len()..).and_then(<[u8]>::split_last_chunk::<CRC>);
    parts.is_some_and(|(checked, crc)| CRC16.checksum(checked) == u16::from_be_bytes(*crc))
}

/// Reads the fields of a packet whose checksum is known to be right.
pub(crate) fn parse(bytes: &[u8]) -> Option<Packet<'_>> {
    // The checksum was computed before, once, because the inbox looks at a packet again for every byte after it.
    let (checked, _) = bytes.get(SYNC.len()..)?.split_last_chunk::<CRC>()?;
    let mut from = Reader::new(checked);
    let (id, sequence, _, time) = (from.u16()?, from.u16()?, from.u16()?, from.u64()?);
    Some(Packet {
        apid: id & 0x7FF,
        is_command: id & 1 << 12 != 0,
        is_whole: sequence >> 14 == UNSEGMENTED,
        sequence: sequence & 0x3FFF,
        time: Cuc::from_bytes(time.to_be_bytes()),
        user: from.rest(),
    })
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

/// Searches for the first packet in `bytes`, as a receiver on the ground does. A flight computer is stricter: see
/// [`crate::inbox`].
///
/// ```
/// use hzn_flight::packet::{Apid, ApidBase, MAX_BYTES, Scan, scan, write};
///
/// let mut line = [0u8; MAX_BYTES];
/// let length = write(&mut line, ApidBase::DEFAULT, Apid::Command, 7, None, |out| out.bytes(&[1, 2, 3]));
/// let Scan::Packet { end, packet } = scan(&line) else { panic!("the packet is whole") };
/// assert_eq!((Some(end), packet.user), (length, [1, 2, 3].as_slice()));
/// ```
pub fn scan(bytes: &[u8]) -> Scan<'_> {
    let Some(marker) = bytes.windows(SYNC.len()).position(|w| w == SYNC) else {
        // The last bytes may be the beginning of a marker.
        return Scan::More { skip: bytes.len().saturating_sub(SYNC.len() - 1) };
    };
    // Only the marker is left out, because a damaged length may reach over the next packet.
    let bad = Scan::Bad { skip: marker + SYNC.len() };
    let from = bytes.get(marker..).unwrap_or_default();
    let Some(header) = from.first_chunk() else { return Scan::More { skip: marker } };
    let Some(length) = length(header) else { return bad };
    let Some(packet) = from.get(..length) else { return Scan::More { skip: marker } };
    match read(packet) {
        Some(packet) => Scan::Packet { end: marker + length, packet },
        None => bad,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn sample(apid: Apid, data: &[u8]) -> Vec<u8> {
        let mut out = [0; MAX_BYTES];
        let n =
            write(&mut out, ApidBase::DEFAULT, apid, 77, Some(Cuc::since_start(123_456_789_012)), |w| w.bytes(data))
                .unwrap();
        out[..n].to_vec()
    }

    #[test]
    fn the_bytes_are_those_of_the_standard() {
        let bytes = sample(Apid::Command, &[1, 2, 3]);
        assert_eq!(bytes[..10], [0x1A, 0xCF, 0xFC, 0x1D, 0x19, 0xC0, 0xC0, 77, 0, 12]);
        assert_eq!(bytes[10..18], Cuc::since_start(123_456_789_012).to_bytes());
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
        let (mut rest, mut good, mut bad) = (&stream[..], Vec::new(), 0);
        loop {
            match scan(rest) {
                Scan::More { .. } => break,
                Scan::Packet { end, packet } => {
                    good.push((packet.apid, packet.user.len()));
                    rest = &rest[end..];
                }
                Scan::Bad { skip } => {
                    bad += 1;
                    rest = &rest[skip..];
                }
            }
        }
        // The packet that was cut off includes the start of the next packet, which is found nevertheless.
        assert_eq!(good, [(0x101, 40), (0x102, 5), (0x102, 5)]);
        assert!(bad >= 1, "{bad}");
    }

    #[test]
    fn a_base_gives_every_subject_its_number() {
        assert_eq!([0x10F, 0x701, 0x710].map(ApidBase::try_new), [None; 3]);
        let base = ApidBase::try_new(0x230).unwrap();
        assert_eq!((base.apid(Apid::Event), base.apid(Apid::Command)), (0x232, 0x2F0));
        let mut out = [0; MAX_BYTES];
        let n = write(&mut out, base, Apid::Event, 0, None, |_| ()).unwrap();
        let Scan::Packet { packet, .. } = scan(&out[..n]) else { panic!() };
        assert_eq!((base.subject(&packet), ApidBase::DEFAULT.subject(&packet)), (Some(Apid::Event), None));
        // A telemetry packet with the APID of telecommands is no telecommand, and a segment is no packet.
        let command = Packet { apid: 0x2F0, is_command: true, is_whole: true, sequence: 0, time: None, user: &[] };
        assert_eq!(base.subject(&command), Some(Apid::Command));
        assert_eq!(base.subject(&Packet { is_command: false, ..command }), None);
        assert_eq!(base.subject(&Packet { is_whole: false, ..command }), None);
    }

    #[test]
    fn a_packet_that_does_not_fit_is_not_written() {
        let mut out = [0; 40];
        assert_eq!(write(&mut out, ApidBase::DEFAULT, Apid::Event, 0, None, |w| w.bytes(&[0; 30])), None);
        let mut out = [0; 2000];
        assert_eq!(write(&mut out, ApidBase::DEFAULT, Apid::Event, 0, None, |w| w.bytes(&[0; 1500])), None);
    }
}
