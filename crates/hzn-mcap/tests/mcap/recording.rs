//! Tests of recordings: written, read back, cut off anywhere, closed and continued.

use std::fs;
use std::path::Path;

use crate::common::{SENSOR, frame, index, options, read, write};
use hzn_core::status::Status;
use hzn_mcap::{
    Contents, EncodedImage, Error, ImageFormat, ImageReader, Index, Options, Reader, Row, Writer, part_path, recover,
    resume,
};

#[test]
fn the_finished_size_is_known_before() {
    let dir = tempfile::tempdir().unwrap();
    let mut closest = f64::MAX;
    for frames in [0, 1, 2, 5, 40, 300] {
        let path = dir.path().join(format!("{frames}.mcap"));
        let mut writer = Writer::create(&path, &options()).unwrap();
        for i in 0..frames {
            writer.write(&frame(i)).unwrap();
            if i % 7 == 6 {
                writer.flush().unwrap();
            }
        }
        let waiting = writer.finished_bytes();
        writer.flush().unwrap();
        let flushed = writer.finished_bytes();
        writer.finish().unwrap();
        let size = fs::metadata(&path).unwrap().len();
        assert!(size <= flushed && flushed <= waiting, "{frames}: {size} {flushed} {waiting}");
        closest = closest.min(flushed as f64 / size as f64);
    }
    // The bound of long recordings is close.
    assert!(closest < 1.02, "{closest}");
}

#[test]
fn everything_comes_back() {
    let dir = tempfile::tempdir().unwrap();
    let path = write(&dir.path().join("out.mcap"), 30, 7);
    assert!(!part_path(&path).exists());
    let mut reader = Reader::open(&path, Contents::All).unwrap();
    assert_eq!(reader.sensor_toml(), Some(SENSOR));
    assert_eq!(reader.metadata()["hzn_version"], "0.0.0");
    let frames: Vec<_> = reader.by_ref().map(Result::unwrap).collect();
    assert_eq!(frames, (0..30).map(frame).collect::<Vec<_>>());
    assert!(reader.is_complete());
    let without: Vec<_> = Reader::open(&path, Contents::WithoutImages).unwrap().map(Result::unwrap).collect();
    assert!(without.iter().zip(&frames).all(|(a, b)| a.image.is_none() && a.row == b.row));
}

#[test]
fn an_independent_reader_agrees() {
    let dir = tempfile::tempdir().unwrap();
    let path = write(&dir.path().join("out.mcap"), 12, 5);
    let bytes = fs::read(&path).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let stats = summary.stats.as_ref().unwrap();
    assert_eq!((stats.attachment_count, stats.metadata_count, stats.chunk_count), (1, 1, 6));
    assert_eq!((stats.message_start_time, stats.message_end_time), (100_000_000_000, 101_100_000_000));
    // The stream checks every CRC. The index must lead to the same messages.
    let stream: Vec<_> = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap).collect();
    assert_eq!(stream.len() as u64, stats.message_count);
    let mut indexed = 0;
    for chunk in &summary.chunk_indexes {
        for entries in summary.read_message_indexes(&bytes, chunk).unwrap().values() {
            for entry in entries {
                summary.seek_message(&bytes, chunk, entry).unwrap();
                indexed += 1;
            }
        }
    }
    assert_eq!(indexed, stream.len());
    // Chunks without compression have only pictures.
    for chunk in &summary.chunk_indexes {
        let topics: Vec<_> =
            summary.stream_chunk(&bytes, chunk).unwrap().map(|m| m.unwrap().channel.topic.clone()).collect();
        let images = topics.iter().filter(|t| *t == "/camera/image").count();
        assert_eq!(images, if chunk.compression.is_empty() { topics.len() } else { 0 });
    }
    let attachment = mcap::read::attachment(&bytes, &summary.attachment_indexes[0]).unwrap();
    assert_eq!((attachment.name.as_str(), &*attachment.data), ("sensor.toml", SENSOR.as_bytes()));
    let options = mcap::sans_io::linear_reader::LinearReaderOptions::default()
        .with_validate_data_section_crc(true)
        .with_validate_summary_section_crc(true)
        .with_prevalidate_chunk_crcs(true);
    assert!(mcap::io::MessageReader::new_with_options(&bytes[..], options).all(|m| m.is_ok()));
}

