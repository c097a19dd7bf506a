//! Writes an MCAP: it only appends records, and can close the file at any time.

use std::collections::BTreeMap;
use std::io::{self, Write};

use super::chunk::Chunk;
use super::op::{Op, Put};
use super::{MAGIC, Record};

/// An MCAP that is being written.
#[derive(Debug)]
pub(crate) struct Container<W> {
    out: W,
    position: u64,
    crc: crc32fast::Hasher,
    schemas: BTreeMap<u16, Vec<u8>>,
    channels: BTreeMap<u16, Vec<u8>>,
    chunk_indexes: Vec<Vec<u8>>,
    attachment_indexes: Vec<Vec<u8>>,
    metadata_indexes: Vec<Vec<u8>>,
    messages: BTreeMap<u16, u64>,
    times_ns: Option<(u64, u64)>,
}

impl<W: Write> Container<W> {
    /// Begins a file.
    pub(crate) fn try_new(out: W, library: &str) -> io::Result<Self> {
        let mut new = Self {
            out,
            position: 0,
            crc: crc32fast::Hasher::new(),
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            chunk_indexes: Vec::new(),
            attachment_indexes: Vec::new(),
            metadata_indexes: Vec::new(),
            messages: BTreeMap::new(),
            times_ns: None,
        };
        new.put(&MAGIC)?;
        let mut header = Vec::new();
        header.text("").text(library);
        new.record(Op::HEADER, &header)?;
        Ok(new)
    }

    fn put(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.out.write_all(bytes)?;
        self.crc.update(bytes);
        self.position += bytes.len() as u64;
        Ok(())
    }

    fn record(&mut self, op: u8, content: &[u8]) -> io::Result<()> {
        let mut head = Vec::with_capacity(9);
        head.u8(op).u64(content.len() as u64);
        self.put(&head)?;
        self.put(content)
    }

    /// Appends an attachment.
    pub(crate) fn attach(&mut self, name: &str, media_type: &str, data: &[u8]) -> io::Result<()> {
        let mut content = Vec::with_capacity(data.len() + 64);
        content.u64(0).u64(0).text(name).text(media_type).u64(data.len() as u64).extend_from_slice(data);
        let crc = crc32fast::hash(&content);
        content.u32(crc);
        self.attachment(&content, name, media_type, data.len() as u64)
    }

    fn attachment(&mut self, content: &[u8], name: &str, media_type: &str, size: u64) -> io::Result<()> {
        let times = content.get(..16).unwrap_or(&[0; 16]);
        let mut index = Vec::new();
        index.u64(self.position).u64(9 + content.len() as u64).extend_from_slice(times);
        index.u64(size).text(name).text(media_type);
        self.attachment_indexes.push(index);
        self.record(Op::ATTACHMENT, content)
    }

    /// Appends metadata: a named table of texts.
    pub(crate) fn metadata(&mut self, name: &str, map: &BTreeMap<String, String>) -> io::Result<()> {
        let mut content = Vec::new();
        content.text(name).map(map);
        let mut index = Vec::new();
        index.u64(self.position).u64(9 + content.len() as u64).text(name);
        self.metadata_indexes.push(index);
        self.record(Op::METADATA, &content)
    }

    /// Returns whether this channel is declared.
    pub(crate) fn has_channel(&self, id: u16) -> bool {
        self.channels.contains_key(&id)
    }

    /// Declares a schema if it is not declared yet; ids begin at 1.
    pub(crate) fn schema(&mut self, id: u16, name: &str, encoding: &str, data: &[u8]) -> io::Result<()> {
        let mut content = Vec::with_capacity(data.len() + 64);
        content.u16(id).text(name).text(encoding).u32(data.len() as u32).extend_from_slice(data);
        self.declare(Op::SCHEMA, id, content)
    }

    /// Declares a channel if it is not declared yet.
    pub(crate) fn channel(&mut self, id: u16, schema: u16, topic: &str, encoding: &str) -> io::Result<()> {
        let mut content = Vec::new();
        content.u16(id).u16(schema).text(topic).text(encoding).map(&BTreeMap::new());
        self.declare(Op::CHANNEL, id, content)
    }

    /// Appends a schema or channel record if it is not there yet.
    fn declare(&mut self, op: u8, id: u16, content: Vec<u8>) -> io::Result<()> {
        let known = if op == Op::SCHEMA { &mut self.schemas } else { &mut self.channels };
        if known.insert(id, content.clone()).is_some() {
            return Ok(());
        }
        self.record(op, &content)
    }

    /// Appends a chunk and its message indexes.
    pub(crate) fn chunk(&mut self, chunk: &Chunk) -> io::Result<()> {
        let Some((first, last)) = chunk.index.times_ns else {
            // Only the declarations of a chunk without messages are kept.
            return chunk
                .index
                .declared
                .iter()
                .try_for_each(|(op, id, content)| self.declare(*op, *id, content.clone()));
        };
        for (op, id, content) in &chunk.index.declared {
            let known = if *op == Op::SCHEMA { &mut self.schemas } else { &mut self.channels };
            known.insert(*id, content.clone());
        }
        let start = self.position;
        let mut head = Vec::new();
        head.u64(first)
            .u64(last)
            .u64(chunk.size)
            .u32(chunk.crc)
            .text(&chunk.compression)
            .u64(chunk.records.len() as u64);
        let mut opening = Vec::new();
        opening.u8(Op::CHUNK).u64((head.len() + chunk.records.len()) as u64);
        self.put(&opening)?;
        self.put(&head)?;
        self.put(&chunk.records)?;
        let length = self.position - start;

        let mut offsets = Vec::new();
        let indexes_start = self.position;
        for (&channel, entries) in &chunk.index.channels {
            offsets.u16(channel).u64(self.position);
            let mut content = Vec::new();
            content.u16(channel).u32((entries.len() * 16) as u32);
            for &(time, offset) in entries {
                content.u64(time).u64(offset);
            }
            self.record(Op::MESSAGE_INDEX, &content)?;
            *self.messages.entry(channel).or_default() += entries.len() as u64;
        }
        let mut index = Vec::new();
        index.u64(first).u64(last).u64(start).u64(length).u32(offsets.len() as u32).extend_from_slice(&offsets);
        index.u64(self.position - indexes_start).text(&chunk.compression);
        index.u64(chunk.records.len() as u64).u64(chunk.size);
        self.chunk_indexes.push(index);
        let (a, b) = self.times_ns.unwrap_or((first, last));
        self.times_ns = Some((a.min(first), b.max(last)));
        Ok(())
    }

