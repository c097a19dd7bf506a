//! Tests of recordings that another program has written again: with another compression, without chunks, in another
//! order, with the numbers of the messages left out.

use std::fs;
use std::io::BufWriter;
use std::path::Path;

use crate::common::{SENSOR, frame, index, read, write};
use hzn_mcap::{Contents, Error, ImageReader, Index, IndexEntry, Reader, Row, recover};
use mcap::{Compression, WriteOptions};

const FRAMES: u64 = 11;

/// Every way in which the library of MCAP stores messages. Chunks of 5 kB have two or three pictures, and the parts of
/// a frame may be in different chunks.
fn ways() -> Vec<(String, WriteOptions)> {
    let mut ways = Vec::new();
    for compression in [None, Some(Compression::Zstd), Some(Compression::Lz4)] {
        for (chunks, chunk_size) in [(true, None), (true, Some(5_000)), (true, Some(1)), (false, None)] {
            for emit_message_indexes in [true, false] {
                let name = format!("{compression:?}, chunks {chunks} {chunk_size:?}, indexes {emit_message_indexes}");
                let options = WriteOptions::new().compression(compression).use_chunks(chunks).chunk_size(chunk_size);
                ways.push((name, options.emit_message_indexes(emit_message_indexes)));
            }
        }
    }
    ways
}

/// Writes a recording again. `change` may change the messages and their order.
fn rewrite(from: &Path, to: &Path, options: WriteOptions, change: impl FnOnce(&mut Vec<mcap::Message<'_>>)) {
    let bytes = fs::read(from).unwrap();
    let mut writer = options.create(BufWriter::new(fs::File::create(to).unwrap())).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    for index in &summary.attachment_indexes {
        writer.attach(&mcap::read::attachment(&bytes, index).unwrap()).unwrap();
    }
    let mut messages: Vec<_> = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap).collect();
    change(&mut messages);
    messages.iter().for_each(|message| writer.write(message).unwrap());
    writer.finish().unwrap();
}

/// Checks that every reader finds the frames of a recording as they were written first.
#[track_caller]
fn check_readers(path: &Path, name: &str) {
    let frames: Vec<_> = (0..FRAMES).map(frame).collect();
    assert_eq!(read(path), frames, "{name}");
    let mut reader = Reader::open(path, Contents::WithoutImages).unwrap();
    for (found, frame) in reader.by_ref().zip(&frames) {
        let found = found.unwrap();
        assert!(found.image.is_none(), "{name}");
        assert_eq!((&found.row, &found.annotations), (&frame.row, &frame.annotations), "{name}");
    }
    assert_eq!(reader.next().map(Result::unwrap), None, "{name}");
    assert!(reader.is_complete() && reader.broken_chunks() == 0, "{name}");
    assert_eq!((reader.sensor_toml(), reader.unknown_compression()), (Some(SENSOR), None), "{name}");

    let pictures: Vec<_> = frames.iter().filter_map(|f| f.image.clone()).collect();
    let (places, rows, found) = index(path);
    assert!(found.has_reports() && found.is_complete() && found.broken_chunks() == 0, "{name}");
    assert_eq!(rows, frames.iter().map(|f| (f.row.clone(), f.prior.clone())).collect::<Vec<_>>(), "{name}");
    let mut reader = found.pictures().unwrap();
    let shown: Vec<_> = places.iter().map(|place| reader.read(place).unwrap().image.unwrap()).collect();
    assert_eq!(shown, pictures, "{name}");

    let mut images = ImageReader::open(path, None).unwrap();
    let given: Vec<_> = images.by_ref().map(|image| image.unwrap().image.unwrap()).collect();
    assert_eq!((given, images.broken()), (pictures, None), "{name}");
}

#[test]
fn every_compression_and_layout_is_read() {
    let dir = tempfile::tempdir().unwrap();
    let ours = write(&dir.path().join("ours.mcap"), FRAMES, 3);
    check_readers(&ours, "ours");
    let (path, out) = (dir.path().join("theirs.mcap"), dir.path().join("recovered.mcap"));
    for (name, options) in ways() {
        rewrite(&ours, &path, options, |_| {});
        check_readers(&path, &name);
        let found = recover(&path, &out).unwrap();
        assert_eq!((found.frames, found.broken_chunks, found.dropped_bytes), (FRAMES, 0, 0), "{name}");
        check_readers(&out, &name);
        fs::remove_file(&out).unwrap();
    }
}

