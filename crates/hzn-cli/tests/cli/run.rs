//! Tests of `hzn run`: inputs, outputs, order, and messages.

use hzn_core::image::{Grey, Layout};
use hzn_core::{HostHorizon, Prior};
use hzn_host::Compiled;

use crate::common::{Place, cell, limb, without_time};

#[test]
fn a_folder_gives_a_table_in_order_with_every_number_of_threads() {
    let place = Place::with_pictures(30);
    let one = place.run(&["run", "in", "-j", "1", "-q"]).expect(0);
    let many = place.run(&["run", "in", "-j", "7", "-q"]).expect(0);
    assert_eq!(without_time(&one.out), without_time(&many.out));
    let rows = without_time(&one.out);
    assert_eq!(rows.len(), 30);
    for (i, row) in rows.iter().enumerate() {
        assert_eq!(cell(row, "index"), i.to_string());
        assert_eq!(cell(row, "file"), format!("{i:04}.png"));
        assert_eq!((cell(row, "status"), cell(row, "time_s")), ("ok", format!("{i}.0").as_str()));
    }
}

/// A row has each digit of the answer that a program gets from hzn-core: nothing on the way normalises it again.
#[test]
fn a_row_has_the_digits_of_the_library() {
    let place = Place::without_tone();
    let config = hzn_files::sensor::load(&place.path("in/sensor.toml")).unwrap().config;
    let mut horizon = HostHorizon::boxed(&config).unwrap();
    let mut longer_than_rounding = 0;
    for shift in 0..12 {
        let picture = limb(320, 240, f64::from(shift));
        picture.save(place.path("in/limb.png")).unwrap();
        let grey = Grey::try_new(picture.as_raw(), Layout::packed(320, 240, 1, 8)).unwrap();
        let expected = horizon.expect(&Prior::default()).unwrap();
        let answer = horizon.find(&grey, &expected).solution.unwrap();
        let rows = without_time(&place.run(&["run", "in"]).expect(0).out);
        let numbers =
            |names: &[&str]| names.iter().map(|n| cell(&rows[0], n).parse::<f64>().unwrap()).collect::<Vec<_>>();
        let [x, y, z] = answer.axis.xyz();
        assert_eq!(numbers(&["axis_x", "axis_y", "axis_z"]), [x, y, z]);
        let upper = numbers(&["cov_xx", "cov_xy", "cov_xz", "cov_yy", "cov_yz", "cov_zz"]);
        assert_eq!(upper, answer.covariance.upper_rad2);
        assert_eq!(numbers(&["half_angle_deg"]), [answer.half_angle_rad.to_degrees()]);
        let length = (x * x + y * y + z * z).sqrt();
        longer_than_rounding += u32::from([x / length, y / length, z / length] != [x, y, z]);
    }
    assert!(longer_than_rounding > 0, "another normalisation would change none of these answers");
}

#[test]
fn all_outputs_hold_the_same_rows() {
    let place = Place::with_pictures(6);
    for name in ["a.csv", "a.jsonl", "a.mcap"] {
        place.run(&["run", "in", "-o", name]).expect(0).says("6 pictures: 6 ok");
        assert!(!place.path(&format!("{name}.part")).exists());
    }
    place.run(&["export", "a.mcap", "-o", "b.csv"]).expect(0);
    place.run(&["export", "a.jsonl", "-o", "c.csv"]).expect(0);
    let rows = without_time(&place.read("a.csv"));
    assert_eq!(rows.len(), 6);
    assert_eq!(without_time(&place.read("b.csv")), rows);
    assert_eq!(without_time(&place.read("c.csv")), rows);
    place.run(&["export", "a.mcap", "--images", "pics", "--overlay", "drawn"]).expect(0).says("6 pictures, 6 overlays");
    assert_eq!(std::fs::read(place.path("pics/0000.png")).unwrap(), std::fs::read(place.path("in/0000.png")).unwrap());
    assert!(place.path("drawn/0005.png").exists());
    let info = place.run(&["info", "a.mcap"]).expect(0).out;
    assert!(info.contains("pictures         6") && info.contains("ok               6 (100.0 %)"), "{info}");
    // A recording can be an input.
    let again = place.run(&["run", "a.mcap", "-s", "in/sensor.toml"]).expect(0);
    let axis = |r: &Vec<(String, String)>| cell(r, "axis_y").to_owned();
    let again = without_time(&again.out);
    assert_eq!(again.iter().map(axis).collect::<Vec<_>>(), rows.iter().map(axis).collect::<Vec<_>>());
}

