//! Bags of ROS 2: the stamps and frames of their pictures.

use std::fs;
use std::path::Path;

use crate::common::ros::{self, compressed_image, push_numbers, stamped};
use crate::common::{Place, SENSOR, limb};

/// Stamps whose nanoseconds no number of seconds in double precision has.
const STAMPS: [(u32, u32); 3] = [(1_700_000_069, 487_179_487), (1_700_000_069, 520_000_001), (1_700_000_070, 3)];
const FRAME: &str = "front_optical";

/// Writes a bag whose log times are not the stamps.
fn write_bag(path: &Path, frame: &str) {
    let message = |(i, stamp)| {
        let picture = ros::png(&limb(320, 240, i as f64));
        (9_000_000_000 + i as u64, "/front/compressed", "CompressedImage", compressed_image(stamp, frame, &picture))
    };
    ros::write(path, &STAMPS.into_iter().enumerate().map(message).collect::<Vec<_>>());
}

fn place(frame: &str) -> Place {
    let place = Place::new();
    fs::create_dir(place.path("bag")).unwrap();
    place.write("bag/metadata.yaml", b"rosbag2_bagfile_information:\n  version: 9\n");
    write_bag(&place.path("bag/bag_0.mcap"), frame);
    place.write("sensor.toml", SENSOR.as_bytes());
    place
}

#[test]
fn a_folder_of_recordings_that_is_no_bag_names_one() {
    let place = place("camera");
    fs::remove_file(place.path("bag/metadata.yaml")).unwrap();
    let ran = place.run(&["run", "bag", "--sensor", "sensor.toml"]).expect(2);
    ran.says("give one of them, such as bag/bag_0.mcap").says("ros2 bag reindex");
}

/// A message of ROS in a recording of hzn: seconds, nanoseconds, log time and frame.
type Stamped = (u32, u32, u64, String);

/// Returns the headers of all axes in a recording.
fn axes(path: &Path) -> Vec<Stamped> {
    let bytes = fs::read(path).unwrap();
    let messages = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap);
    let word = |data: &[u8], at: usize| u32::from_le_bytes(*data[at..].first_chunk().unwrap());
    let read = |m: mcap::Message<'_>| {
        let length = word(&m.data, 12) as usize;
        let frame = String::from_utf8(m.data[16..16 + length - 1].to_vec()).unwrap();
        (word(&m.data, 4), word(&m.data, 8), m.log_time, frame)
    };
    messages.filter(|m| m.channel.topic == "/hzn/axis_vector").map(read).collect()
}

fn expected(frame: &str) -> Vec<Stamped> {
    STAMPS.map(|(s, ns)| (s, ns, u64::from(s) * 1_000_000_000 + u64::from(ns), frame.to_owned())).to_vec()
}

#[test]
fn the_stamps_and_the_frame_of_a_bag_are_those_of_its_pictures() {
    let place = place(FRAME);
    place.run(&["run", "bag", "-s", "sensor.toml", "--ros", "-o", "r.mcap", "-o", "r.csv"]).expect(0);
    assert_eq!(axes(&place.path("r.mcap")), expected(FRAME));
    // The covariance has no header: its log time is the stamp.
    let bytes = fs::read(place.path("r.mcap")).unwrap();
    let all = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap);
    let times: Vec<u64> = all.filter(|m| m.channel.topic == "/hzn/axis_covariance").map(|m| m.log_time).collect();
    assert_eq!(times, expected(FRAME).iter().map(|axis| axis.2).collect::<Vec<_>>());
    // A recording of hzn that is processed again has the same times; it does not have the name of the frame.
    place.run(&["run", "r.mcap", "--ros", "-o", "again.mcap"]).expect(0);
    assert_eq!(axes(&place.path("again.mcap")), expected("camera"));
    // Without a name in the header the frame is hzn's own.
    let unnamed = self::place("");
    unnamed.run(&["run", "bag", "-s", "sensor.toml", "--ros", "-o", "r.mcap"]).expect(0);
    assert_eq!(axes(&unnamed.path("r.mcap")), expected("camera"));
}