/// Programs that write messages in the order of their times often leave out the sequence numbers.
#[test]
fn frames_are_put_together_by_their_times_too() {
    let dir = tempfile::tempdir().unwrap();
    let ours = write(&dir.path().join("ours.mcap"), FRAMES, 3);
    let path = dir.path().join("theirs.mcap");
    for (name, options) in ways() {
        rewrite(&ours, &path, options, |messages| {
            messages.sort_by_key(|message| message.log_time);
            messages.iter_mut().for_each(|message| message.sequence = 0);
        });
        assert_eq!(read(&path), (0..FRAMES).map(frame).collect::<Vec<_>>(), "{name}");
        // A picture and its report have the same place in time.
        let mut index = Index::open(&path).unwrap();
        let (mut pictures, mut reports) = (Vec::new(), Vec::new());
        while let Some(part) = index.next_part().unwrap() {
            for entry in part {
                match entry {
                    IndexEntry::Picture(place) => pictures.push(place.frame()),
                    IndexEntry::Report(place, row, ..) => reports.push((place.frame(), row.index)),
                }
            }
        }
        let with_picture = reports.into_iter().filter(|(_, index)| frame(*index).image.is_some());
        assert_eq!(with_picture.map(|(frame, _)| frame).collect::<Vec<_>>(), pictures, "{name}");
    }
}

/// A killed rewriting leaves a file that may end at any byte.
#[test]
fn a_rewritten_file_cut_anywhere_keeps_its_finished_frames() {
    let dir = tempfile::tempdir().unwrap();
    let ours = write(&dir.path().join("ours.mcap"), FRAMES, 3);
    let (path, out) = (dir.path().join("cut.mcap"), dir.path().join("recovered.mcap"));
    for options in [WriteOptions::new().use_chunks(false), WriteOptions::new().compression(None)] {
        rewrite(&ours, &path, options.chunk_size(Some(5_000)), |_| {});
        let whole = fs::read(&path).unwrap();
        let mut most = 0;
        for n in (1_000..whole.len()).step_by(613) {
            fs::write(&path, &whole[..n]).unwrap();
            let frames = read(&path);
            assert!(frames.len() >= most, "cut at {n}");
            most = frames.len();
            let rows = |frames: Vec<hzn_mcap::FrameRecord>| frames.into_iter().map(|f| f.row).collect::<Vec<Row>>();
            let expected: Vec<Row> = (0..most as u64).map(|i| frame(i).row).collect();
            assert_eq!(rows(frames), expected, "cut at {n}");
            let without = Reader::open(&path, Contents::WithoutImages).unwrap().map(Result::unwrap).collect();
            assert_eq!(rows(without), expected, "cut at {n}");
            let (places, found, read_again) = index(&path);
            assert_eq!(found.into_iter().map(|(row, _)| row).collect::<Vec<_>>(), expected, "cut at {n}");
            let mut reader = read_again.pictures().unwrap();
            assert!(places.iter().all(|place| reader.read(place).unwrap().image.is_ok()), "cut at {n}");
            assert_eq!(recover(&path, &out).unwrap().frames, most as u64, "cut at {n}");
            assert_eq!(read(&out).len(), most, "cut at {n}");
            fs::remove_file(&out).unwrap();
        }
        assert_eq!(most as u64, FRAMES);
    }
}