#[test]
fn times_and_altitudes_come_from_frames_csv() {
    let place = Place::with_pictures(3);
    place.write("in/frames.csv", b"file,time_s,altitude_km\n0001.png,77.5,390\n");
    let ran = place.run(&["run", "in", "--fps", "4"]).expect(0);
    let ran = ran.says("warning: of 3 pictures: 2 without a row in in/frames.csv; 2 without a time\n");
    let rows = without_time(&ran.out);
    assert_eq!((cell(&rows[1], "time_s"), cell(&rows[1], "altitude_km")), ("77.5", "390.0"));
    // The table is the only clock.
    assert_eq!((cell(&rows[2], "time_s"), cell(&rows[2], "altitude_km")), ("", "400.0"));
    // A table without times is not used as the clock.
    place.write("in/frames.csv", b"file,altitude_km\n0001.png,390\n");
    let rows = without_time(&place.run(&["run", "in", "--fps", "4"]).expect(0).out);
    assert_eq!((cell(&rows[1], "time_s"), cell(&rows[2], "time_s")), ("0.25", "0.5"));
}

#[test]
fn a_frame_without_altitude_is_a_row_that_says_so() {
    let place = Place::with_pictures(4);
    place.write("in/sensor.toml", crate::common::SENSOR.replace("altitude_km = 400.0\n", "").as_bytes());
    place.write("in/frames.csv", b"file,time_s,altitude_km\n0000.png,10,400\n0001.png,11,\n0003.png,,400\n");
    for out in ["a.csv", "a.jsonl", "a.mcap"] {
        let ran = place.run(&["run", "in", "-o", out]).expect(3).says("4 pictures: 2 ok, 2 no-altitude");
        let ran =
            ran.says("of 4 pictures: 1 without a row in in/frames.csv; 2 without a time; 2 without an altitude, not");
        assert_eq!(ran.err.lines().filter(|l| l.contains("altitude:")).count(), 0, "{}", ran.err);
        place.run(&["info", out]).expect(0);
        place.run(&["export", out, "-o", "rows.csv", "--force"]).expect(0);
        let rows = without_time(&place.read("rows.csv"));
        let of = |name: &str| rows.iter().map(|r| cell(r, name).to_owned()).collect::<Vec<_>>();
        assert_eq!(of("status"), ["ok", "no-altitude", "no-altitude", "ok"]);
        assert_eq!(of("time_s"), ["10.0", "11.0", "", ""]);
        assert_eq!(of("altitude_km"), ["400.0", "", "", "400.0"]);
        assert!(of("detail")[1].contains("no altitude: set body.altitude_km"), "{:?}", of("detail"));
        place.run(&["run", "in", "-o", out, "--resume"]).expect(0);
    }
    // A second run gives the same results.
    let again = place.run(&["run", "a.mcap"]).expect(3);
    assert_eq!(without_time(&again.out), without_time(&place.read("rows.csv")));
    // If no picture can be processed, the command says so before it begins.
    place.write("in/frames.csv", b"file,altitude_km\n0000.png,\n");
    place.run(&["run", "in"]).expect(2).says("no altitude: ");
}

#[test]
fn a_rocket_begins_below_the_limb_height() {
    let place = Place::with_pictures(3);
    let sensor = crate::common::SENSOR.replace("altitude_km = 400.0\n", "limb_height_km = 17.0\n");
    place.write("in/sensor.toml", sensor.as_bytes());
    place.write("in/frames.csv", b"file,altitude_km\n0000.png,-0.02\n0001.png,3.2\n0002.png,400\n");
    for out in ["a.csv", "a.mcap"] {
        let ran = place.run(&["run", "in", "-o", out]).expect(3).says("3 pictures: 1 ok, 2 no-altitude");
        ran.says(
            "of 3 pictures: 2 below the limb height, where no limb can be seen, not processed (status no-altitude)",
        );
    }
    let rows = place.rows("a.csv");
    assert_eq!(cell(&rows[1], "detail"), "altitude 3.2 km is below the limb height 17 km");
    assert_eq!(cell(&rows[1], "altitude_km"), "3.2");
    assert_eq!(without_time(&place.run(&["run", "a.mcap"]).expect(3).out), without_time(&place.read("a.csv")));
    let told = place.run(&["explain", "in", "--index", "1"]).expect(3).out;
    assert_eq!(told, "0001.png: earth-sphere: no-altitude: altitude 3.2 km is below the limb height 17 km\n");
    place.run(&["explain", "in/0002.png"]).expect(0);
    // If the altitude allows no picture at all, the command says so before it begins.
    std::fs::remove_file(place.path("in/frames.csv")).unwrap();
    place.run(&["run", "in", "--altitude-km", "3.2"]).expect(2).says("altitude 3.2 km is below the limb height 17 km");
}

