//! Pictures in recordings of ROS 2: their clock, their topics, and the calibration beside them.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use hzn_mcap::{Clock, ImageReader, InputImage};
use mcap::records::MessageHeader;

use crate::common::index;

/// Log time of the first message, in nanoseconds.
const LOG_NS: u64 = 9_000_000_000;

/// Returns an `Image` of one pixel.
fn image((s, ns): (i32, u32), encoding: &str) -> Vec<u8> {
    let mut message = vec![0, 1, 0, 0];
    let word = |message: &mut Vec<u8>, word: u32| {
        message.resize(message.len().next_multiple_of(4), 0);
        message.extend_from_slice(&word.to_le_bytes());
    };
    for number in [s as u32, ns, 4] {
        word(&mut message, number);
    }
    message.extend_from_slice(b"cam\0");
    for number in [1, 1, encoding.len() as u32 + 1] {
        word(&mut message, number);
    }
    message.extend_from_slice(format!("{encoding}\0\0").as_bytes());
    for number in [1, 1] {
        word(&mut message, number);
    }
    message.push(7);
    message
}

/// Writes pictures, each one second of the log after the one before and in a chunk of its own.
fn write(path: &Path, messages: &[(&str, Vec<u8>)]) {
    let options = mcap::WriteOptions::new().chunk_size(Some(1));
    let mut writer = options.create(fs::File::create(path).unwrap()).unwrap();
    let schema = writer.add_schema("sensor_msgs/msg/Image", "ros2msg", b"").unwrap();
    // A driver that sent nothing.
    writer.add_channel(schema, "/silent", "cdr", &BTreeMap::new()).unwrap();
    for (i, (topic, data)) in messages.iter().enumerate() {
        let channel_id = writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).unwrap();
        let log_time = LOG_NS + i as u64 * 1_000_000_000;
        let header = MessageHeader { channel_id, sequence: 0, log_time, publish_time: log_time };
        writer.write_to_known_channel(&header, data).unwrap();
    }
    writer.finish().unwrap();
}

fn read(path: &Path) -> (Vec<InputImage>, Option<Clock>) {
    let mut reader = ImageReader::open(path, None).unwrap();
    assert_eq!(reader.clock(), None);
    let images = reader.by_ref().map(Result::unwrap).collect();
    (images, reader.clock())
}

fn times(images: &[InputImage]) -> Vec<Option<f64>> {
    images.iter().map(|image| image.time_s).collect()
}

#[test]
fn pictures_have_the_times_of_one_clock() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.mcap");
    let of = |messages: Vec<Vec<u8>>| {
        write(&path, &messages.into_iter().map(|data| ("/a", data)).collect::<Vec<_>>());
        read(&path)
    };
    let stamped = |stamps: &[(i32, u32)]| of(stamps.iter().map(|stamp| image(*stamp, "mono8")).collect());
    let (images, clock) = stamped(&[(0, 0), (5, 0), (0, 0), (-2, 500_000_000), (6, 1)]);
    assert_eq!(clock, Some(Clock::Stamps));
    assert_eq!(times(&images), [None, Some(5.0), None, Some(-1.5), Some(6.000_000_001)]);
    let stamps: Vec<_> = images.iter().map(|image| image.stamp.as_ref().map(|stamp| stamp.time_ns)).collect();
    assert_eq!(stamps, [None, Some(5_000_000_000), None, None, Some(6_000_000_001)]);
    let (images, clock) = stamped(&[(0, 0); 3]);
    assert_eq!((times(&images), clock), ([9.0, 10.0, 11.0].map(Some).to_vec(), Some(Clock::LogInsteadOfZeros)));
    assert!(images.iter().all(|image| image.stamp.as_ref().unwrap().frame_id.as_deref() == Some("cam")));
    // After sixteen zeros no stamp is expected any more, and the clock stays that of the log.
    let late = |zeros: usize| stamped(&[vec![(0, 0); zeros], vec![(5, 0)]].concat());
    assert_eq!(late(15).1, Some(Clock::Stamps));
    let (images, clock) = late(16);
    assert_eq!((clock, images.last().unwrap().time_s), (Some(Clock::LogInsteadOfZeros), Some(25.0)));
    // A picture that cannot be decoded has the clock of the others; one without a header says that it has not.
    let bad = [image((5, 0), "mono9"), image((6, 0), "mono8")[..45].to_vec(), image((7, 0), "mono8")[..9].to_vec()];
    let (images, clock) = of(bad.into());
    assert_eq!((times(&images), clock), ([5.0, 6.0, 11.0].map(Some).to_vec(), Some(Clock::Stamps)));
    let why: Vec<String> = images.into_iter().map(|image| image.image.unwrap_err()).collect();
    assert!(why[0].contains("mono9") && !why[1].contains("log"), "{why:?}");
    assert!(why[2].ends_with("the header cannot be read either, so the time is that of the log"), "{why:?}");
    // The clock of the recording before it in a bag counts.
    stamped(&[(5, 0)]);
    let mut reader = ImageReader::open(&path, None).unwrap().with_clock(Some(Clock::LogInsteadOfZeros));
    assert_eq!(reader.next().unwrap().unwrap().time_s, Some(9.0));
}

