//! The times of the pictures of a bag: one clock in one table.

use std::fs;

use crate::common::ros::{self, Stamp, compressed_image, raw_image};
use crate::common::{Place, SENSOR, cell, limb};

const IMAGE: &str = "/front/image_raw";
const SECOND: u64 = 1_000_000_000;
/// A log time that no stamp is near to.
const LOG: u64 = 9 * SECOND;

fn place() -> Place {
    let place = Place::new();
    place.write("sensor.toml", SENSOR.as_bytes());
    place
}

/// Runs a recording into r.csv, and returns time, status and detail of each row.
fn rows(place: &Place, code: i32) -> (Vec<(String, String, String)>, String) {
    let ran = place.run(&["run", "b.mcap", "-s", "sensor.toml", "-o", "r.csv", "--force"]).expect(code);
    let of = |row: &Vec<(String, String)>| {
        let [time, status, detail] = ["time_s", "status", "detail"].map(|name| cell(row, name).to_owned());
        (time, status, detail)
    };
    (place.rows("r.csv").iter().map(of).collect(), ran.err)
}

#[test]
fn a_picture_that_cannot_be_decoded_has_its_stamp() {
    let place = place();
    let picture = |i: u32| limb(320, 240, f64::from(i));
    let at = |i: u32| (1_700_000_000 + i, 250_000_000);
    let mut short = raw_image(at(2), "mono8", &picture(2));
    short.truncate(short.len() - 100);
    // Cut behind the stamp, in the name of the frame, and within the stamp.
    let [mut unnamed, mut without] = [3, 4].map(|i| raw_image(at(i), "mono8", &picture(i)));
    unnamed.truncate(14);
    without.truncate(10);
    let messages = [raw_image(at(0), "mono8", &picture(0)), raw_image(at(1), "mono9", &picture(1)), short, unnamed];
    let messages = messages.into_iter().chain([without, raw_image(at(5), "mono8", &picture(5))]);
    let logged = |(i, data)| (LOG + i as u64, IMAGE, "Image", data);
    ros::write(&place.path("b.mcap"), &messages.enumerate().map(logged).collect::<Vec<_>>());
    let (found, err) = rows(&place, 3);
    let expected = [
        ("1700000000.25", "ok", ""),
        ("1700000001.25", "unreadable", "raw pictures of encoding \"mono9\" are not supported"),
        ("1700000002.25", "unreadable", "the message ends too early"),
        ("1700000003.25", "unreadable", "the message ends too early"),
        ("9.000000004", "unreadable", "the header cannot be read either, so the time is that of the log"),
        ("1700000005.25", "ok", ""),
    ];
    assert_eq!(found.len(), expected.len(), "{err}");
    for ((time, status, detail), (wanted, what, why)) in found.iter().zip(expected) {
        assert_eq!((time.as_str(), status.as_str()), (wanted, what), "{detail}");
        assert!(detail.contains(why), "{detail}");
        assert!(!detail.contains("that of the log") || why.contains("that of the log"), "{detail}");
    }
    // A compressed picture whose bytes are damaged.
    let png = ros::png(&picture(0));
    let messages = [&png[..], &png[..png.len() / 2], b"JFIF"].into_iter().enumerate();
    let logged = |(i, data): (usize, &[u8])| {
        (LOG + i as u64, IMAGE, "CompressedImage", compressed_image(at(i as u32), "front_optical", data))
    };
    ros::write(&place.path("b.mcap"), &messages.map(logged).collect::<Vec<_>>());
    let (found, _) = rows(&place, 3);
    let found: Vec<_> = found.iter().map(|(time, status, _)| (time.as_str(), status.as_str())).collect();
    let unreadable = "unreadable";
    assert_eq!(found, [("1700000000.25", "ok"), ("1700000001.25", unreadable), ("1700000002.25", unreadable)]);
}

/// Writes pictures with these stamps, one second of the log after another.
fn write(place: &Place, name: &str, first: u64, stamps: &[Stamp]) {
    let message = |(i, stamp): (usize, &Stamp)| {
        let data = raw_image(*stamp, "mono8", &limb(320, 240, (first + i as u64) as f64));
        (LOG + (first + i as u64) * SECOND, IMAGE, "Image", data)
    };
    ros::write(&place.path(name), &stamps.iter().enumerate().map(message).collect::<Vec<_>>());
}

fn times(place: &Place) -> (Vec<String>, String) {
    let (found, err) = rows(place, 0);
    assert!(found.iter().all(|(_, status, _)| status == "ok"), "{found:?}");
    (found.into_iter().map(|(time, ..)| time).collect(), err)
}

