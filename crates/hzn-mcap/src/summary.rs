//! What the summary at the end of a recording says before the recording is read.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, Read, Seek, SeekFrom};

use crate::container::{Channel, Fields, MAGIC, MAX_RECORD_BYTES, Op, Schemas};

/// Largest record of a summary that is read, in bytes. Schemas of ROS have a few kilobytes.
const MAX_BYTES: u64 = 1 << 20;

/// Fills a buffer; `false` if the file ends before.
pub(crate) fn fill(file: &mut impl Read, buffer: &mut [u8]) -> io::Result<bool> {
    match file.read_exact(buffer) {
        Ok(()) => Ok(true),
        Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => Ok(false),
        Err(e) => Err(e),
    }
}

/// Returns the offset of the summary; `None` without one.
pub(crate) fn find_start(file: &mut (impl Read + Seek)) -> io::Result<Option<u64>> {
    // The footer is a record of 20 bytes. The magic bytes follow it.
    const END_BYTES: usize = 9 + 20 + MAGIC.len();
    let mut end = [0; END_BYTES];
    let size = file.seek(SeekFrom::End(0))?;
    let Some(footer) = size.checked_sub(END_BYTES as u64) else { return Ok(None) };
    file.seek(SeekFrom::Start(footer))?;
    let is_read = fill(file, &mut end)?;
    let mut f = Fields(&end);
    Ok(match (f.u8(), f.u64(), f.u64()) {
        (Some(Op::FOOTER), Some(20), Some(start)) if is_read && end.ends_with(&MAGIC) => Some(start),
        _ => None,
    }
    // 0 is no summary. A file that was damaged can name a place behind its end.
    .filter(|start| (1..footer).contains(start)))
}

/// Returns the channels that have messages; none if the summary does not say it. The position in the file is lost.
pub(crate) fn read_channels(file: &mut (impl Read + Seek)) -> io::Result<Vec<Channel>> {
    let Some(start) = find_start(file)? else { return Ok(Vec::new()) };
    file.seek(SeekFrom::Start(start))?;
    let (mut schemas, mut channels, mut used) = (Schemas::default(), BTreeMap::new(), BTreeSet::new());
    loop {
        let mut head = [0; 9];
        if !fill(file, &mut head)? {
            break;
        }
        let mut f = Fields(&head);
        let (Some(op), Some(length)) = (f.u8(), f.u64()) else { break };
        match op {
            Op::SCHEMA | Op::CHANNEL | Op::STATISTICS if length <= MAX_BYTES => {
                let mut content = vec![0; length as usize];
                if !fill(file, &mut content)? {
                    break;
                }
                channels.extend(schemas.declare(op, &content));
                used.extend((op == Op::STATISTICS).then(|| channels_with_messages(&content)).into_iter().flatten());
            }
            Op::FOOTER => break,
            _ if length > MAX_RECORD_BYTES => break,
            _ => drop(file.seek(SeekFrom::Current(length as i64))?),
        }
    }
    channels.retain(|id, _| used.contains(id));
    Ok(channels.into_values().collect())
}

/// Reads the channels with messages from the statistics.
fn channels_with_messages(content: &[u8]) -> Vec<u16> {
    let mut f = Fields(content);
    // Numbers of messages, schemas, channels, attachments, metadata and chunks; two times.
    let counts = f.bytes(8 + 2 + 4 * 4 + 16).and_then(|_| {
        let length = f.u32()?;
        f.bytes(length as usize)
    });
    let mut counts = Fields(counts.unwrap_or_default());
    let one = || Some((counts.u16()?, counts.u64()?));
    std::iter::from_fn(one).filter(|(_, count)| *count > 0).map(|(id, _)| id).collect()
}