#[test]
fn the_schema_names_every_column() {
    let schema = hzn_mcap::report_schema();
    let always = ["index", "file", "body", "status", "detail"];
    assert!(schema["required"].as_array().unwrap().iter().eq(always));
    assert_eq!(schema["properties"]["level"]["type"], "integer");
    assert_eq!(schema["properties"]["status"]["enum"].as_array().unwrap().len(), Status::ALL.len());
    let named = schema["properties"].as_object().unwrap();
    assert!(Row::COLUMNS.iter().all(|c| named.contains_key(*c)));
    assert_eq!(named.len(), Row::COLUMNS.len() + 2);
}

/// A killed program leaves a file that may end at any byte. Every frame whose batch was flushed before must be found.
#[test]
fn a_file_cut_anywhere_keeps_its_finished_frames() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let mut writer = Writer::create(at("out.mcap"), &options()).unwrap();
    let mut finished = vec![];
    for i in 0..9 {
        writer.write(&frame(i)).unwrap();
        if i % 3 == 2 {
            writer.flush().unwrap();
            finished.push((fs::metadata(writer.part()).unwrap().len(), i + 1));
        }
    }
    let whole = fs::read(writer.finish().unwrap()).unwrap();
    for n in (0..whole.len()).step_by(97).chain([whole.len() - 1]) {
        let (cut, out) = (at("cut.mcap"), at("again.mcap"));
        fs::write(&cut, &whole[..n]).unwrap();
        let expect = finished.iter().rev().find(|(size, _)| *size <= n as u64).map_or(0, |(_, frames)| *frames);
        match recover(&cut, &out) {
            Ok(found) => {
                // If only the message indexes of a batch are cut off, its frames are found too.
                assert!(found.frames == expect || found.frames == expect + 3, "cut at {n}");
                assert_eq!(found.broken_chunks, 0, "cut at {n}");
                let frames = read(&out);
                assert_eq!(frames, (0..found.frames).map(frame).collect::<Vec<_>>(), "cut at {n}");
                let bytes = fs::read(&out).unwrap();
                assert!(mcap::MessageStream::new(&bytes).unwrap().all(|m| m.is_ok()), "cut at {n}");
                assert_eq!(read(&cut), frames, "read without recovery, cut at {n}");
                fs::remove_file(&out).unwrap();
            }
            Err(e) => assert!(matches!(e, Error::NotMcap { .. }) && n < 8, "cut at {n}: {e}"),
        }
        assert!(!part_path(&out).exists());
    }
}

#[test]
fn a_resumed_run_equals_an_uninterrupted_one() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("out.mcap");
    let whole = write(&dir.path().join("whole.mcap"), 20, 4);
    for (killed_after, torn) in [(0, 3), (5, 0), (11, 500), (20, 9)] {
        let mut writer = Writer::create(&path, &options()).unwrap();
        for i in 0..killed_after {
            writer.write(&frame(i)).unwrap();
            if i % 4 == 3 {
                writer.flush().unwrap();
            }
        }
        drop(writer);
        let part = part_path(&path);
        let bytes = fs::read(&part).unwrap();
        fs::write(&part, &bytes[..bytes.len() - torn]).unwrap();
        let mut resumed = resume(&path, &options()).unwrap();
        assert!(resumed.frames <= killed_after);
        assert_eq!(resumed.last_index, resumed.frames.checked_sub(1));
        for i in resumed.frames..20 {
            resumed.writer.write(&frame(i)).unwrap();
        }
        resumed.writer.finish().unwrap();
        assert_eq!(read(&path), read(&whole));
        fs::remove_file(&path).unwrap();
    }
    // Results of different sensors do not belong together.
    drop(Writer::create(&path, &options()).unwrap());
    let other = Options { sensor_toml: "preset = \"moon\"\n".into(), ..options() };
    assert!(matches!(resume(&path, &other), Err(Error::OtherSensor { .. })));
}

