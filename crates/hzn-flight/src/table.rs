//! The parameters as bytes for permanent memory: header, one entry per parameter, checksum.
//!
//! ```text
//! offset  bytes  field (little-endian)
//!      0      4  "HZNP"
//!      4      2  version of this layout, 1
//!      6      2  entries n
//!      8      4  generation: the larger of two copies is the newer
//!     12   10 n  entries: number (2), value (8, IEEE 754 double)
//! 12+10n      4  CRC-32 (ISO-HDLC, as in zlib) of everything before
//! ```
//!
//! A parameter without an entry has its default.

use crate::Parameters;
use crate::parameters::Refused;

const MAGIC: [u8; 4] = *b"HZNP";
const VERSION: u16 = 1;
const HEADER: usize = 12;
// Each value has its number, so that a table of an earlier version, without the newer parameters, can still be read.
const ENTRY: usize = 10;

/// CRC-32 as in zlib. Its table, 1 KB, makes the check of the program image at the start five times faster.
pub(crate) const CRC32: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

/// Most bytes of a table.
// The largest table fits, one with eight polygons of 16 corners, so that storing never fails for want of room.
pub const MAX_BYTES: usize = 4096;

/// Why bytes are not a valid table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TableError {
    /// The bytes are not a table, are cut off, or have another version.
    Header,
    /// The checksum is wrong.
    Checksum,
    /// An entry, or the combination of all, was refused.
    Refused(Refused),
}

impl core::fmt::Display for TableError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Header => f.write_str("not a parameter table of this version, or the table is cut off"),
            Self::Checksum => f.write_str("the checksum of the parameter table is wrong"),
            Self::Refused(e) => e.fmt(f),
        }
    }
}
impl core::error::Error for TableError {}

/// Writes a table into `out` and returns its length; `None` if there is no room.
pub fn write(parameters: &Parameters, generation: u32, out: &mut [u8]) -> Option<usize> {
    let mut end = HEADER;
    let mut count = 0u16;
    for id in parameters.numbers() {
        let value = parameters.get(id)?;
        let entry = out.get_mut(end..end + ENTRY)?;
        entry.get_mut(..2)?.copy_from_slice(&id.to_le_bytes());
        entry.get_mut(2..)?.copy_from_slice(&value.to_le_bytes());
        end += ENTRY;
        count += 1;
    }
    // The header comes last, because only now the number of entries is known.
    out.get_mut(..4)?.copy_from_slice(&MAGIC);
    out.get_mut(4..6)?.copy_from_slice(&VERSION.to_le_bytes());
    out.get_mut(6..8)?.copy_from_slice(&count.to_le_bytes());
    out.get_mut(8..12)?.copy_from_slice(&generation.to_le_bytes());
    let crc = CRC32.checksum(out.get(..end)?);
    out.get_mut(end..end + 4)?.copy_from_slice(&crc.to_le_bytes());
    Some(end + 4)
}

/// Reads the table at the start of `bytes` and ignores the bytes after it. Returns the checked parameters and the
/// generation.
///
/// # Errors
/// The bytes are not a complete table, or its parameters are refused.
pub fn read(bytes: &[u8]) -> Result<(Parameters, u32), TableError> {
    let (entries, generation) = split(bytes)?;
    // A table is taken as a whole or not at all, because its values were checked in combination.
    let mut parameters = Parameters::defaults();
    for entry in entries.chunks_exact(ENTRY) {
        if let (Some(id), Some(value)) = (entry.first_chunk(), entry.last_chunk()) {
            parameters.set(u16::from_le_bytes(*id), f64::from_le_bytes(*value)).map_err(TableError::Refused)?;
        }
    }
    // They are checked here, so that parameters that were loaded always make a sensor: the start relies on it.
    parameters.check().map_err(TableError::Refused)?;
    Ok((parameters, generation))
}

/// Returns a checksum of all parameters, which differs if one of them does.
pub(crate) fn digest(parameters: &Parameters) -> u32 {
    let mut digest = CRC32.digest();
    for id in parameters.numbers() {
        digest.update(&id.to_le_bytes());
        digest.update(&parameters.get(id).unwrap_or(f64::NAN).to_le_bytes());
    }
    digest.finalize()
}

/// Returns the generation of the table at the start of `bytes`; `None` if it is not complete or its checksum is wrong.
pub fn generation(bytes: &[u8]) -> Option<u32> {
    split(bytes).ok().map(|(_, generation)| generation)
}

/// Returns the entries and the generation of a table with the right checksum.
fn split(bytes: &[u8]) -> Result<(&[u8], u32), TableError> {
    let header: &[u8; HEADER] = bytes.first_chunk().ok_or(TableError::Header)?;
    let [m0, m1, m2, m3, v0, v1, n0, n1, g0, g1, g2, g3] = *header;
    // Another error than a wrong checksum, because erased memory is no damage: event 2 tells them apart.
    if [m0, m1, m2, m3] != MAGIC || u16::from_le_bytes([v0, v1]) != VERSION {
        return Err(TableError::Header);
    }
    let end = HEADER + ENTRY * usize::from(u16::from_le_bytes([n0, n1]));
    let body = bytes.get(..end).ok_or(TableError::Header)?;
    let crc = bytes.get(end..).and_then(|rest| rest.first_chunk()).ok_or(TableError::Header)?;
    if CRC32.checksum(body) != u32::from_le_bytes(*crc) {
        return Err(TableError::Checksum);
    }
    let entries = body.get(HEADER..).ok_or(TableError::Header)?;
    Ok((entries, u32::from_le_bytes([g0, g1, g2, g3])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn sample() -> ([u8; MAX_BYTES], usize) {
        let mut p = Parameters::defaults();
        p.set(4, 777.25).unwrap();
        let mut bytes = [0; MAX_BYTES];
        let n = write(&p, 41, &mut bytes).unwrap();
        (bytes, n)
    }

    #[test]
    fn round_trip() {
        let (bytes, n) = sample();
        let (p, generation) = read(&bytes).unwrap();
        assert_eq!((p.get(4), generation), (Some(777.25), 41));
        assert_eq!(read(&bytes[..n]).unwrap().0, p);
        let mut small = [0; 64];
        assert_eq!(write(&p, 1, &mut small), None);
    }

    #[test]
    fn the_largest_table_fits() {
        let mut p = Parameters::defaults();
        for _ in 0..8 {
            let polygon = (0..16).map(|i| [f64::from(i), f64::from(i * i)]).collect();
            p.sensor.mask.polygons_px.push(polygon).unwrap();
        }
        let mut bytes = [0; MAX_BYTES];
        assert!(write(&p, 1, &mut bytes).is_some());
        assert_eq!(read(&bytes).unwrap().0, p);
    }

    #[test]
    fn every_flipped_bit_and_every_cut_is_seen() {
        let (mut bytes, n) = sample();
        // Each flip is a checksum of the whole table, which is long in Miri.
        let (bits, cuts) = if cfg!(miri) { (1009, 101) } else { (1, 1) };
        for bit in (0..n * 8).step_by(bits) {
            bytes[bit / 8] ^= 1 << (bit % 8);
            assert!(generation(&bytes).is_none(), "bit {bit}");
            bytes[bit / 8] ^= 1 << (bit % 8);
        }
        for cut in (0..n).step_by(cuts) {
            assert!(read(&bytes[..cut]).is_err());
        }
    }

    proptest! {
        #[test]
        fn garbage_is_refused(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
            prop_assert!(read(&bytes).is_err());
        }
    }
}
