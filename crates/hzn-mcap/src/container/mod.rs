//! The MCAP container, as bytes.
//!
//! Recordings are written here and not by a general writer for two reasons: pictures stand uncompressed in chunks of
//! their own while everything else is compressed, and a resumed or recovered file takes over whole chunks as they
//! are. The layout is the MCAP specification's; the tests read it back with independent readers.

mod chunk;
mod op;
mod scan;
mod write;

pub(crate) use chunk::{Chunk, ChunkBuilder, Message};
pub(crate) use op::{Fields, Op};
pub(crate) use scan::{Record, Scanner};
pub(crate) use write::Container;

/// The first and last bytes of every MCAP.
pub(crate) const MAGIC: [u8; 8] = [0x89, b'M', b'C', b'A', b'P', 0x30, b'\r', b'\n'];
/// Largest record that is read or written, bytes: a broken length must not fill the memory.
pub(crate) const MAX_RECORD_BYTES: u64 = 1 << 30;