#[test]
fn flight_precision_agrees() {
    let place = Place::with_pictures(2);
    let host = without_time(&place.run(&["run", "in"]).expect(0).out);
    let flight = without_time(&place.run(&["run", "in", "--flight"]).expect(0).out);
    for (a, b) in host.iter().zip(&flight) {
        let z = |r: &[(String, String)]| cell(r, "axis_y").parse::<f64>().unwrap();
        assert!((z(a) - z(b)).abs() < 1e-4);
    }
}

#[test]
fn patterns_and_single_pictures() {
    let place = Place::with_pictures(12);
    assert_eq!(without_time(&place.run(&["run", "in/000*.png"]).expect(0).out).len(), 10);
    assert_eq!(without_time(&place.run(&["run", "in/0003.png", "in/0001.png"]).expect(0).out).len(), 2);
    place.run(&["run", "in/9*.png"]).expect(2).says("in/9*.png: no picture matches");
    // The shell expands in/* to this list; the files that are not pictures are ignored.
    place.write("in/notes.txt", b"x");
    let all = ["run", "in/0000.png", "in/0001.png", "in/notes.txt", "in/sensor.toml"];
    assert_eq!(without_time(&place.run(&all).expect(0).out).len(), 2);
    assert_eq!(without_time(&place.run(&["run", "in/*"]).expect(0).out).len(), 12);
    place.run(&["run", "in/sensor.toml"]).expect(2).says("in/sensor.toml: is a sensor.toml, and a picture, a folder");
    place.run(&["run", "nowhere"]).expect(2).says("nowhere: no such file or folder");
}

#[test]
fn numbers_in_names_count_by_their_value() {
    let place = Place::with_pictures(3);
    for (from, to) in [("0000", "img1"), ("0001", "img10"), ("0002", "img2")] {
        std::fs::rename(place.path(&format!("in/{from}.png")), place.path(&format!("in/{to}.png"))).unwrap();
    }
    let names = |ran: crate::common::Ran| {
        without_time(&ran.out).iter().map(|r| cell(r, "file").to_owned()).collect::<Vec<_>>().join(" ")
    };
    for input in ["in", "in/*.png"] {
        let ran = place.run(&["run", input]).expect(0);
        assert!(!ran.err.contains("given order"), "{}", ran.err);
        assert_eq!(names(ran), "img1.png img2.png img10.png");
    }
    // A shell expands the pattern to this list. A list keeps its order, and a note says so.
    let ran = place.run(&["run", "in/img1.png", "in/img10.png", "in/img2.png"]).expect(0);
    let ran = ran.says("note: pictures are processed in the given order, img10.png before img2.png; give the folder");
    assert_eq!(names(ran), "img1.png img10.png img2.png");
    let ran = place.run(&["run", "in/img2.png", "in/img1.png", "in/img10.png"]).expect(0);
    assert!(!ran.err.contains("given order"), "{}", ran.err);
}