#[test]
fn damage_inside_costs_only_its_chunk() {
    let dir = tempfile::tempdir().unwrap();
    let path = write(&dir.path().join("out.mcap"), 12, 4);
    let bytes = fs::read(&path).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let second = summary.chunk_indexes.iter().filter(|c| c.compression == "zstd").nth(1).unwrap();
    let mut damaged = bytes.clone();
    damaged[second.chunk_start_offset as usize + second.chunk_length as usize - 20] ^= 0x55;
    let (broken, out) = (dir.path().join("broken.mcap"), dir.path().join("mended.mcap"));
    fs::write(&broken, &damaged).unwrap();
    let found = recover(&broken, &out).unwrap();
    assert_eq!((found.frames, found.broken_chunks), (8, 1));
    let indices: Vec<_> = read(&out).iter().map(|f| f.row.index).collect();
    assert_eq!(indices, [0, 1, 2, 3, 8, 9, 10, 11]);
    let mut reader = Reader::open(&broken, Contents::All).unwrap();
    assert_eq!(reader.by_ref().map(Result::unwrap).count(), 8);
    assert_eq!(reader.broken_chunks(), 1);
}

#[test]
fn outputs_are_not_replaced_unasked() {
    let dir = tempfile::tempdir().unwrap();
    let path = write(&dir.path().join("out.mcap"), 1, 1);
    assert!(matches!(Writer::create(&path, &options()), Err(Error::Exists { .. })));
    assert!(matches!(recover(&path, &path), Err(Error::Exists { .. })));
    let forced = Options { force: true, ..options() };
    Writer::create(&path, &forced).unwrap().finish().unwrap();
    assert_eq!(read(&path).len(), 0);
    let other = dir.path().join("other.mcap");
    drop(Writer::create(&other, &options()).unwrap());
    let e = Writer::create(&other, &options()).unwrap_err();
    assert!(matches!(e, Error::Unfinished { .. }) && e.to_string().contains("continue that run"), "{e}");
}

#[test]
fn errors_name_the_place_and_the_way_out() {
    let e = Writer::create("/nonexistent-folder/out.mcap", &options()).unwrap_err();
    assert!(e.to_string().contains("/nonexistent-folder:"), "{e}");
    let dir = tempfile::tempdir().unwrap();
    let text = dir.path().join("a.txt");
    fs::write(&text, "not an mcap at all").unwrap();
    assert!(matches!(Reader::open(&text, Contents::All), Err(Error::NotMcap { .. })));
    assert!(matches!(ImageReader::open(&text, None), Err(Error::NotMcap { .. })));
}

/// A full disk, simulated by the system's `/dev/full`.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_reported_and_nothing_else_happens() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("out.mcap");
    std::os::unix::fs::symlink("/dev/full", part_path(&path)).unwrap();
    let e = Writer::create(&path, &Options { force: true, ..options() }).unwrap_err();
    assert!(matches!(e, Error::DiskFull { .. }), "{e}");
    assert!(e.to_string().contains("resume the run") && e.to_string().contains(&*dir.path().to_string_lossy()), "{e}");
}

#[test]
fn our_recordings_are_an_input_too() {
    let dir = tempfile::tempdir().unwrap();
    let path = write(&dir.path().join("out.mcap"), 8, 3);
    let expect: Vec<_> = (0..8).map(frame).filter_map(|f| Some((f.row.time_s, f.image?))).collect();
    let check = |path: &Path, n: usize| {
        let mut images = ImageReader::open(path, None).unwrap();
        let got: Vec<_> = images.by_ref().map(Result::unwrap).collect();
        assert_eq!((got.len(), images.broken()), (n, None));
        for (a, (time_s, image)) in got.iter().zip(&expect) {
            assert!((a.time_s.unwrap() - time_s.unwrap()).abs() < 1e-6);
            assert_eq!(a.image.as_ref(), Ok(image));
        }
    };
    check(&path, expect.len());
    let bytes = fs::read(&path).unwrap();
    let cut = dir.path().join("cut.mcap");
    fs::write(&cut, &bytes[..bytes.len() / 2]).unwrap();
    let mut images = ImageReader::open(&cut, None).unwrap();
    assert!(images.by_ref().map(Result::unwrap).count() < expect.len());
    assert_eq!(images.broken(), Some("was cut off"));
    let mut damaged = bytes.clone();
    damaged[bytes.len() / 2] ^= 1;
    fs::write(&cut, damaged).unwrap();
    let mut images = ImageReader::open(&cut, None).unwrap();
    assert!(images.by_ref().map(Result::unwrap).count() < expect.len());
    assert!(images.broken().unwrap().starts_with("is damaged ("), "{:?}", images.broken());
    assert_eq!(ImageReader::open(&path, Some("/nothing")).unwrap().count(), 0);
}

