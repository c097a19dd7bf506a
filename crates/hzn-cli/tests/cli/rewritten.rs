//! Recordings that another program has written again, through the commands that read recordings.

use std::fs;
use std::io::BufWriter;

use crate::common::{Place, without_time};
use mcap::{Compression, WriteOptions};

const TRUTH: &str = "file,time_s,body,limb,axis_x,axis_y,axis_z,half_angle_deg,altitude_km,sun_x,sun_y,sun_z,moon_x,\
                     moon_y,moon_z,qw,qx,qy,qz\n";

/// Returns a folder with the recording of six pictures, `ours.mcap`, its table `ours.csv`, and the truth.
fn place() -> Place {
    let place = Place::with_pictures(6);
    let mut truth = TRUTH.to_owned();
    for i in 0..6 {
        let (sin, cos) = (68.0 + 0.05 * f64::from(i)).to_radians().sin_cos();
        truth.push_str(&format!("{i:04}.png,{i},earth-sphere,1,0,{sin},{cos},70.38,400,,,,,,,1,0,0,0\n"));
    }
    place.write("truth.csv", truth.as_bytes());
    place.run(&["run", "in", "-o", "ours.mcap", "-q"]).expect(0);
    place.run(&["export", "ours.mcap", "-o", "ours.csv", "--images", "ours"]).expect(0);
    assert_eq!(place.rows("ours.csv").len(), 6);
    place
}

/// The way in which a recording is written again.
#[derive(Clone, Copy, PartialEq)]
enum Change {
    Nothing,
    /// The sensor.toml is left out.
    NoSensor,
    /// The schema of the reports is left out.
    NoSchema,
}

/// Writes `ours.mcap` again as `theirs.mcap`.
fn rewrite(place: &Place, options: WriteOptions, change: Change) {
    let bytes = fs::read(place.path("ours.mcap")).unwrap();
    let file = BufWriter::new(fs::File::create(place.path("theirs.mcap")).unwrap());
    let mut writer = options.create(file).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    for index in summary.attachment_indexes.iter().filter(|_| change != Change::NoSensor) {
        writer.attach(&mcap::read::attachment(&bytes, index).unwrap()).unwrap();
    }
    for index in &summary.metadata_indexes {
        writer.write_metadata(&mcap::read::metadata(&bytes, index).unwrap()).unwrap();
    }
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let mut message = message.unwrap();
        if change == Change::NoSchema && message.channel.topic == "/hzn/report" {
            message.channel = std::sync::Arc::new(mcap::Channel { schema: None, ..(*message.channel).clone() });
        }
        writer.write(&message).unwrap();
    }
    writer.finish().unwrap();
}

#[test]
fn every_command_reads_what_another_program_wrote_again() {
    let place = place();
    let told = |command: &[&str], file: &str| place.run(&[command, &[file]].concat()).expect(0).out;
    for compression in [None, Some(Compression::Zstd), Some(Compression::Lz4)] {
        for chunks in [true, false] {
            let options = || WriteOptions::new().compression(compression).use_chunks(chunks);
            rewrite(&place, options(), Change::Nothing);
            place.run(&["export", "theirs.mcap", "-o", "theirs.csv", "--force"]).expect(0).says("6 rows");
            assert_eq!(place.read("theirs.csv"), place.read("ours.csv"), "{compression:?} {chunks}");
            let pictures = ["export", "theirs.mcap", "--images", "theirs", "--force"];
            place.run(&pictures).expect(0).says("6 pictures");
            for picture in ["0000.png", "0005.png"] {
                let bytes = |folder: &str| fs::read(place.path(folder).join(picture)).unwrap();
                assert_eq!(bytes("theirs"), bytes("ours"), "{compression:?} {chunks}");
            }
            for command in [&["info"][..], &["evaluate", "--truth", "truth.csv"]] {
                assert_eq!(told(command, "theirs.mcap").replace("theirs", "ours"), told(command, "ours.mcap"));
            }
            place.run(&["recover", "theirs.mcap", "-o", "closed.mcap", "--force"]).expect(0).says("6 rows kept");
            place.run(&["export", "closed.mcap", "-o", "closed.csv", "--force"]).expect(0);
            assert_eq!(place.read("closed.csv"), place.read("ours.csv"), "{compression:?} {chunks}");
            // The recording is run again; without its sensor.toml it is one with image topics.
            let again = without_time(&place.run(&["run", "theirs.mcap"]).expect(0).out);
            assert_eq!(again, without_time(&place.read("ours.csv")), "{compression:?} {chunks}");
            rewrite(&place, options(), Change::NoSensor);
            let pictures =
                place.run(&["run", "theirs.mcap", "-s", "in/sensor.toml"]).expect(0).says("6 pictures: 6 ok");
            assert_eq!(without_time(&pictures.out).len(), 6);
        }
    }
}