#[cfg(unix)]
#[test]
fn a_link_to_nothing_is_a_picture_that_cannot_be_read() {
    let place = Place::with_pictures(2);
    std::os::unix::fs::symlink("/nonexistent/0.png", place.path("in/0000a.png")).unwrap();
    std::fs::create_dir(place.path("in/9.png")).unwrap();
    for input in [&["in"][..], &["in/*.png"], &["in/0000.png", "in/0000a.png", "in/0001.png"]] {
        let ran = place.run(&[&["run"], input].concat()).expect(3);
        assert_eq!(ran.err.contains("note: 1 folder ending in .png was left out"), input.len() == 1, "{}", ran.err);
        let rows = without_time(&ran.out);
        let of = |name: &str| rows.iter().map(|r| cell(r, name).to_owned()).collect::<Vec<_>>();
        assert_eq!(of("file"), ["0000.png", "0000a.png", "0001.png"], "{input:?}");
        assert_eq!(of("status"), ["ok", "unreadable", "ok"], "{input:?}");
        assert_eq!(of("detail")[1], "is a link to /nonexistent/0.png, which does not exist");
    }
    place.run(&["run", "in/0000a.png"]).expect(2).says("in/0000a.png: no such file");
}

#[test]
fn headerless_pictures() {
    let place = Place::new();
    std::fs::create_dir(place.path("raw")).unwrap();
    let image = crate::common::limb(320, 240, 0.0);
    place.write("raw/a.raw", image.as_raw());
    let words: Vec<u8> = image.as_raw().iter().flat_map(|&v| (u16::from(v) << 4).to_le_bytes()).collect();
    place.write("raw/b.raw", &words);
    let ran = place.run(&["run", "raw", "--raw", "320x240:mono8", "-s", "in/sensor.toml"]).expect(3);
    let rows = without_time(&ran.out);
    assert_eq!((cell(&rows[0], "status"), cell(&rows[1], "status")), ("ok", "unreadable"));
    assert_eq!(
        cell(&rows[1], "detail"),
        "153600 bytes, but a picture of 320x240:mono8 has 76800: these are 2 pictures; write each into its own file; \
         it fits mono10, mono12, mono16"
    );
    let ran = place.run(&["run", "raw/b.raw", "--raw", "320x240:mono12", "-s", "in/sensor.toml"]).expect(0);
    let found = without_time(&ran.out);
    assert_eq!(cell(&found[0], "axis_y")[..4], cell(&rows[0], "axis_y")[..4]);

    // The recorded sensor states the number of bits of the pictures.
    let raw = ["run", "raw/b.raw", "--raw", "320x240:mono12", "-s", "in/sensor.toml", "-o", "b.mcap"];
    place.run(&raw).expect(0);
    let recorded = hzn_mcap::Reader::open(place.path("b.mcap"), hzn_mcap::Contents::default()).unwrap();
    place.write("again.toml", recorded.sensor_toml().unwrap().as_bytes());
    let again = without_time(&place.run(&["run", "b.mcap", "-s", "again.toml"]).expect(0).out);
    for name in ["status", "axis_x", "axis_y", "axis_z", "level"] {
        assert_eq!(cell(&again[0], name), cell(&found[0], name), "{name}");
    }
}

#[test]
fn outputs_that_exist_are_kept() {
    let place = Place::with_pictures(2);
    for name in ["a.csv", "a.mcap"] {
        place.write(name, b"precious");
        place.run(&["run", "in", "-o", name]).expect(2).says("--force replaces it");
        assert_eq!(place.read(name), "precious");
        place.run(&["run", "in", "-o", name, "--force"]).expect(0);
    }
    place.run(&["run", "in", "-o", "out.txt"]).expect(2).says("must be .mcap, .csv or .jsonl");
    place.run(&["run", "in", "-o", "no/such/out.csv"]).expect(1).says("the folder does not exist");
}

#[cfg(unix)]
#[test]
fn nobody_listening_is_no_crash() {
    let place = Place::with_pictures(3);
    // This is a pipe whose other end is closed.
    let closed = || std::io::pipe().unwrap().1;
    for args in [&["run", "in"][..], &["info", "in/0000.png"], &["explain", "in/0000.png"], &["completions", "bash"]] {
        let output = place.command(args).stdout(closed()).output().unwrap();
        let ran = crate::common::Ran::from_output(&output, &place.path("")).expect(1);
        assert!(!ran.err.contains("panicked") && !ran.err.contains("error"), "{}", ran.err);
    }
    for (args, code) in [
        (&["run", "in", "-o", "a.csv"][..], 0),
        (&["run", "in", "-o", "a.csv"], 2),
        (&["init", "-o", "s.toml"], 0),
        (&["export", "a.csv", "-o", "b.jsonl"], 0),
        (&["frobnicate"], 2),
    ] {
        let status = place.command(args).stderr(closed()).stdout(std::process::Stdio::null()).status().unwrap();
        assert_eq!(status.code(), Some(code), "{args:?}");
    }
    assert_eq!(without_time(&place.read("a.csv")).len(), 3);
}