#[test]
fn raw_pictures_are_on_the_same_topic() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("out.mcap");
    let mut record = frame(2);
    record.image = Some(EncodedImage { format: ImageFormat::Mono16 { width: 2, height: 1 }, bytes: vec![1, 2, 3, 4] });
    let mut writer = Writer::create(&path, &options()).unwrap();
    writer.write(&record).unwrap();
    writer.finish().unwrap();
    assert_eq!(read(&path), [record.clone()]);
    let images: Vec<_> = ImageReader::open(&path, None).unwrap().map(|i| i.unwrap().image.unwrap()).collect();
    assert_eq!(Some(&images[0]), record.image.as_ref());
}

#[test]
fn frames_are_finished_within_the_interval() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("out.mcap");
    let mut writer = Writer::create(&path, &options()).unwrap();
    writer.write(&frame(0)).unwrap();
    assert_eq!(read(writer.part()).len(), 0);
    std::thread::sleep(hzn_mcap::FLUSH_INTERVAL);
    writer.flush_if_due().unwrap();
    assert_eq!(read(writer.part()).len(), 1);
}

#[test]
fn any_picture_is_found_by_its_place() {
    let dir = tempfile::tempdir().unwrap();
    let path = write(&dir.path().join("out.mcap"), 11, 3);
    let (pictures, rows, found) = index(&path);
    assert!(found.is_complete());
    assert_eq!(found.sensor_toml(), Some(SENSOR));
    assert_eq!(rows, (0..11).map(frame).map(|f| (f.row, f.prior)).collect::<Vec<_>>());
    let mut reader = found.pictures().unwrap();
    // Backwards, because any order must work.
    for place in pictures.iter().rev() {
        let expect = frame(place.sequence().into());
        let image = reader.read(place).unwrap();
        assert_eq!(image.image.ok(), expect.image);
        assert!((image.time_s.unwrap() - expect.row.time_s.unwrap()).abs() < 1e-6);
    }
    let with_picture = (0..11).filter(|&i| frame(i).image.is_some()).count();
    assert_eq!(pictures.len(), with_picture);
}

#[test]
fn a_cut_recording_is_indexed_as_far_as_it_goes() {
    let dir = tempfile::tempdir().unwrap();
    let bytes = fs::read(write(&dir.path().join("out.mcap"), 9, 3)).unwrap();
    let cut = dir.path().join("cut.mcap");
    let mut last = 0;
    for n in (8..bytes.len()).step_by(131) {
        fs::write(&cut, &bytes[..n]).unwrap();
        let (pictures, rows, found) = index(&cut);
        assert_eq!(
            rows.iter().map(|(row, _)| row.index).collect::<Vec<_>>(),
            (0..rows.len() as u64).collect::<Vec<_>>()
        );
        assert!(rows.len() >= last, "cut at {n}");
        last = rows.len();
        let mut reader = found.pictures().unwrap();
        assert!(pictures.iter().all(|place| reader.read(place).unwrap().image.is_ok()), "cut at {n}");
    }
    assert_eq!(last, 9);
    fs::write(&cut, b"no recording at all").unwrap();
    assert!(matches!(Index::open(&cut), Err(Error::NotMcap { .. })));
}
