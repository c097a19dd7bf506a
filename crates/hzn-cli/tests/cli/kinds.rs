//! Every kind of file that hzn writes is named by `hzn info`, and where something else is needed.

use crate::common::{Place, SENSOR, limb};

const NEEDED: &str = ", and a picture, a folder or a video is needed here; ";

/// Asserts that a file is named by `hzn info`, which says what it is for, and by `hzn run`.
#[track_caller]
fn assert_named(place: &Place, file: &str, what: &str) {
    let told = place.run(&["info", file]).expect(0).out;
    assert!(told.lines().next().unwrap().ends_with(what), "{file}: {told}");
    let ran = place.run(&["run", file, "--sensor", "in/sensor.toml"]).expect(2);
    assert!(ran.err.contains(&format!("{what}{NEEDED}")), "{file}: {}", ran.err);
}

#[test]
fn a_prepared_sensor_is_described() {
    let place = Place::new();
    for (precision, bits) in [("f32", 32), ("f64", 64)] {
        place.run(&["prepare", "in/sensor.toml", "--precision", precision, "--force"]).expect(0);
        assert_named(&place, "sensor.bin", "a prepared sensor of `hzn prepare`");
        let told = place.run(&["info", "sensor.bin"]).expect(0).out;
        let hash = place.run(&["info", "in/sensor.toml"]).expect(0).out;
        let hash = hash.lines().find_map(|line| line.strip_prefix("hash")).unwrap().trim();
        let hash = hash.split(' ').next().unwrap();
        for line in [
            &format!("numbers          f{bits}"),
            "layout           version 1",
            "altitude         400 +- 0.5 km (earth-sphere)",
            "picture          320 x 240 px",
            &format!("sensor hash      {hash} (that of its sensor.toml)"),
        ] {
            assert!(told.contains(line), "{line:?} in: {told}");
        }
        let json: serde_json::Value =
            serde_json::from_str(&place.run(&["info", "sensor.bin", "--json"]).expect(0).out).unwrap();
        assert_eq!((&json["kind"], &json["camera"]["width"]), (&"prepared-sensor".into(), &320.into()), "{json}");
        let bytes = std::fs::read(place.path("sensor.bin")).unwrap();
        let sum = u32::from_le_bytes(bytes[16..20].try_into().unwrap());
        assert_eq!(json["checksum"], format!("{sum:08x}"));
    }
    // Without an altitude, the flight computer is told one.
    place.write("free.toml", SENSOR.replace("altitude_km = 400.0\n", "").as_bytes());
    place.run(&["prepare", "free.toml", "-o", "free.bin"]).expect(0);
    assert!(place.run(&["info", "free.bin"]).expect(0).out.contains("altitude         not in the sensor"));
    // A changed byte is told, and is no picture.
    let mut bytes = std::fs::read(place.path("free.bin")).unwrap();
    bytes[100] ^= 1;
    place.write("free.bin", &bytes);
    let damaged = place.run(&["info", "free.bin"]).expect(1);
    damaged.says("free.bin: is a prepared sensor of `hzn prepare`, but the checksum is wrong");
}

#[test]
fn files_of_a_flight_computer_are_named() {
    let place = Place::new();
    place.run(&["telecommand", "ping", "mode flight", "-o", "commands.bin"]).expect(0);
    assert_named(&place, "commands.bin", "a stream of telecommands for a flight computer");
    assert!(place.run(&["info", "commands.bin"]).expect(0).out.contains("packets          2, by their sync markers"));
    // The same packets as telemetry, after noise of the line.
    let mut bytes = std::fs::read(place.path("commands.bin")).unwrap();
    bytes[4] &= !0x10;
    place.write("stream.bin", &[b"noise", bytes.as_slice()].concat());
    assert_named(&place, "stream.bin", "a stream of telemetry of a flight computer");
    place.run(&["key", "flight.key", "--spacecraft", "5"]).expect(0);
    assert_named(&place, "flight.key", "a key for telecommands");
    assert_named(&place, "flight.key.counter", "the counter of a key for telecommands");
    place.write("parameters-1.bin", b"HZNP\x01\0\0\0");
    assert_named(&place, "parameters-1.bin", "a copy of the parameters that a flight computer keeps");
    place.write("hk.csv", b"time_s,mode,self_check,parameter_copy,last_status,parameter_generation\n0,1,1,1,0,2\n");
    assert_named(&place, "hk.csv", "the housekeeping of a flight computer");
    let xtce = place.run(&["telemetry", "--xtce"]).expect(0).out;
    place.write("dictionary.xml", xtce.as_bytes());
    assert_named(&place, "dictionary.xml", "the dictionary of the packets, as XTCE");
}

#[test]
fn settings_and_camera_files_are_named() {
    let place = Place::new();
    let refuse = |file: &str, what: &str| {
        let ran = place.run(&["run", file, "--sensor", "in/sensor.toml"]).expect(2);
        assert!(ran.err.contains(&format!("{file}: is {what}{NEEDED}")), "{}", ran.err);
    };
    refuse("in/sensor.toml", "a sensor.toml");
    place.write("scene.toml", place.run(&["simulate", "rocket", "--show"]).expect(0).out.as_bytes());
    refuse("scene.toml", "a scene.toml");
    place.write("fuse.toml", place.run(&["fuse", "--show-config"]).expect(0).out.as_bytes());
    refuse("fuse.toml", "a fuse.toml");
    place.write("schema.json", place.run(&["schema", "sensor.toml"]).expect(0).out.as_bytes());
    assert_named(&place, "schema.json", "a JSON schema");
    for (form, file) in [("opencv", "camera.xml"), ("ros", "camera.yaml"), ("foxglove", "camera.json")] {
        place
            .run(&["camera", "convert", "in/sensor.toml", "--model", "brown-conrady", "--to", form, "-o", file])
            .expect(0);
        let told = place.run(&["info", file]).expect(0).out;
        assert!(told.contains("camera file") && told.contains("320 x 240 px"), "{file}: {told}");
        refuse(file, "a camera file");
    }
}