#[test]
fn an_unknown_compression_is_named() {
    let dir = tempfile::tempdir().unwrap();
    let ours = write(&dir.path().join("ours.mcap"), FRAMES, 3);
    let path = dir.path().join("theirs.mcap");
    rewrite(&ours, &path, WriteOptions::new().compression(Some(Compression::Lz4)), |_| {});
    let mut bytes = fs::read(&path).unwrap();
    let at = bytes.windows(7).position(|w| w == b"\x03\0\0\0lz4").unwrap();
    bytes[at + 4..at + 7].copy_from_slice(b"lzx");
    fs::write(&path, bytes).unwrap();
    for contents in [Contents::All, Contents::WithoutImages] {
        let mut reader = Reader::open(&path, contents).unwrap();
        assert_eq!(reader.by_ref().count(), 0);
        assert_eq!((reader.broken_chunks(), reader.unknown_compression()), (1, Some("lzx")));
    }
    assert_eq!(index(&path).2.unknown_compression(), Some("lzx"));
    let mut images = ImageReader::open(&path, None).unwrap();
    assert_eq!(images.by_ref().count(), 0);
    let why = images.broken().unwrap();
    assert!(why.contains("\"lzx\"") && why.contains("with zstd, with lz4 or without compression"), "{why}");
    let e = recover(&path, dir.path().join("out.mcap")).unwrap_err();
    assert!(matches!(&e, Error::Compression { compression, .. } if compression == "lzx"), "{e}");
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 2, "nothing is written");
    let e = hzn_mcap::read_series(&path, |_| true, |_, _| {}).unwrap_err();
    assert!(matches!(e, Error::Compression { .. }), "{e}");
}

/// An LZ4 chunk with a wrong size, a wrong checksum or damaged data is damaged, and never fills the memory.
#[test]
fn a_damaged_lz4_chunk_costs_only_its_content() {
    let dir = tempfile::tempdir().unwrap();
    let ours = write(&dir.path().join("ours.mcap"), FRAMES, 3);
    let path = dir.path().join("theirs.mcap");
    let options = WriteOptions::new().compression(Some(Compression::Lz4)).chunk_size(Some(5_000));
    rewrite(&ours, &path, options, |_| {});
    let whole = fs::read(&path).unwrap();
    // The first chunks declare the channels.
    let chunk = &mcap::Summary::read(&whole).unwrap().unwrap().chunk_indexes[3];
    // Before the name of the compression are the head of the record, two times, the size and the checksum.
    let name = chunk.chunk_start_offset as usize + 9 + 28;
    assert_eq!(&whole[name..name + 7], b"\x03\0\0\0lz4");
    for at in [name - 12, name - 5, name - 4, name + 40, name + 900] {
        let mut bytes = whole.clone();
        bytes[at] ^= 0x55;
        fs::write(&path, bytes).unwrap();
        let mut reader = Reader::open(&path, Contents::All).unwrap();
        let found: Vec<_> = reader.by_ref().map(Result::unwrap).collect();
        let whole_frames = found.iter().filter(|found| **found == frame(found.row.index)).count() as u64;
        assert!((FRAMES / 2..FRAMES).contains(&whole_frames), "{at}: {whole_frames}");
        assert_eq!((reader.broken_chunks(), reader.unknown_compression()), (1, None), "{at}");
    }
}

/// Messages on the topic of the reports that are no reports of hzn must not look like an empty recording.
#[test]
fn reports_with_another_schema_are_counted() {
    let dir = tempfile::tempdir().unwrap();
    let ours = write(&dir.path().join("ours.mcap"), FRAMES, 3);
    let path = dir.path().join("theirs.mcap");
    for (name, options) in ways() {
        rewrite(&ours, &path, options, |messages| {
            for message in messages.iter_mut().filter(|m| m.channel.topic == "/hzn/report") {
                let channel = mcap::Channel { schema: None, ..(*message.channel).clone() };
                message.channel = std::sync::Arc::new(channel);
            }
        });
        let mut reader = Reader::open(&path, Contents::WithoutImages).unwrap();
        assert_eq!((reader.by_ref().count(), reader.unread_reports()), (0, FRAMES), "{name}");
        // A recovery counts as the reader does, and keeps the messages.
        let out = dir.path().join("recovered.mcap");
        let found = recover(&path, &out).unwrap();
        assert_eq!((found.frames, found.unread_reports, found.dropped_bytes), (0, FRAMES, 0), "{name}");
        let mut reader = Reader::open(&out, Contents::WithoutImages).unwrap();
        assert_eq!((reader.by_ref().count(), reader.unread_reports()), (0, FRAMES), "{name}");
        fs::remove_file(&out).unwrap();
    }
}