#[test]
fn a_bag_in_sqlite_is_converted_by_its_folder() {
    let place = Place::new();
    fs::create_dir(place.path("old")).unwrap();
    fs::create_dir(place.path("old bag")).unwrap();
    place.write("old/old_0.db3", b"SQLite format 3\0");
    place.write("old/metadata.yaml", b"rosbag2_bagfile_information:\n");
    for command in ["run", "info", "init"] {
        for input in ["old/old_0.db3", "old"] {
            let ran = place
                .run(&[command, input])
                .expect(2)
                .says("rosbags-convert --src old --dst converted --dst-storage mcap; with ROS 2: ");
            ran.says(
                "[{uri: converted, storage_id: mcap, all: true}]' > mcap.yaml && ros2 bag convert -i old -o mcap.yaml",
            );
        }
    }
    place.write("old bag/a.db3", b"SQLite format 3\0");
    place.run(&["run", "old bag/a.db3"]).expect(2).says("--src 'old bag' --dst").says("-i 'old bag' -o");
    place.write("old.bag", b"#ROSBAG V2.0\n");
    let ran = place.run(&["run", "old.bag"]).expect(2).says("rosbags-convert --src old.bag --dst");
    assert!(!ran.err.contains("ros2 bag"), "ROS 2 does not convert bags of ROS 1: {}", ran.err);
}

#[test]
fn times_of_a_table_replace_the_stamps_of_a_bag() {
    let place = place(FRAME);
    let line = |i: usize| format!("bag_0.mcap#{i:06},{}.5\n", 100 + i);
    let table = format!("file,time_s\n{}", (0..STAMPS.len()).map(line).collect::<String>());
    place.write("frames.csv", table.as_bytes());
    place.run(&["run", "bag", "-s", "sensor.toml", "--frames", "frames.csv", "--ros", "-o", "r.mcap"]).expect(0);
    let times: Vec<u64> = axes(&place.path("r.mcap")).iter().map(|axis| axis.2).collect();
    assert_eq!(times, [100_500_000_000, 101_500_000_000, 102_500_000_000]);
}

#[test]
fn info_knows_a_bag_a_rig_and_the_settings_of_a_filter() {
    let place = place(FRAME);
    let out = place.run(&["info", "bag"]).expect(0).out;
    assert!(out.contains("bag of ROS 2") && out.contains("pictures         3\n"), "{out}");
    assert!(out.contains("time             1700000069.487 to 1700000070.000 s"), "{out}");
    let head = |name: &str| {
        format!(
            "[[head]]\nname = \"{name}\"\npictures = \"{name}\"\n[head.mount]\nq_rig_from_camera_wxyz = [1, 0, 0, 0]\n"
        )
    };
    place.write("rig.toml", format!("{}{}", head("left"), head("right")).as_bytes());
    let out = place.run(&["info", "rig.toml"]).expect(0).out;
    assert!(out.contains("rig.toml, several cameras") && out.contains("right, pictures right"), "{out}");
    place.write("fuse.toml", b"gate_probability = 0.01\n");
    let out = place.run(&["info", "fuse.toml"]).expect(0).out;
    assert!(out.contains("fuse.toml, for `hzn fuse --config FILE`") && out.contains("gate_probability"), "{out}");
    // A wrong value is still an error that names the key.
    place.write("fuse.toml", b"gate_probability = 2.0\n");
    place.run(&["info", "fuse.toml"]).expect(2).says("gate_probability");
}

#[test]
fn an_altitude_that_a_table_replaces_is_told() {
    let place = Place::with_pictures(2);
    place.write("in/frames.csv", b"file,altitude_km\n0000.png,400\n0001.png,400\n");
    let what = "--altitude-km is not used: in/frames.csv has an altitude for every picture";
    place.run(&["run", "in", "--altitude-km", "500"]).expect(0).says(what);
    assert!(!place.run(&["run", "in"]).expect(0).err.contains(what));
    // A picture without a row, or without an altitude in it, takes that of the command line.
    place.write("in/frames.csv", b"file,altitude_km\n0000.png,400\n");
    assert!(!place.run(&["run", "in", "--altitude-km", "500"]).expect(0).err.contains(what));
    place.write("in/frames.csv", b"file,altitude_km\n0000.png,400\n0001.png,\n");
    assert!(!place.run(&["run", "in", "--altitude-km", "500"]).expect(0).err.contains(what));
}