#[test]
fn files_for_other_programs_are_named() {
    let place = Place::new();
    let aem = "CCSDS_AEM_VERS = 1.0\nORIGINATOR = HZN\nMETA_START\nOBJECT_NAME = CUBE\nMETA_STOP\n";
    for (file, content, what) in [
        ("a.aem", aem, "a CCSDS AEM, which has attitudes"),
        ("a.oem", "CCSDS_OEM_VERS = 2.0\n", "a CCSDS OEM, which has an orbit"),
        ("a.bc", "DAF/CK  ", "a CK of SPICE, which has attitudes"),
        ("a.tsc", "KPL/SCLK\n", "a text kernel of SPICE"),
        ("a.html", "<!doctype html><html>", "a page of HTML"),
        (
            "a.innovations.csv",
            "time_s,source,kind,nis,taken\n1,gnss,position,0.1,true\n",
            "the innovations of hzn fuse",
        ),
        ("study.csv", "fov_deg,depression_deg,sigma_max_deg\n60,20,0.1\n", "a study of hzn sensitivity"),
    ] {
        place.write(file, content.as_bytes());
        assert_named(&place, file, what);
    }
    assert!(place.run(&["info", "a.aem"]).expect(0).out.contains("object           CUBE\n"));
    // With a format for headerless pictures, the same bytes are a picture.
    place.write("raw.bin", &[b"hzns".to_vec(), vec![0; 320 * 240 - 4]].concat());
    place.run(&["run", "raw.bin", "--sensor", "in/sensor.toml", "--raw", "320x240:mono8"]).expect(0);
}

#[test]
fn a_folder_of_pictures_is_described() {
    let place = Place::with_pictures(3);
    let told = place.run(&["info", "in"]).expect(0).out;
    for line in [
        "pictures         3",
        "size             320 x 240 px (0000.png)",
        "sensor.toml      here",
        "frames.csv       not here",
    ] {
        assert!(told.contains(line), "{line:?} in: {told}");
    }
    std::fs::create_dir(place.path("empty")).unwrap();
    place.run(&["info", "empty"]).expect(2).says("empty: no pictures");
}

#[test]
fn another_file_as_the_sensor_is_named() {
    let place = Place::with_pictures(1);
    let refuse = |file: &str, what: &str| {
        let ran = place.run(&["run", "in", "--sensor", file]).expect(2);
        assert!(ran.err.contains(&format!("{file}: {what}, and a sensor.toml is needed here; ")), "{}", ran.err);
        ran.err
    };
    assert!(refuse("in/0000.png", "is a picture").contains("hzn init FILE writes a sensor.toml for its camera"));
    // A picture of more than a megabyte, which is larger than any sensor.toml.
    let mut noise = 1u32;
    let large = image::GrayImage::from_fn(1200, 1000, |_, _| {
        noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        image::Luma([(noise >> 24) as u8])
    });
    large.save(place.path("large.png")).unwrap();
    assert!(std::fs::metadata(place.path("large.png")).unwrap().len() > 1 << 20);
    refuse("large.png", "is a picture");
    place.run(&["prepare", "in/sensor.toml"]).expect(0);
    refuse("sensor.bin", "is a prepared sensor of `hzn prepare`");
    place.write("scene.toml", place.run(&["simulate", "rocket", "--show"]).expect(0).out.as_bytes());
    refuse("scene.toml", "is a scene.toml");
    place.run(&["run", "in", "-o", "results.csv"]).expect(0);
    refuse("results.csv", "has results of hzn run");
    place.run(&["camera", "convert", "in/sensor.toml", "--to", "opencv", "-o", "camera.yaml"]).expect(0);
    refuse("camera.yaml", "is a camera file");
    // Unknown bytes are told by the reader of the file.
    place.write("large.bin", &vec![0xAB; 2 << 20]);
    place
        .run(&["run", "in", "--sensor", "large.bin"])
        .expect(2)
        .says("expected to be smaller; a sensor.toml is expected");
    limb(320, 240, 0.0).save(place.path("named.toml.png")).unwrap();
    std::fs::rename(place.path("named.toml.png"), place.path("named.toml")).unwrap();
    place.run(&["run", "in", "--sensor", "named.toml"]).expect(2).says("named.toml: is");
}

#[test]
fn each_recording_says_what_wrote_it() {
    let place = Place::with_pictures(2);
    let told = |file: &str| {
        let out = place.run(&["info", file]).expect(0).out;
        let (first, rest) = out.split_once('\n').unwrap();
        (first.to_owned(), rest.lines().next().unwrap().to_owned())
    };
    place.run(&["run", "in", "-o", "a.mcap"]).expect(0);
    let (what, next) = told("a.mcap");
    assert!(what.ends_with(" recording of hzn run") && next.contains("hzn run FILE -o again.mcap"), "{what} {next}");
    place.run(&["run", "a.mcap", "-o", "again.mcap"]).expect(0);
    place.run(&["run", "in", "-o", "b.mcap", "--no-images"]).expect(0);
    let (what, next) = told("b.mcap");
    assert!(what.ends_with("hzn run, without pictures") && !next.contains("again"), "{what} {next}");
}