/// Returns the command that `hzn run` prints after `an explanation and advice: `.
fn suggested(ran: &crate::common::Ran) -> String {
    let line =
        ran.err.lines().find(|l| l.contains("an explanation and advice: ")).unwrap_or_else(|| panic!("{}", ran.err));
    line.split("an explanation and advice: ").nth(1).unwrap().to_owned()
}

#[cfg(unix)]
#[test]
fn the_commonest_refusal_is_named_and_the_command_runs_as_printed() {
    let place = Place::with_pictures(1);
    std::fs::create_dir_all(place.path("some flight's/a")).unwrap();
    let other = "some flight's/a";
    for (n, picture) in [(0, "0000"), (1, "black"), (2, "black"), (3, "bright")] {
        let file = place.path(&format!("{other}/{n} {picture}.png"));
        match picture {
            "black" => image::GrayImage::new(320, 240).save(file).unwrap(),
            "bright" => image::GrayImage::from_pixel(320, 240, image::Luma([255])).save(file).unwrap(),
            _ => std::fs::copy(place.path("in/0000.png"), file).map(drop).unwrap(),
        }
    }
    let sensor = crate::common::SENSOR.replace("altitude_km = 400.0\n", "");
    place.write("its sensor.toml", sensor.as_bytes());
    place.write("frames.csv", b"file,altitude_km\n1 black.png,400\n");
    let explain = |ran: &crate::common::Ran| {
        let path = std::path::Path::new(assert_cmd::cargo::cargo_bin!("hzn")).parent().unwrap();
        let command = suggested(ran);
        let mut shell = std::process::Command::new("/bin/sh");
        shell.args(["-c", &command]).current_dir(place.path("")).env("PATH", path);
        let done = crate::common::Ran::from_output(&shell.output().unwrap(), &place.path(""));
        done.expect(0).out
    };
    let base = ["-s", "its sensor.toml", "--altitude-km", "400"];
    let with = |more: &[&str]| place.run(&[&["run"], more, &base].concat());
    let ran = with(&[other]).expect(0).says("note: 3 refused, 2 as no-limb: ");
    assert!(explain(&ran).contains("1 black.png: 320 x 240"), "{}", suggested(&ran));
    // The inputs are a pattern, then files with a named table.
    let ran =
        with(&["some flight's/*/*black.png"]).expect(0).says("nothing was found in any picture; 2 refused, all as");
    assert!(explain(&ran).contains("1 black.png: 320 x 240"), "{}", suggested(&ran));
    let ran = with(&["some flight's/a/0 0000.png", "some flight's/a/2 black.png"]).expect(0).says("1 refused, all as");
    assert!(explain(&ran).contains("2 black.png: 320 x 240"), "{}", suggested(&ran));
    let ran = place.run(&["run", other, "-s", "its sensor.toml", "--frames", "frames.csv", "--flight"]).expect(3);
    assert!(suggested(&ran).ends_with("--frames frames.csv --flight"), "{}", suggested(&ran));
    assert!(explain(&ran).contains("1 black.png: 320 x 240"), "{}", suggested(&ran));
    // In a recording, pictures have numbers.
    with(&[other, "-o", "out file.mcap"]).expect(0);
    let ran = place.run(&["run", "out file.mcap"]).expect(0);
    assert_eq!(suggested(&ran), "hzn explain 'out file.mcap' --index 1");
    assert!(explain(&ran).contains("1 black.png: 320 x 240"), "{}", suggested(&ran));
    // The pictures are headerless.
    std::fs::create_dir(place.path("raw")).unwrap();
    place.write("raw/a b.raw", &[0; 320 * 240]);
    let ran = with(&["raw", "--raw", "320x240:mono8"]).expect(0);
    assert!(explain(&ran).contains("a b.raw: 320 x 240"), "{}", suggested(&ran));
    // All pictures are answered, so there is no note.
    assert!(!with(&["some flight's/a/0 0000.png"]).expect(0).err.contains("refused"));
}