#[test]
fn an_empty_stream_of_telemetry_is_an_error() {
    let place = Place::new();
    place.write("empty.bin", b"");
    place.run(&["telemetry", "empty.bin", "-o", "e.csv"]).expect(1).says("empty.bin: is empty");
    assert!(!place.path("e.csv").exists());
}

/// Returns a `sensor_msgs/msg/Imu`. `known` is the first number of the covariance of the rates.
fn imu(stamp: (u32, u32), gyro: [f64; 3], accel: [f64; 3], known: f64) -> Vec<u8> {
    let mut message = stamped(stamp, "imu_link");
    push_numbers(&mut message, &[0.0, 0.0, 0.0, 1.0]);
    push_numbers(&mut message, &[-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    push_numbers(&mut message, &gyro);
    push_numbers(&mut message, &[known, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 0.1]);
    push_numbers(&mut message, &accel);
    push_numbers(&mut message, &[0.0; 9]);
    message
}

/// Returns a `sensor_msgs/msg/NavSatFix`.
fn fix(stamp: (u32, u32), status: i8, place: [f64; 3], variances: Option<[f64; 3]>) -> Vec<u8> {
    let mut message = stamped(stamp, "gps");
    message.extend([status as u8, 0, 1, 0]);
    push_numbers(&mut message, &place);
    let [xx, yy, zz] = variances.unwrap_or_default();
    push_numbers(&mut message, &[xx, 0.0, 0.0, 0.0, yy, 0.0, 0.0, 0.0, zz]);
    message.push(u8::from(variances.is_some()));
    message
}

/// Writes a bag with messages of instruments: topic, type and message.
fn write_instruments(path: &Path, messages: &[(&'static str, &'static str, Vec<u8>)]) {
    let logged = |(i, (topic, kind, data)): (usize, &(&'static str, &'static str, Vec<u8>))| {
        (9_000_000_000 + i as u64, *topic, *kind, data.clone())
    };
    ros::write(path, &messages.iter().enumerate().map(logged).collect::<Vec<_>>());
}

#[test]
fn instruments_of_a_bag_become_tables_for_fuse() {
    let place = Place::new();
    let (gyro, accel) = ([0.1, -0.2, 0.3], [9.5, 0.25, -1e-3]);
    let mut short = imu(STAMPS[2], gyro, accel, 0.0);
    short.truncate(200);
    let messages = [
        ("/imu", "Imu", imu(STAMPS[0], gyro, accel, 0.1)),
        ("/gps", "NavSatFix", fix(STAMPS[0], -1, [0.0; 3], None)),
        ("/imu", "Imu", imu(STAMPS[1], gyro, accel, -1.0)),
        ("/gps", "NavSatFix", fix(STAMPS[1], 0, [47.5, 8.25, 512.0], Some([4.0, 9.0, 25.0]))),
        ("/gps", "NavSatFix", fix(STAMPS[2], 2, [-47.5, -8.25, 1e5], None)),
        ("/gps", "NavSatFix", fix((0, 0), 2, [-47.5, -8.25, 1e5], None)),
        ("/imu", "Imu", short),
    ];
    fs::create_dir(place.path("bag")).unwrap();
    place.write("bag/metadata.yaml", b"rosbag2_bagfile_information:\n  version: 9\n");
    write_instruments(&place.path("bag/bag_0.mcap"), &messages);
    let ran = place.run(&["export", "bag", "--imu", "imu.csv", "--gnss", "gnss.csv"]).expect(0);
    for words in [
        "about the axes of the frame imu_link",
        "1 message of /gps have no fix",
        "1 message of /gps have the stamp 0 while others have a time",
        "gnss.csv: 2 rows of /gps",
    ] {
        assert!(ran.err.contains(words), "{words} in {}", ran.err);
    }
    let imu_csv = place.read("imu.csv");
    let lines: Vec<&str> = imu_csv.lines().collect();
    assert_eq!(lines[0], "time_s,gyro_x_radps,gyro_y_radps,gyro_z_radps,accel_x_mps2,accel_y_mps2,accel_z_mps2");
    // The stamp has all its digits; rates that the message does not have are empty.
    assert_eq!(
        lines[1..],
        ["1700000069.487179487,0.1,-0.2,0.3,9.5,0.25,-0.001", "1700000069.520000001,,,,9.5,0.25,-0.001"]
    );
    let gnss_csv = place.read("gnss.csv");
    let rows = ["1700000069.520000001,47.5,8.25,512,3,5", "1700000070.000000003,-47.5,-8.25,100000,,"];
    assert_eq!(gnss_csv.lines().skip(1).collect::<Vec<_>>(), rows);
    let read = hzn_fuse::input::gnss(&place.path("gnss.csv"), &hzn_fuse::input::Map::default(), None).unwrap();
    assert!(read.fixes[0].position_sigma_m == 5.0 && read.fixes[1].position_sigma_m.is_nan());
    // Nothing is replaced, and nothing else is written beside these tables.
    place.run(&["export", "bag", "--imu", "imu.csv"]).expect(2).says("exists already");
    place.run(&["export", "bag", "--imu", "i.csv", "-o", "t.csv"]).expect(2).says("recordings of ROS 2");
    // A recording without its end gives what comes before.
    let bytes = fs::read(place.path("bag/bag_0.mcap")).unwrap();
    place.write("cut.mcap", &bytes[..bytes.len() / 2]);
    let cut = place.run(&["export", "cut.mcap", "--imu", "cut.csv"]);
    assert!(cut.code != 0, "{}", cut.err);
    place.run(&["export", "none.db3", "--imu", "cut.csv", "--force"]).expect(2).says("no such file");
}

#[test]
fn one_of_several_instruments_is_chosen() {
    let place = Place::new();
    let (gyro, accel) = ([0.1, -0.2, 0.3], [9.5, 0.25, -1e-3]);
    let two =
        [("/a/imu", "Imu", imu(STAMPS[0], gyro, accel, 0.0)), ("/b/imu", "Imu", imu(STAMPS[1], accel, gyro, 0.0))];
    write_instruments(&place.path("two.mcap"), &two);
    let export = ["export", "two.mcap", "--imu", "two.csv"];
    place
        .run(&export)
        .expect(2)
        .says("several topics have sensor_msgs/msg/Imu: /a/imu, /b/imu; choose one with --topic");
    place.run(&[&export[..], &["--topic", "/c"]].concat()).expect(2).says("there are /a/imu, /b/imu");
    place.run(&[&export[..], &["--topic", "/b/imu"]].concat()).expect(0);
    assert!(place.read("two.csv").contains("1700000069.520000001,9.5,"));
    place
        .run(&["export", "two.mcap", "--gnss", "g.csv"])
        .expect(1)
        .says("there are no messages sensor_msgs/msg/NavSatFix");
}

#[test]
fn the_pictures_of_a_bag_become_files() {
    let place = place(FRAME);
    for input in ["bag", "bag/bag_0.mcap"] {
        let out = format!("out-{}", input.len());
        let ran = place.run(&["export", input, "--images", &out]).expect(0);
        assert!(format!("{}{}", ran.out, ran.err).contains("3 pictures"), "{}", ran.err);
        let mut files: Vec<_> = fs::read_dir(place.path(&out)).unwrap().map(|entry| entry.unwrap().path()).collect();
        files.sort();
        assert_eq!(files.len(), 3);
        for (i, file) in files.iter().enumerate() {
            assert_eq!(image::open(file).unwrap().to_luma8(), limb(320, 240, i as f64), "{}", file.display());
        }
        place.run(&["export", input, "--images", &out]).expect(2).says("exists already");
    }
    place.run(&["export", "bag", "-o", "rows.csv"]).expect(2).says("`hzn run bag -o out.csv` makes rows");
}
