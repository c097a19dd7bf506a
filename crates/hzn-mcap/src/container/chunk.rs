//! Chunks: groups of messages, compressed or not, with a CRC.

use std::collections::BTreeMap;
use std::io::Read;

use super::op::{Fields, Op, Put};
use super::{Inflation, Record};

/// Compression level: the fastest useful one. The data are small compared with the pictures.
const ZSTD_LEVEL: i32 = 1;

/// One message of a chunk.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Message<'a> {
    pub(crate) channel: u16,
    pub(crate) sequence: u32,
    pub(crate) log_time_ns: u64,
    pub(crate) data: &'a [u8],
}

impl<'a> Message<'a> {
    pub(crate) fn parse(content: &'a [u8]) -> Option<Self> {
        let mut f = Fields(content);
        let (channel, sequence, log_time_ns, _publish) = (f.u16()?, f.u32()?, f.u64()?, f.u64()?);
        Some(Self { channel, sequence, log_time_ns, data: f.0 })
    }
}

/// Collects messages for one chunk.
#[derive(Debug, Default)]
pub(crate) struct ChunkBuilder {
    bytes: Vec<u8>,
    messages: u64,
}

impl ChunkBuilder {
    /// Returns the number of bytes collected so far.
    pub(crate) fn len(&self) -> usize {
        self.bytes.len()
    }
    pub(crate) fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }
    /// Returns the number of messages collected so far.
    pub(crate) fn messages(&self) -> u64 {
        self.messages
    }
    /// Appends a message; `fill` appends its data.
    pub(crate) fn push(&mut self, channel: u16, sequence: u32, time_ns: u64, fill: impl FnOnce(&mut Vec<u8>)) {
        let start = self.bytes.len();
        self.messages += 1;
        self.bytes.u8(Op::MESSAGE).u64(0).u16(channel).u32(sequence).u64(time_ns).u64(time_ns);
        fill(&mut self.bytes);
        let length = (self.bytes.len() - start - 9) as u64;
        if let Some(field) = self.bytes.get_mut(start + 1..start + 9) {
            field.copy_from_slice(&length.to_le_bytes());
        }
    }
    /// Reuses the memory of a written chunk for the next one.
    pub(crate) fn recycle(&mut self, chunk: Chunk) {
        if self.bytes.is_empty() && self.bytes.capacity() < chunk.records.capacity() {
            self.bytes = chunk.records;
            self.bytes.clear();
        }
    }
    /// Returns the chunk and begins a new one.
    pub(crate) fn take(&mut self, compress: bool) -> std::io::Result<Chunk> {
        let plain = std::mem::take(&mut self.bytes);
        self.messages = 0;
        let crc = crc32fast::hash(&plain);
        let index = Index::read(&plain).unwrap_or_default();
        let size = plain.len() as u64;
        let (compression, records) =
            if compress { ("zstd", zstd::bulk::compress(&plain, ZSTD_LEVEL)?) } else { ("", plain) };
        Ok(Chunk { compression: compression.to_owned(), size, crc, records, index })
    }
}

/// Places of each channel's messages in the uncompressed chunk.
#[derive(Debug, Clone, Default)]
pub(crate) struct Index {
    /// First and last log time in nanoseconds; `None` without messages.
    pub(crate) times_ns: Option<(u64, u64)>,
    /// Per channel: log time in nanoseconds and offset in bytes.
    pub(crate) channels: BTreeMap<u16, Vec<(u64, u64)>>,
    /// Schema and channel records in the chunk: number, id, content.
    pub(crate) declared: Vec<(u8, u16, Vec<u8>)>,
}

impl Index {
    /// Reads the records of an uncompressed chunk; `None` if they are not valid.
    fn read(plain: &[u8]) -> Option<Self> {
        let mut index = Self::default();
        let mut rest = Fields(plain);
        while !rest.0.is_empty() {
            let offset = (plain.len() - rest.0.len()) as u64;
            let (op, length) = (rest.u8()?, rest.u64()?);
            let content = rest.bytes(usize::try_from(length).ok()?)?;
            match op {
                Op::MESSAGE => {
                    let m = Message::parse(content)?;
                    let (first, last) = index.times_ns.unwrap_or((m.log_time_ns, m.log_time_ns));
                    index.times_ns = Some((first.min(m.log_time_ns), last.max(m.log_time_ns)));
                    index.channels.entry(m.channel).or_default().push((m.log_time_ns, offset));
                }
                Op::SCHEMA | Op::CHANNEL => index.declared.push((op, Fields(content).u16()?, content.to_vec())),
                _ => {}
            }
        }
        Some(index)
    }
}

