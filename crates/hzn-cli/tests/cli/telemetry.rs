//! `hzn telemetry`: the packets of pictures become the rows of `hzn run`.

use crate::common::{Place, Ran, limb};
use hzn_core::image::{Grey, Layout};
use hzn_core::{FlightHorizon, Prior};
use hzn_flight::answer::PictureAnswer;
use hzn_flight::bytes::Writer;
use hzn_flight::cuc::Cuc;
use hzn_flight::joint::RigAnswer;
use hzn_flight::messages::{Acknowledge, Code, Event, EventRecord, Exposure, Function, Severity};
use hzn_flight::packet::{self, Apid, ApidBase};
use hzn_host::Compiled;
use image::{GrayImage, Luma};

/// A stream of telemetry.
#[derive(Default)]
struct Stream {
    bytes: Vec<u8>,
    sequences: [u16; 16],
}

impl Stream {
    fn add(&mut self, apid: Apid, time: Option<Cuc>, user: impl FnOnce(&mut Writer<'_>)) {
        let count = &mut self.sequences[apid as usize & 15];
        let mut out = [0; packet::MAX_BYTES];
        let n = packet::write(&mut out, ApidBase::DEFAULT, apid, *count, time, user).unwrap();
        *count += 1;
        self.bytes.extend(&out[..n]);
    }

    fn add_picture(&mut self, time: Cuc, exposure: &Exposure, answer: &PictureAnswer) {
        let with_picture = |w: &mut Writer<'_>| w.u32(exposure.picture);
        self.add(Apid::Position, Some(time), |w| {
            with_picture(w);
            answer.position.unwrap().write(w);
        });
        self.add(Apid::Integrity, Some(time), |w| {
            with_picture(w);
            answer.integrity.unwrap().write(w);
        });
        for edge in answer.edges.iter().flatten() {
            self.add(Apid::Candidate, Some(time), |w| {
                with_picture(w);
                edge.write(w);
            });
        }
        self.add(Apid::Science, Some(time), |w| {
            exposure.write(w);
            answer.write_science(w);
        });
    }
}

/// Returns a folder with the picture of a disc, whose position may be wanted, and the answer of the flight computer.
fn disc(position: bool) -> (Place, PictureAnswer) {
    let place = Place::new();
    let body = "kind = \"sphere\"\nradius_km = 1000.0\nlimb_height_km = 0.0\naltitude_km = 2863.7033";
    let sensor = crate::common::SENSOR.replace("kind = \"earth-sphere\"\naltitude_km = 400.0", body);
    place.write("in/sensor.toml", format!("{sensor}\n[fit]\nposition = {position}\n").as_bytes());
    let picture = GrayImage::from_fn(320, 240, |x, y| {
        let (u, v) = ((f64::from(x) - 159.5) / 300.0, (f64::from(y) - 119.5) / 300.0);
        let cos = (0.05 * u + 0.08 * v + 1.0) / ((1.0 + u * u + v * v) * (1.0 + 0.0025 + 0.0064)).sqrt();
        let inside_px = 300.0 * (15f64.to_radians() - cos.min(1.0).acos());
        Luma([(20.0 + 180.0 * (0.5 + inside_px / 2.0).clamp(0.0, 1.0)) as u8])
    });
    picture.save(place.path("in/disc.png")).unwrap();
    let answer = answer(&place, &picture);
    (place, answer)
}

/// Returns the answer of the flight computer to a picture, with the sensor of the folder.
fn answer(place: &Place, picture: &GrayImage) -> PictureAnswer {
    let config = hzn_files::sensor::load(&place.path("in/sensor.toml")).unwrap().config;
    let mut horizon = FlightHorizon::boxed(&config).unwrap();
    let grey = Grey::try_new(picture.as_raw(), Layout::packed(320, 240, 1, 8)).unwrap();
    let expected = horizon.expect(&Prior::default()).unwrap();
    PictureAnswer::from_report(&horizon.find(&grey, &expected), &config)
}

fn exposure(picture: u32) -> Exposure {
    let exposure_us = u64::from(picture) * 1_000_000;
    Exposure {
        picture,
        exposure_us,
        done_us: exposure_us + 2000,
        calculation_us: 1500,
        body: 4,
        altitude_m: 2_863_703.2,
    }
}

/// Returns the cells of the first row by their names, without those that name the picture and its times.
fn cells(place: &Place, file: &str) -> Vec<(String, String)> {
    let text = std::fs::read_to_string(place.path(file)).unwrap();
    let mut lines = text.lines().map(|l| l.split(',').map(str::to_owned).collect::<Vec<_>>());
    let (columns, row) = (lines.next().unwrap(), lines.next().unwrap());
    let other = ["index", "file", "time_s", "elapsed_us", "altitude_km", "crc32"];
    columns.into_iter().zip(row).filter(|(column, _)| !other.contains(&column.as_str())).collect()
}

#[test]
fn rows_have_every_column_of_a_run() {
    let cases = [
        (true, &["position_x_km", "position_z_km", "pos_cov_xx_km2", "pos_cov_zz_km2"]),
        (false, &["axis_free_x", "cov_free_zz", "axis_by_cos_x", "axis_by_cos_z"]),
    ];
    for (position, columns) in cases {
        let (place, answer) = disc(position);
        let mut stream = Stream::default();
        stream.add_picture(Cuc::since_start(1_000_000), &exposure(1), &answer);
        place.write("sent.bin", &stream.bytes);
        place.run(&["telemetry", "sent.bin", "-o", "sent.csv"]).expect(0);
        place.run(&["run", "in", "--flight", "-o", "here.csv"]).expect(0);
        let (sent, here) = (cells(&place, "sent.csv"), cells(&place, "here.csv"));
        assert_eq!(sent, here);
        // A stream from another program gives the same rows.
        let mut piped = place.command(&["telemetry", "-", "-o", "piped.csv"]);
        let output = piped.stdin(std::fs::File::open(place.path("sent.bin")).unwrap()).output().unwrap();
        Ran::from_output(&output, &place.path("")).expect(0);
        assert_eq!(place.read("piped.csv"), place.read("sent.csv"));
        for column in columns {
            let value = &sent.iter().find(|(c, _)| c == column).unwrap().1;
            assert!(value.parse::<f64>().is_ok_and(|x| x != 0.0), "{column}: {value:?}");
        }
    }
}

/// A recording of answers is named as what it is.
#[test]
fn a_recording_of_telemetry_is_named() {
    let (place, answer) = disc(false);
    let mut stream = Stream::default();
    stream.add_picture(Cuc::since_start(1_000_000), &exposure(1), &answer);
    place.write("sent.bin", &stream.bytes);
    place.run(&["telemetry", "sent.bin", "-o", "sent.mcap"]).expect(0);
    let told = place.run(&["info", "sent.mcap"]).expect(0).out;
    assert!(told.lines().next().unwrap().ends_with("answers of a flight computer, decoded by hzn telemetry"), "{told}");
    assert!(told.contains("hzn export FILE -o rows.csv") && !told.contains("hzn run FILE"), "{told}");
    let json = place.run(&["info", "sent.mcap", "--json"]).expect(0).out;
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!((&json["writer"], &json["recorded_pictures"]), (&"telemetry".into(), &0.into()), "{json}");
    place.run(&["export", "sent.mcap", "-o", "rows.csv"]).expect(0).says("1 row");
}

/// The limb of the Earth has a probability and a protection level. If their packet is lost, the row says nothing.
#[test]
fn rows_have_the_integrity_of_a_run() {
    let (place, picture) = (Place::without_tone(), limb(320, 240, 0.0));
    picture.save(place.path("in/0000.png")).unwrap();
    let answer = answer(&place, &picture);
    let exposure = Exposure { body: 1, ..exposure(1) };
    let mut stream = Stream::default();
    stream.add_picture(Cuc::since_start(1_000_000), &exposure, &answer);
    place.write("sent.bin", &stream.bytes);
    place.run(&["telemetry", "sent.bin", "-o", "sent.csv"]).expect(0);
    place.run(&["run", "in", "--flight", "-o", "here.csv"]).expect(0);
    let (sent, here) = (cells(&place, "sent.csv"), cells(&place, "here.csv"));
    for ((column, there), (_, value)) in sent.iter().zip(&here) {
        if column == "protection_deg" {
            // Telemetry has it in single precision.
            let [there, value] = [there, value].map(|text| text.parse::<f64>().unwrap());
            assert!((there / value - 1.0).abs() < 1e-6, "{there} {value}");
        } else {
            assert_eq!(there, value, "{column}");
        }
    }
    let value = |name: &str| sent.iter().find(|(column, _)| column == name).unwrap().1.parse::<f64>();
    assert!(value("p_limb").is_ok_and(|p| (0.5..1.0).contains(&p)) && value("cov_common_zz").is_ok());

    let mut stream = Stream::default();
    stream.add(Apid::Science, Some(Cuc::since_start(1_000_000)), |w| {
        exposure.write(w);
        answer.write_science(w);
    });
    place.write("lost.bin", &stream.bytes);
    place.run(&["telemetry", "lost.bin", "-o", "lost.csv"]).expect(0);
    let lost = cells(&place, "lost.csv");
    for name in ["p_limb", "protection_deg", "cov_common_xx", "cov_common_zz"] {
        assert_eq!(lost.iter().find(|(column, _)| column == name).unwrap().1, "", "{name}");
    }
    assert!(lost.iter().any(|(column, value)| column == "axis_x" && !value.is_empty()));
}

#[test]
fn what_is_missing_refused_or_of_another_version_is_told() {
    let (place, answer) = disc(true);
    let mut stream = Stream::default();
    // The times are those of a clock that was correlated: 2017-01-01T00:00:00 is this second of TAI.
    let time = Cuc::tai((21_550 * 86_400 + 37) * 1_000_000);
    stream.add(Apid::Event, Some(time), |w| {
        let (number, severity) = (Event::ClockSet as u16, Severity::Information as u8);
        EventRecord { number, severity, a: 21_550 * 86_400 + 37, b: 12 }.write(w);
    });
    stream.add(Apid::Acknowledge, Some(time), |w| {
        let (function, code) = (Function::Navigate as u8, Code::Missing as u8);
        Acknowledge { function, sequence: 9, code, detail: 5 }.write(w);
    });
    stream.add(Apid::Acknowledge, Some(time), |w| {
        let (function, code) = (Function::SetParameters as u8, Code::Refused as u8);
        Acknowledge { function, sequence: 10, code, detail: 81 }.write(w);
    });
    stream.add(Apid::Science, Some(time), |w| {
        exposure(3).write(w);
        answer.write_science(w);
    });
    // The first version had microseconds in place of the time code.
    let mut old = Stream::default();
    old.add(Apid::Housekeeping, None, |w| w.bytes(&[0; 40]));
    stream.bytes.extend(old.bytes);
    place.write("sent.bin", &stream.bytes);
    let ran = place.run(&["telemetry", "sent.bin", "-o", "sent.csv"]).expect(0);
    for text in [
        "2017-01-01T00:00:00.000Z  clock correlated with 2017-01-01T00:00:00.000Z, changed by 12 ms",
        "command 9 (navigate): a number of a vector is missing: position_y_m",
        "command 10 (set): value refused; nothing changed: parameter 81 consensus.threshold_px",
        "1 answers without some of their candidates",
        "1 packets of version 1",
    ] {
        assert!(ran.err.contains(text), "{text:?} is not in\n{}", ran.err);
    }
    let row = cells(&place, "sent.csv");
    let column = |name: &str| row.iter().find(|(c, _)| c == name).unwrap().1.as_str();
    assert!(column("axis_x").parse::<f64>().is_ok() && column("position_x_km").is_empty());
}

/// A bit that flipped, and a stream that ends within a packet: the other answers are there, and the exit code tells.
#[test]
fn a_damaged_stream_has_an_exit_code_of_its_own() {
    let (place, answer) = disc(true);
    let mut stream = Stream::default();
    for k in 1..4 {
        stream.add_picture(Cuc::since_start(1_000_000), &exposure(k), &answer);
    }
    let (whole, last) = (stream.bytes.clone(), stream.bytes.len() - 1);
    let mut flipped = whole.clone();
    // The last packet is an answer.
    flipped[last - 20] ^= 4;
    let noisy = [b"noise", &whole[..]].concat();
    for (bytes, code, answers) in [(&whole[..], 0, 3), (&flipped, 3, 2), (&noisy, 3, 3), (&whole[..last], 3, 2)] {
        place.write("sent.bin", bytes);
        place.run(&["telemetry", "sent.bin", "-o", "sent.csv", "--force"]).expect(code);
        assert_eq!(place.rows("sent.csv").len(), answers, "{code}");
    }
}

/// The joint answer of a rig has the columns of `hzn run rig.toml`; the packets of its heads have other bases.
#[test]
fn joint_answers_become_the_rows_of_a_rig() {
    let place = Place::new();
    let mut stream = Stream::default();
    let joint = RigAnswer {
        epoch: 1,
        exposure_us: 2_500_000,
        heads_expected: 0b1111,
        heads_seen: 0b1101,
        heads_answered: 0b1101,
        heads_used: 0b0101,
        heads_excluded: 0b1000,
        picture_0: 7,
        axis: [0.0, 0.6, 0.8],
        cov: [1e-6, 0.0, 0.0, 0.64e-6, -0.48e-6, 0.36e-6],
        cov_common: [f32::NAN; 6],
        half_angle_rad: 1.2,
        separation_rad: 1e-3,
        separation_limit_rad: 2e-3,
        protection_rad: 4e-3,
        ..RigAnswer::default()
    };
    stream.add(Apid::Rig, Some(Cuc::since_start(2_500_000)), |w| joint.write(w));
    let none = RigAnswer { epoch: 2, status: 6, outcome: 3, axis: [f32::NAN; 3], cov: [f32::NAN; 6], ..joint };
    stream.add(Apid::Rig, Some(Cuc::since_start(3_500_000)), |w| none.write(w));
    let base = ApidBase::try_new(0x120).unwrap();
    let mut out = [0; packet::MAX_BYTES];
    let user = |w: &mut Writer<'_>| EventRecord::default().write(w);
    let n = packet::write(&mut out, base, Apid::Event, 0, Some(Cuc::since_start(0)), user).unwrap();
    stream.bytes.extend(&out[..n]);
    place.write("sent.bin", &stream.bytes);
    let ran = place.run(&["telemetry", "sent.bin", "-o", "sent.csv"]).expect(0);
    for text in ["epoch 2: inconsistent", "3 packets, 2 answers", "1 packets of other computers or heads"] {
        assert!(ran.err.contains(text), "{text:?} is not in\n{}", ran.err);
    }
    let row = cells(&place, "sent.csv");
    let column = |name: &str| row.iter().find(|(c, _)| c == name).unwrap().1.as_str();
    let number = |name: &str| column(name).parse::<f64>().unwrap();
    assert_eq!(["head", "status", "heads_used", "heads_excluded"].map(column), ["rig", "ok", "head0 head2", "head3"]);
    assert_eq!(column("detail"), "head1: no picture");
    assert!((number("axis_v_z") - 0.8).abs() < 1e-6 && (number("sigma_max_deg") - 0.0573).abs() < 1e-4);
    assert!((number("separation_deg") * 2.0 - number("separation_limit_deg")).abs() < 1e-6);
    assert!((number("protection_deg") - 4e-3f64.to_degrees()).abs() < 1e-6);
    let rows = std::fs::read_to_string(place.path("sent.csv")).unwrap();
    assert!(rows.lines().nth(2).unwrap().contains("rejected"));
}

/// The dictionary in the book is what the program prints.
#[test]
fn the_dictionary_is_that_of_the_records() {
    let place = Place::new();
    let printed = place.run(&["telemetry", "--xtce"]).expect(0).out;
    let committed = include_str!("../../../../book/reference/telemetry.xtce.xml");
    let command = "hzn telemetry --xtce > book/reference/telemetry.xtce.xml";
    assert!(printed == committed, "write the file again: {command}");
    let moved = place.run(&["telemetry", "--xtce", "--apid-base", "0x240"]).expect(0).out;
    // Only the APIDs move: 0x100 to 0x10B become 0x240 to 0x24B, and that of telecommands 0x1C0 to 0x300.
    let apid = |digits: &str| format!("packet_apid\" value=\"{digits}");
    let packets = committed.replace(&apid("25"), &apid("57")).replace(&apid("26"), &apid("58"));
    assert_eq!(moved, packets.replace("binaryValue=\"19C0\"", "binaryValue=\"1B00\""));
    place.run(&["telemetry"]).expect(2).says("<FILE|LINE>");
}

#[test]
fn no_command_is_sent_if_one_of_several_is_wrong() {
    let place = Place::new();
    let send = |commands: &[&str]| {
        let ran = place.run(&[&["telecommand"], commands, &["--to", "udp:127.0.0.1:0,127.0.0.1:9"]].concat());
        assert!(ran.err.contains("track.normals"), "{}", ran.err);
        ran.err.contains("note: no command was sent: all of them are checked first")
    };
    assert!(send(&["set track.full_every 0", "set track.normals 5000"]));
    assert!(!send(&["set track.normals 5000"]));
}
