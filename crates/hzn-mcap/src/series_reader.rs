//! Reads series over time: the JSON messages of a recording, for example of a navigation filter.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use crate::container::{Channel, Chunk, ChunkFault, Fields, Inflation, Message, Op, Scanner, Schemas};
use crate::error::Error;

/// Returns whether a recording has an attachment with this name before its first chunk. Only the beginning is read. A
/// file that is no MCAP has none.
///
/// # Errors
/// The file cannot be read.
pub fn begins_with_attachment(path: impl AsRef<Path>, name: &str) -> Result<bool, Error> {
    let path = path.as_ref();
    let read = |source| Error::Read { path: path.to_path_buf(), source };
    let file = File::open(path).map_err(read)?;
    let Some(mut scanner) = Scanner::try_new(BufReader::new(file)).map_err(read)? else { return Ok(false) };
    while let Some(record) = scanner.next().map_err(read)? {
        match record.op {
            Op::CHUNK | Op::MESSAGE | Op::DATA_END => break,
            Op::ATTACHMENT if Fields(&record.content).attached(name).is_some() => return Ok(true),
            _ => {}
        }
    }
    Ok(false)
}

/// Hands the JSON messages of the topics that `wants` accepts to `take`, as (topic, JSON), in file order. Memory is
/// needed for one chunk. A file that was cut off or damaged gives the messages before that place.
///
/// # Errors
/// The file cannot be read, is not an MCAP, or has a compression that hzn does not read.
pub fn read_series(
    path: impl AsRef<Path>,
    wants: impl Fn(&str) -> bool,
    mut take: impl FnMut(&str, &[u8]),
) -> Result<(), Error> {
    let is_whole = read_messages(path.as_ref(), |channel, message| {
        if channel.encoding == "json" && wants(&channel.topic) {
            take(&channel.topic, message.data);
        }
    });
    is_whole.map(|_| ())
}

/// Hands all messages to `take`, in file order, and returns whether the file has its end. A file that was cut off or
/// damaged gives the messages before that place.
///
/// # Errors
/// Those of [`read_series`].
pub(crate) fn read_messages(path: &Path, mut take: impl FnMut(&Channel, &Message<'_>)) -> Result<bool, Error> {
    let read = |source| Error::Read { path: path.to_path_buf(), source };
    let file = File::open(path).map_err(read)?;
    let scanner = Scanner::try_new(BufReader::with_capacity(1 << 16, file)).map_err(read)?;
    let mut scanner = scanner.ok_or_else(|| Error::NotMcap { path: path.to_path_buf() })?;
    let (mut schemas, mut inflation) = (Schemas::default(), Inflation::default());
    let mut channels: BTreeMap<u16, Channel> = BTreeMap::new();
    let mut hand = |channels: &BTreeMap<u16, Channel>, message: &Message<'_>| {
        if let Some(channel) = channels.get(&message.channel) {
            take(channel, message);
        }
    };
    while let Some(record) = scanner.next().map_err(read)? {
        match record.op {
            Op::DATA_END => return Ok(true),
            Op::CHUNK => {
                let (chunk, plain) = match Chunk::parse(&record, &mut inflation) {
                    Ok(read) => read,
                    Err(ChunkFault::Compression(compression)) => {
                        return Err(Error::Compression { path: path.to_path_buf(), compression });
                    }
                    Err(ChunkFault::Damaged(_)) => break,
                };
                for (op, _, content) in &chunk.index.declared {
                    channels.extend(schemas.declare(*op, content));
                }
                Chunk::messages(&plain).for_each(|message| hand(&channels, &message));
            }
            Op::MESSAGE => Message::parse(&record.content).iter().for_each(|message| hand(&channels, message)),
            op => channels.extend(schemas.declare(op, &record.content)),
        }
    }
    Ok(false)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SeriesWriter;

    #[test]
    fn series_come_back_also_from_a_file_that_was_cut_off() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("nav.mcap");
        let mut out = SeriesWriter::create(&path).unwrap();
        out.attach("fuse.toml", "application/toml", "").unwrap();
        for n in 0..3 {
            out.json("/nav/state", "hzn.NavState", f64::from(n), &serde_json::json!({"n": n})).unwrap();
            out.json("/other", "hzn.Other", f64::from(n), &serde_json::json!({"n": -n})).unwrap();
        }
        out.finish().unwrap();
        let all = |path: &Path| {
            let mut found = Vec::new();
            let wants = |topic: &str| topic.starts_with("/nav/");
            read_series(path, wants, |topic, json| {
                found.push(format!("{topic} {}", String::from_utf8_lossy(json)));
            })
            .unwrap();
            found
        };
        let expected = [0, 1, 2].map(|n| format!("/nav/state {{\"n\":{n}}}"));
        assert_eq!(all(&path), expected);
        assert!(begins_with_attachment(&path, "fuse.toml").unwrap());
        assert!(!begins_with_attachment(&path, "sensor.toml").unwrap());
        // Without its end, the file still gives what is complete.
        let bytes = std::fs::read(&path).unwrap();
        for cut in [bytes.len() - 1, bytes.len() / 2, 9] {
            std::fs::write(&path, &bytes[..cut]).unwrap();
            let found = all(&path);
            assert!(expected.starts_with(&found), "{found:?}");
        }
        std::fs::write(&path, "no recording").unwrap();
        assert!(!begins_with_attachment(&path, "fuse.toml").unwrap());
        assert!(matches!(read_series(&path, |_| true, |_, _| {}), Err(Error::NotMcap { .. })));
        assert!(begins_with_attachment(dir.path().join("none"), "fuse.toml").is_err());
    }
}