#[test]
fn an_index_has_the_topic_and_the_times_of_the_reader() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.mcap");
    let other = || ("/rear", image((70, 0), "mono8"));
    // Stamps, none of them, a stamp before 0, a picture that cannot be decoded, and one without a header.
    let bad = [image((5, 0), "mono9"), image((7, 0), "mono8")[..9].to_vec()];
    let [decoded, cut] = bad;
    for pictures in [
        vec![image((5, 250_000_000), "mono8"), image((0, 0), "mono8"), image((-2, 500_000_000), "mono8")],
        vec![image((0, 0), "mono8"); 3],
        vec![image((0, 0), "mono8"), image((6, 1), "mono8")],
        vec![decoded, cut],
    ] {
        for others_first in [false, true] {
            let own = pictures.iter().flat_map(|picture| [("/front", picture.clone()), other()]);
            let messages: Vec<_> = others_first.then(other).into_iter().chain(own).collect();
            write(&path, &messages);
            let (images, clock) = read(&path);
            let (places, _, index) = index(&path);
            assert_eq!(index.clock().unwrap(), clock.unwrap());
            let of_index: Vec<_> = places.iter().map(|place| place.time_s(clock.unwrap())).collect();
            assert_eq!((of_index, places.len()), (times(&images), images.len()));
            assert_eq!(images.len(), if others_first { pictures.len() + 1 } else { pictures.len() });
        }
    }
}

#[test]
fn the_summary_names_the_other_topics() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.mcap");
    let picture = || image((5, 0), "mono8");
    write(&path, &[("/front", picture()), ("/rear", picture()), ("/front", picture()), ("/left", picture())]);
    let others = |path: &Path| {
        let mut reader = ImageReader::open(path, None).unwrap();
        reader.next().unwrap().unwrap();
        assert_eq!(reader.topic(), Some("/front"));
        reader.other_topics().map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(others(&path), ["/left", "/rear"]);
    // Without its end, and with a wrong place of the summary, the file is read all the same.
    let whole = fs::read(&path).unwrap();
    let cut = dir.path().join("cut.mcap");
    fs::write(&cut, &whole[..whole.len() - 1]).unwrap();
    assert!(others(&cut).is_empty());
    let place = whole.len() - 8 - 20;
    for wrong in [u64::MAX, whole.len() as u64, 9, 1] {
        let mut bytes = whole.clone();
        bytes[place..place + 8].copy_from_slice(&wrong.to_le_bytes());
        fs::write(&cut, bytes).unwrap();
        assert!(others(&cut).iter().all(|topic| ["/left", "/rear"].contains(&topic.as_str())));
    }
}