    /// Copies a record of another file that is outside of chunks. Records of a file's end are left out, because
    /// [`Self::finish`] writes them.
    pub(crate) fn copy(&mut self, record: &Record) -> io::Result<()> {
        use super::Fields;
        let mut f = Fields(&record.content);
        match record.op {
            Op::SCHEMA | Op::CHANNEL => match f.u16() {
                Some(id) => self.declare(record.op, id, record.content.clone()),
                None => Ok(()),
            },
            Op::ATTACHMENT => {
                let parts = (|| {
                    f.bytes(16)?;
                    Some((f.text()?.to_owned(), f.text()?.to_owned(), f.u64()?))
                })();
                match parts {
                    Some((name, media_type, size)) => self.attachment(&record.content, &name, &media_type, size),
                    None => Ok(()),
                }
            }
            Op::METADATA => match (f.text().map(str::to_owned), f.map()) {
                (Some(name), Some(map)) => self.metadata(&name, &map),
                _ => Ok(()),
            },
            Op::MESSAGE => match super::Message::parse(&record.content) {
                Some(m) => {
                    *self.messages.entry(m.channel).or_default() += 1;
                    let (a, b) = self.times_ns.unwrap_or((m.log_time_ns, m.log_time_ns));
                    self.times_ns = Some((a.min(m.log_time_ns), b.max(m.log_time_ns)));
                    self.record(record.op, &record.content)
                }
                None => Ok(()),
            },
            _ => Ok(()),
        }
    }

    /// Returns the size in bytes that the file has if it is closed now.
    pub(crate) fn finished_bytes(&self) -> u64 {
        // A record has nine bytes before its content; a summary has at most six groups with an offset of 26 bytes each.
        let records = |contents: &mut dyn Iterator<Item = &Vec<u8>>| contents.map(|c| 9 + c.len() as u64).sum::<u64>();
        let summary = records(&mut self.schemas.values())
            + records(&mut self.channels.values())
            + records(&mut self.chunk_indexes.iter())
            + records(&mut self.attachment_indexes.iter())
            + records(&mut self.metadata_indexes.iter())
            + 9
            + self.statistics().len() as u64;
        let (data_end, offsets, footer) = (13, 6 * 26, 29 + MAGIC.len() as u64);
        self.position + data_end + summary + offsets + footer
    }

    /// Passes all data to the operating system: they stay in the file if the program ends.
    pub(crate) fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }

    /// Returns the output.
    pub(crate) fn output(&self) -> &W {
        &self.out
    }

    /// Closes the file: end of data, summary, footer.
    pub(crate) fn finish(mut self) -> io::Result<W> {
        let mut end = Vec::new();
        end.u32(self.crc.clone().finalize());
        self.record(Op::DATA_END, &end)?;

        let summary_start = self.position;
        self.crc = crc32fast::Hasher::new();
        let mut offsets = Vec::new();
        let statistics = self.statistics();
        let groups = [
            (Op::SCHEMA, self.schemas.values().cloned().collect()),
            (Op::CHANNEL, self.channels.values().cloned().collect()),
            (Op::STATISTICS, vec![statistics]),
            (Op::CHUNK_INDEX, std::mem::take(&mut self.chunk_indexes)),
            (Op::ATTACHMENT_INDEX, std::mem::take(&mut self.attachment_indexes)),
            (Op::METADATA_INDEX, std::mem::take(&mut self.metadata_indexes)),
        ];
        for (op, contents) in groups {
            let start = self.position;
            for content in &contents {
                self.record(op, content)?;
            }
            if !contents.is_empty() {
                let mut offset = Vec::new();
                offset.u8(op).u64(start).u64(self.position - start);
                offsets.push(offset);
            }
        }
        let offsets_start = self.position;
        for offset in &offsets {
            self.record(Op::SUMMARY_OFFSET, offset)?;
        }
        // The summary's CRC includes the footer up to the CRC itself.
        let mut footer = Vec::new();
        footer.u8(Op::FOOTER).u64(20).u64(summary_start).u64(offsets_start);
        self.put(&footer)?;
        let crc = self.crc.clone().finalize();
        self.put(&crc.to_le_bytes())?;
        self.put(&MAGIC)?;
        self.out.flush()?;
        Ok(self.out)
    }

    fn statistics(&self) -> Vec<u8> {
        let (first, last) = self.times_ns.unwrap_or((0, 0));
        let mut s = Vec::new();
        s.u64(self.messages.values().sum()).u16(self.schemas.len() as u16).u32(self.channels.len() as u32);
        s.u32(self.attachment_indexes.len() as u32).u32(self.metadata_indexes.len() as u32);
        s.u32(self.chunk_indexes.len() as u32).u64(first).u64(last).u32((self.messages.len() * 10) as u32);
        for (&channel, &count) in &self.messages {
            s.u16(channel).u64(count);
        }
        s
    }
}
