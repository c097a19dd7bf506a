//! The authentication of telecommands: a trailer at the end of the user data, which only the owner of a secret can
//! make.
//!
//! ```text
//! bytes  field (most significant byte first)
//!     n  user data of the telecommand
//!     1  number of the key
//!     8  counter: each telecommand has a larger one than the last that was taken with this key
//!    16  code: the first 16 bytes of HMAC-SHA-256 (RFC 2104, FIPS 180-4) over
//!        number of the spacecraft (4), direction (1, to space: 1), primary header (6), user data (n), key (1),
//!        counter (8)
//! ```
//!
//! The trailer keeps out strangers, changed telecommands and replays. It hides nothing, it does not protect telemetry,
//! and it does not replace the protection of the link (SDLS, CCSDS 355.0-B).
//!
//! A computer with keys takes `ping` and `report` without a trailer, because they change nothing. All other
//! telecommands need one. If no key can be read, or the counter of a key cannot be read or written, telecommands with
//! this key are refused: a damaged memory closes the line and never opens it.
//!
//! The keys are not parameters, so no telecommand reads or writes them. The board's own tool puts them into memory.

use hmac::digest::KeyInit;
use hmac::{Hmac, Mac};
use sha2::Sha256;

use crate::bytes::{Reader, Writer};
use crate::packet::{self, Apid, ApidBase};
use crate::table::CRC32;

/// Number of keys that a computer can have at a time: one in use, and the next one.
pub const KEYS: usize = 2;
/// Bytes of a trailer.
pub const TRAILER_BYTES: usize = 1 + 8 + CODE_BYTES;
/// Bytes of a stored key.
pub const KEY_BYTES: usize = 48;
/// Number of counters that are reserved in memory at once, so that a flash is written once for as many telecommands.
/// After a reset, counters up to the end of the reserved ones are refused.
pub const RESERVED: u64 = 256;

const CODE_BYTES: usize = 16;
const SECRET_BYTES: usize = 32;
const MARK: [u8; 4] = *b"HZNK";
const TO_SPACE: u8 = 1;

/// A key: the secret of an operator and a spacecraft.
///
/// ```
/// use hzn_flight::authentication::{Key, TRAILER_BYTES};
/// use hzn_flight::packet::ApidBase;
///
/// let key = Key { spacecraft: 7, number: 1, secret: [0x5A; 32] };
/// let mut ping = [0; 1 + TRAILER_BYTES];
/// ping[0] = 11;
/// assert_eq!(key.seal(ApidBase::DEFAULT, 3, 1, 1, &mut ping), Some(26));
/// assert!(key.is_right(ApidBase::DEFAULT, 3, &ping));
/// // Another sequence count is another telecommand.
/// assert!(!key.is_right(ApidBase::DEFAULT, 4, &ping));
/// ```
#[derive(Clone, PartialEq, Eq)]
pub struct Key {
    /// Number of the spacecraft, so that a telecommand to one is refused by another with the same secret.
    pub spacecraft: u32,
    /// Number of the key.
    pub number: u8,
    /// The secret: 32 random bytes.
    pub secret: [u8; SECRET_BYTES],
}

impl core::fmt::Debug for Key {
    /// Leaves out the secret, because debug texts end up in logs.
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "Key {{ spacecraft: {}, number: {} }}", self.spacecraft, self.number)
    }
}

impl Key {
    /// Returns the key as it is stored: `HZNK`, spacecraft, number, three zeros, secret, CRC-32 of all before.
    pub fn to_bytes(&self) -> [u8; KEY_BYTES] {
        let mut bytes = [0; KEY_BYTES];
        let mut out = Writer::new(&mut bytes);
        out.bytes(&MARK);
        out.bytes(&self.spacecraft.to_be_bytes());
        out.u8(self.number);
        out.bytes(&[0; 3]);
        out.bytes(&self.secret);
        if let Some((checked, crc)) = bytes.split_last_chunk_mut::<4>() {
            *crc = CRC32.checksum(checked).to_be_bytes();
        }
        bytes
    }

    /// Reads a stored key; `None` if it is damaged or if there is none.
    pub fn from_bytes(bytes: &[u8; KEY_BYTES]) -> Option<Self> {
        let (checked, crc) = bytes.split_last_chunk::<4>()?;
        let mut from = Reader::new(checked.strip_prefix(&MARK)?);
        if CRC32.checksum(checked) != u32::from_be_bytes(*crc) {
            return None;
        }
        let (spacecraft, number) = (from.u32()?, from.u8()?);
        let secret = from.rest().strip_prefix(&[0; 3])?;
        Some(Self { spacecraft, number, secret: secret.try_into().ok()? })
    }

    /// Writes a trailer behind the first `bytes` of `user`. Returns the number of bytes with it; `None` if `user` is
    /// too short, or if the telecommand does not fit into a packet.
    pub fn seal(&self, base: ApidBase, sequence: u16, counter: u64, bytes: usize, user: &mut [u8]) -> Option<usize> {
        let mut out = Writer::new(user.get_mut(bytes..bytes + 9)?);
        out.u8(self.number);
        out.bytes(&counter.to_be_bytes());
        out.finish()?;
        let code = self.code(base, sequence, user.get(..bytes + 9)?)?.finalize().into_bytes();
        let end = bytes + TRAILER_BYTES;
        user.get_mut(bytes + 9..end)?.copy_from_slice(code.get(..CODE_BYTES)?);
        Some(end)
    }

    /// Returns whether the code of a telecommand is right. `user` are its user data with the trailer.
    pub fn is_right(&self, base: ApidBase, sequence: u16, user: &[u8]) -> bool {
        let Some((covered, code)) = user.split_last_chunk::<CODE_BYTES>() else { return false };
        // The comparison takes the same time for each code, so that its time tells nothing about the right one.
        self.code(base, sequence, covered).is_some_and(|right| right.verify_truncated_left(code).is_ok())
    }

    /// Returns the code over a telecommand; `covered` are its user data up to the counter.
    fn code(&self, base: ApidBase, sequence: u16, covered: &[u8]) -> Option<Hmac<Sha256>> {
        let header = packet::primary_header(base, Apid::Command, sequence, covered.len() + CODE_BYTES)?;
        // Each secret has a length that the code takes, so that this is no refusal.
        let mut code = <Hmac<Sha256> as KeyInit>::new_from_slice(&self.secret).ok()?;
        code.update(&self.spacecraft.to_be_bytes());
        code.update(&[TO_SPACE]);
        code.update(&header);
        code.update(covered);
        Some(code)
    }
}

#[cfg(test)]
mod tests;