/// The commands that read recordings, with arguments for one whose results they cannot read.
const READING: [&[&str]; 6] = [
    &["export", "theirs.mcap", "-o", "rows.csv", "--force"],
    &["info", "theirs.mcap"],
    &["evaluate", "theirs.mcap", "--truth", "truth.csv"],
    &["fuse", "--nadir", "theirs.mcap", "--imu", "imu.csv", "--gnss", "gnss.csv", "-o", "nav.csv"],
    &["recover", "theirs.mcap", "-o", "closed.mcap", "--force"],
    &["run", "theirs.mcap", "-o", "again.csv", "--force"],
];

/// Writes `ours.mcap` again as `theirs.mcap`, with the name of a compression that does not exist.
fn write_unknown(place: &Place, change: Change) {
    rewrite(place, WriteOptions::new().compression(Some(Compression::Lz4)), change);
    let mut bytes = fs::read(place.path("theirs.mcap")).unwrap();
    let at = bytes.windows(7).position(|w| w == b"\x03\0\0\0lz4").unwrap();
    bytes[at + 4..at + 7].copy_from_slice(b"lzx");
    place.write("theirs.mcap", &bytes);
}

#[test]
fn an_unknown_compression_is_named_by_every_command() {
    let place = place();
    write_unknown(&place, Change::Nothing);
    let remedy = "\"lzx\"";
    for args in READING {
        // Without a picture, a run does not begin.
        let code = if args[0] == "run" { 2 } else { 3 };
        place.run(args).expect(code).says(remedy).says("with zstd, with lz4 or without compression");
    }
    assert!(!place.path("closed.mcap").exists());
    // A recovery writes nothing, and removes nothing.
    fs::copy(place.path("theirs.mcap"), place.path("lost.mcap.part")).unwrap();
    place.run(&["recover", "lost.mcap.part"]).expect(3).says(remedy);
    assert!(place.path("lost.mcap.part").exists() && !place.path("lost.mcap").exists());
    place.run(&["run", "theirs.mcap"]).expect(2).says("no picture is left").says(remedy);
    write_unknown(&place, Change::NoSensor);
    place.run(&["run", "theirs.mcap", "-s", "in/sensor.toml"]).expect(2).says("no pictures").says(remedy);
    place.run(&["info", "theirs.mcap"]).expect(3).says(remedy);
}

#[test]
fn reports_that_cannot_be_read_are_no_empty_recording() {
    let place = place();
    for chunks in [true, false] {
        rewrite(&place, WriteOptions::new().use_chunks(chunks), Change::NoSchema);
        for args in READING {
            place.run(args).expect(3).says("6 messages on /hzn/report cannot be read as results");
        }
        assert!(place.rows("rows.csv").is_empty());
    }
    // A recovery keeps the messages, and counts none of them as a row. The file that it read stays.
    fs::copy(place.path("theirs.mcap"), place.path("lost.mcap.part")).unwrap();
    place.run(&["recover", "lost.mcap.part"]).expect(3).says("lost.mcap: 0 rows kept");
    assert!(place.path("lost.mcap.part").exists());
    for args in [&["export", "lost.mcap", "-o", "lost.csv"][..], &["recover", "lost.mcap", "-o", "again.mcap"]] {
        place.run(args).expect(3).says("0 rows").says("6 messages on /hzn/report cannot be read as results");
    }
}

#[test]
fn a_recovery_that_keeps_nothing_keeps_the_file() {
    let place = place();
    let mut bytes = fs::read(place.path("ours.mcap")).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    for chunk in &summary.chunk_indexes {
        // A byte in the middle of the chunk's data.
        bytes[(chunk.chunk_start_offset + chunk.chunk_length / 2) as usize] ^= 0x55;
    }
    place.write("all.mcap.part", &bytes);
    place.run(&["recover", "all.mcap.part"]).expect(3).says("no result is left, because the file has");
    assert!(place.path("all.mcap.part").exists() && !place.path("all.mcap").exists());
    assert!(!place.path("all.recovering.mcap").exists());
}
