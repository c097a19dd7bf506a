//! The MCAP container as bytes.
//!
//! Recordings are written here and not by a general writer, for two reasons. Pictures are in separate chunks without
//! compression while all other data are compressed. A resumed or recovered file copies whole chunks without changes.
//! The layout is that of the MCAP specification; the tests read it back with independent readers.

mod channel;
mod chunk;
mod inflation;
mod op;
mod scan;
mod search;
mod write;

pub(crate) use channel::{Channel, Schemas};
pub(crate) use chunk::{Chunk, ChunkBuilder, ChunkFault, Message, REWRITE};
pub(crate) use inflation::Inflation;
pub(crate) use op::{Fields, Op};
pub(crate) use scan::{Record, Scanner};
pub(crate) use write::Container;

/// The first and last bytes of every MCAP.
pub(crate) const MAGIC: [u8; 8] = [0x89, b'M', b'C', b'A', b'P', 0x30, b'\r', b'\n'];
/// Largest record that is read or written, in bytes. A wrong length in a broken file must not exhaust the memory.
pub(crate) const MAX_RECORD_BYTES: u64 = 1 << 30;