#[test]
fn the_log_time_stands_for_stamps_that_nobody_filled_in() {
    let note = "the stamps in the headers of /front/image_raw are 0, so the times are those of the log";
    let place = place();
    write(&place, "b.mcap", 0, &[(0, 0); 3]);
    let (found, err) = times(&place);
    assert_eq!((found, err.matches(note).count()), (["9.0", "10.0", "11.0"].map(str::to_owned).to_vec(), 1), "{err}");
    let out = place.run(&["info", "b.mcap"]).expect(0).out;
    assert!(out.contains("time             9.000 to 11.000 s") && out.contains(note), "{out}");
    // A bag has one clock, whatever is in its second recording.
    fs::create_dir(place.path("bag")).unwrap();
    place.write("bag/metadata.yaml", b"rosbag2_bagfile_information:\n");
    write(&place, "bag/bag_0.mcap", 0, &[(0, 0); 2]);
    write(&place, "bag/bag_1.mcap", 2, &[(1_700_000_000, 0); 1]);
    let ran = place.run(&["run", "bag", "-s", "sensor.toml", "-o", "bag.csv"]).expect(0).says(note);
    assert_eq!(ran.err.matches(note).count(), 1, "{}", ran.err);
    let found: Vec<_> = place.rows("bag.csv").iter().map(|row| cell(row, "time_s").to_owned()).collect();
    assert_eq!(found, ["9.0", "10.0", "11.0"]);
    // With stamps there is nothing to say.
    write(&place, "b.mcap", 0, &[(5, 0), (6, 0)]);
    assert!(!times(&place).1.contains("the stamps"));
}

#[test]
fn a_picture_before_the_clock_has_no_time() {
    let place = place();
    write(&place, "b.mcap", 0, &[(0, 0), (0, 0), (100, 500_000_000), (101, 0), (0, 0)]);
    let (found, err) = times(&place);
    assert_eq!(found, ["", "", "100.5", "101.0", ""]);
    assert!(err.contains("of 5 pictures: 3 without a time"), "{err}");
    // A message of ROS with the stamp of another picture would be wrong.
    place.run(&["run", "b.mcap", "-s", "sensor.toml", "--ros", "-o", "r.mcap"]).expect(0);
    let bytes = fs::read(place.path("r.mcap")).unwrap();
    let of_ros = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap);
    let of_ros = of_ros.filter(|m| ["/hzn/axis_vector", "/hzn/axis_covariance"].contains(&m.channel.topic.as_str()));
    let times: Vec<u64> = of_ros.map(|message| message.log_time).collect();
    assert_eq!(times, [100_500_000_000, 100_500_000_000, 101 * SECOND, 101 * SECOND]);
    let out = place.run(&["info", "b.mcap"]).expect(0).out;
    assert!(out.contains("time             100.500 to 101.000 s"), "{out}");
}

#[test]
fn instruments_without_stamps_have_log_times() {
    let place = Place::new();
    let imu = |stamp: Stamp| {
        let mut message = ros::stamped(stamp, "imu_link");
        ros::push_numbers(&mut message, &[0.0, 0.0, 0.0, 1.0]);
        ros::push_numbers(&mut message, &[0.0; 9]);
        ros::push_numbers(&mut message, &[0.1, 0.2, 0.3]);
        ros::push_numbers(&mut message, &[0.0; 9]);
        ros::push_numbers(&mut message, &[9.5, 0.0, 0.0]);
        ros::push_numbers(&mut message, &[0.0; 9]);
        message
    };
    let first_columns = |stamps: [Stamp; 3]| {
        let logged = |(i, stamp)| (LOG + i as u64 * SECOND, "/imu", "Imu", imu(stamp));
        ros::write(&place.path("b.mcap"), &stamps.into_iter().enumerate().map(logged).collect::<Vec<_>>());
        let ran = place.run(&["export", "b.mcap", "--imu", "imu.csv", "--force"]).expect(0);
        let rows: Vec<_> = place.rows("imu.csv").iter().map(|row| cell(row, "time_s").to_owned()).collect();
        (rows, ran.err)
    };
    let (found, err) = first_columns([(0, 0); 3]);
    assert_eq!(found, ["9.000000000", "10.000000000", "11.000000000"]);
    assert!(err.contains("/imu: the stamps in the headers are all 0, so the times are those of the log"), "{err}");
    let (found, err) = first_columns([(0, 0), (5, 0), (6, 0)]);
    assert_eq!(found, ["5.000000000", "6.000000000"]);
    assert!(err.contains("1 message of /imu have the stamp 0 while others have a time, and were left out"), "{err}");
}