/// Why a chunk cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(crate) enum ChunkFault {
    /// The chunk is compressed with a method that hzn does not know; the text is its name.
    #[error("its data are compressed with {0:?}, which hzn does not read: {REWRITE}")]
    Compression(String),
    /// The chunk is damaged; the text names the fault.
    #[error("{0}")]
    Damaged(String),
}

/// Remedy against an unknown compression.
pub(crate) const REWRITE: &str = "write the file again with zstd, with lz4 or without compression";

/// Reads a chunk that is compressed with the frame format of LZ4. `size` is its size when it is uncompressed.
fn read_lz4(records: &[u8], size: u64) -> std::io::Result<Vec<u8>> {
    let mut plain = Vec::new();
    // One byte more shows that the size is wrong.
    lz4_flex::frame::FrameDecoder::new(records).take(size + 1).read_to_end(&mut plain)?;
    Ok(plain)
}

/// A chunk as it is in the file, with the data for its index.
#[derive(Debug)]
pub(crate) struct Chunk {
    pub(crate) compression: String,
    /// Size of the uncompressed records in bytes.
    pub(crate) size: u64,
    /// CRC-32 of the uncompressed records; 0 if the writer left it out.
    pub(crate) crc: u32,
    /// The records as stored.
    pub(crate) records: Vec<u8>,
    pub(crate) index: Index,
}

impl Chunk {
    /// Parses a chunk record, checks its CRC and reads its records. It returns the chunk and its uncompressed records.
    ///
    /// # Errors
    /// The reason why it cannot be read.
    pub(crate) fn parse(record: &Record, inflation: &mut Inflation) -> Result<(Self, Vec<u8>), ChunkFault> {
        let damaged = ChunkFault::Damaged;
        let cannot = |e: &dyn std::fmt::Display| damaged(format!("a chunk cannot be uncompressed: {e}"));
        let mut f = Fields(&record.content);
        let mut head = || {
            let (_first, _last, size, crc) = (f.u64()?, f.u64()?, f.u64()?, f.u32()?);
            let compression = f.text()?.to_owned();
            let length = f.u64()?;
            Some((size, crc, compression, f.bytes(usize::try_from(length).ok()?)?.to_vec()))
        };
        let (size, crc, compression, records) = head().ok_or_else(|| damaged("a chunk is not valid".into()))?;
        let plain = match compression.as_str() {
            "" => records.clone(),
            "zstd" | "lz4" if !inflation.admit(records.len() as u64, size) => {
                let stored = records.len();
                return Err(damaged(format!(
                    "a chunk of {stored} bytes claims to have {size} when it is uncompressed"
                )));
            }
            // A wrong size is an error of the decoder, which never writes beyond it.
            "zstd" => {
                let size = usize::try_from(size).map_err(|e| cannot(&e))?;
                zstd::bulk::decompress(&records, size).map_err(|e| cannot(&e))?
            }
            "lz4" => read_lz4(&records, size).map_err(|e| cannot(&e))?,
            _ => return Err(ChunkFault::Compression(compression)),
        };
        if plain.len() as u64 != size {
            return Err(damaged(format!("a chunk has {} bytes instead of {size}", plain.len())));
        }
        if crc != 0 && crc32fast::hash(&plain) != crc {
            return Err(damaged("the CRC of a chunk is wrong".into()));
        }
        let index = Index::read(&plain).ok_or_else(|| damaged("the records of a chunk are not valid".into()))?;
        Ok((Self { compression, size, crc, records, index }, plain))
    }

    /// Iterates over the messages of uncompressed records, in order.
    pub(crate) fn messages(plain: &[u8]) -> impl Iterator<Item = Message<'_>> {
        let mut rest = Fields(plain);
        std::iter::from_fn(move || {
            loop {
                let (op, length) = (rest.u8()?, rest.u64()?);
                let content = rest.bytes(usize::try_from(length).ok()?)?;
                if op == Op::MESSAGE {
                    return Message::parse(content);
                }
            }
        })
    }
}
