//! Finds the next chunk of a file in which bytes are missing or damaged.

use std::io::{self, Read, Seek, SeekFrom};

use super::op::{Fields, Op};

/// Bytes that are looked at together.
const BLOCK_BYTES: usize = 1 << 16;
/// Bytes that show a chunk: the head of its record, times, size, CRC, the longest name of a compression, and the length
/// of its records.
const SHOWN_BYTES: usize = 9 + 28 + 4 + 4 + 8;

/// Returns the place of the first chunk that begins at `from` or after it. `None` if there is none.
pub(super) fn next_chunk<R: Read + Seek>(source: &mut R, from: u64) -> io::Result<Option<u64>> {
    source.seek(SeekFrom::Start(from))?;
    let mut start = from;
    let mut block = Vec::with_capacity(BLOCK_BYTES + SHOWN_BYTES);
    loop {
        let before = block.len();
        source.by_ref().take(BLOCK_BYTES as u64).read_to_end(&mut block)?;
        if let Some(at) = (0..block.len()).find(|&at| block.get(at..).is_some_and(begins_chunk)) {
            return Ok(Some(start + at as u64));
        }
        if block.len() == before {
            return Ok(None);
        }
        // A chunk may begin at the end of this block.
        let done = block.len().saturating_sub(SHOWN_BYTES);
        block.drain(..done);
        start += done as u64;
    }
}

/// Returns whether these bytes begin with a chunk. Two lengths must agree, so other bytes seem to be one with a
/// probability of 2⁻⁶⁴.
fn begins_chunk(bytes: &[u8]) -> bool {
    let mut f = Fields(bytes);
    let head = (f.u8(), f.u64(), f.bytes(28), f.u32().filter(|&n| n <= 4));
    let (Some(Op::CHUNK), Some(length), Some(_), Some(name)) = head else { return false };
    let (Some(name), Some(records)) = (f.bytes(name as usize), f.u64()) else { return false };
    [&b""[..], b"zstd", b"lz4"].contains(&name) && records.checked_add(40 + name.len() as u64) == Some(length)
}
