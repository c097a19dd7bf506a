//! What a shell needs: standard input and output, several outputs, JSON, messages, folders that grow, manual pages.

use std::io::Write;
use std::process::{Command, Stdio};

use serde_json::Value;

use crate::common::{Place, Ran, SENSOR, cell, limb, rows, without_time};

/// Runs a command with these bytes on standard input.
fn with_stdin(mut command: Command, bytes: &[u8]) -> Ran {
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    // A command that refuses its arguments does not read.
    let _ = child.stdin.take().unwrap().write_all(bytes);
    Ran::from_output(&child.wait_with_output().unwrap(), std::path::Path::new("/"))
}

/// Returns the objects of a text, one a line.
fn objects(text: &str) -> Vec<Value> {
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

#[test]
fn each_of_several_outputs_has_every_row() {
    let place = Place::with_pictures(3);
    let ran = place.run(&["run", "in", "-q", "-o", "a.mcap", "-o", "b.csv", "-o", "-", "-o", "c.jsonl"]).expect(0);
    let table = without_time(&place.read("b.csv"));
    assert_eq!(table.len(), 3);
    assert_eq!(without_time(&ran.out), table);
    assert_eq!(objects(&place.read("c.jsonl")).len(), 3);
    let exported = place.run(&["export", "a.mcap", "-o", "-"]).expect(0);
    assert_eq!(without_time(&exported.out), table);
    // The recording has its pictures, although two tables were written before it.
    place.run(&["export", "a.mcap", "--images", "out"]).expect(0).says("3 pictures");
}

#[test]
fn outputs_that_contradict_each_other_are_refused() {
    let place = Place::with_pictures(1);
    for (outputs, says) in [
        (&["-o", "a.mcap", "-o", "b.mcap"][..], "only one of the outputs can be a recording"),
        (&["-o", "a.csv", "-o", "a.csv"], "a.csv: is given twice"),
        (&["-o", "-", "--resume"], "standard output cannot be continued"),
        (&["-o", "a.csv", "-o", "b.txt"], "b.txt: the output's ending must be"),
    ] {
        place.run(&[&["run", "in"], outputs].concat()).expect(2).says(says);
    }
    assert!(!place.path("a.csv").exists() && !place.path("a.csv.part").exists());
}

#[test]
fn several_outputs_of_different_length_are_continued() {
    let place = Place::with_pictures(4);
    place.run(&["run", "in", "-q", "-o", "a.csv", "-o", "b.jsonl"]).expect(0);
    let whole = (without_time(&place.read("a.csv")), objects(&place.read("b.jsonl")));
    let cut = |name: &str, lines: usize| {
        let kept: String = place.read(name).split_inclusive('\n').take(lines).collect();
        std::fs::remove_file(place.path(name)).unwrap();
        place.write(&format!("{name}.part"), kept.as_bytes());
    };
    // A crash between the two leaves one more picture in the first.
    cut("a.csv", 1 + 3);
    cut("b.jsonl", 1);
    place.run(&["run", "in", "-q", "-o", "a.csv", "-o", "b.jsonl", "--resume"]).expect(0);
    let axis = |rows: &[Value]| rows.iter().map(|row| row["axis_x"].as_f64().unwrap()).collect::<Vec<_>>();
    assert_eq!(without_time(&place.read("a.csv")), whole.0);
    assert_eq!(axis(&objects(&place.read("b.jsonl"))), axis(&whole.1));
    // A row of the longer one that this run does not give.
    cut("b.jsonl", 1);
    place.write("in/sensor.toml", SENSOR.replace("300.0", "310.0").as_bytes());
    let args = ["run", "in", "-q", "-o", "a.csv", "-o", "b.jsonl", "--resume"];
    place.run(&args).expect(2).says("give the sensor.toml");
}

#[test]
fn standard_output_has_the_format_that_is_asked_for() {
    let place = Place::with_pictures(2);
    let ran = place.run(&["run", "in", "-q", "--format", "jsonl"]).expect(0);
    let found = objects(&ran.out);
    assert_eq!(found.iter().map(|row| row["file"].as_str().unwrap()).collect::<Vec<_>>(), ["0000.png", "0001.png"]);
    place.run(&["run", "in", "-q", "-o", "a.csv"]).expect(0);
    assert_eq!(
        objects(&place.run(&["export", "a.csv", "-o", "-", "--format", "jsonl"]).expect(0).out),
        found_without_time(&place)
    );
}

/// Returns the rows of a.csv as JSON Lines.
fn found_without_time(place: &Place) -> Vec<Value> {
    place.run(&["export", "a.csv", "-o", "a.jsonl"]).expect(0);
    objects(&place.read("a.jsonl"))
}

#[test]
fn pictures_can_be_listed_on_standard_input() {
    let place = Place::with_pictures(3);
    let whole = without_time(&place.run(&["run", "in", "-q"]).expect(0).out);
    for list in ["in/0000.png\nin/0002.png\n", "in/0000.png\0in/0002.png\0", "in/0000.png\r\nin/0002.png"] {
        let ran = with_stdin(place.command(&["run", "-", "-q"]), list.as_bytes()).expect(0);
        let found = rows(&ran.out);
        assert_eq!(found.iter().map(|row| cell(row, "file")).collect::<Vec<_>>(), ["0000.png", "0002.png"], "{list:?}");
        assert_eq!(cell(&found[1], "axis_y"), cell(&whole[2], "axis_y"));
    }
    with_stdin(place.command(&["run", "-"]), b"\n").expect(2).says("standard input has no names of pictures");
    with_stdin(place.command(&["run", "-", "in"]), b"a.png\n").expect(2).says("cannot be combined");
    with_stdin(place.command(&["run", "-"]), b"in/9.png\n").expect(2).says("in/9.png: no such file");
}

/// Another program may delete a picture after the list was made.
#[test]
fn a_missing_picture_of_a_list_is_a_row() {
    let place = Place::with_pictures(2);
    let list = b"in/0000.png\nin/gone.png\nin/0001.png\n";
    let named = place.run(&["run", "in/0000.png", "in/gone.png", "in/0001.png"]).expect(3);
    for ran in [named, with_stdin(place.command(&["run", "-"]), list).expect(3)] {
        let ran = ran.says("unreadable: gone.png: no such file");
        let found = without_time(&ran.out);
        assert_eq!(found.iter().map(|row| cell(row, "status")).collect::<Vec<_>>(), ["ok", "unreadable", "ok"]);
        assert_eq!(cell(&found[1], "detail"), "no such file");
    }
    // A list of which nothing is there, and a name that is no picture, are mistakes.
    place.run(&["run", "in/8.png", "in/9.png"]).expect(2).says("in/8.png: no such file or folder");
    place.run(&["run", "in/0000.png", "flight"]).expect(2).says("flight: no such file or folder");
}

#[test]
fn headerless_pictures_can_come_on_standard_input() {
    let place = Place::with_pictures(2);
    let mut bytes: Vec<u8> = (0..2).flat_map(|i| limb(320, 240, f64::from(i)).into_raw()).collect();
    place.write("sensor.toml", format!("{SENSOR}limb = \"height\"\n").as_bytes());
    place.write("in/sensor.toml", format!("{SENSOR}limb = \"height\"\n").as_bytes());
    let whole = rows(&place.run(&["run", "in", "-q"]).expect(0).out);
    let args = ["run", "-", "--raw", "320x240:mono8", "--fps", "4"];
    let found = rows(&with_stdin(place.command(&args), &bytes).expect(0).out);
    for (i, (stream, file)) in found.iter().zip(&whole).enumerate() {
        assert_eq!(cell(stream, "file"), format!("stdin#{i:06}"));
        assert_eq!(cell(stream, "time_s"), ["0.0", "0.25"][i]);
        assert_eq!(cell(stream, "axis_y"), cell(file, "axis_y"));
    }
    assert_eq!(found.len(), 2);
    bytes.truncate(100_000);
    with_stdin(place.command(&args), &bytes).expect(3).says("is cut off: 23200 of 76800 bytes");
}

#[test]
fn a_sensor_is_found_in_a_folder_above() {
    let place = Place::with_pictures(1);
    std::fs::create_dir_all(place.path("in/day/one")).unwrap();
    std::fs::rename(place.path("in/0000.png"), place.path("in/day/one/0000.png")).unwrap();
    place.run(&["run", "in/day/one"]).expect(0).says("in/sensor.toml, in a folder above the pictures");
    // The nearest one counts, and one next to the pictures is not worth a note.
    place.write("in/day/sensor.toml", SENSOR.replace("width = 320", "width = 640").as_bytes());
    place.run(&["run", "in/day/one"]).expect(2).says("the sensor is for pictures of 640 x 240 px");
    place.write("in/day/one/sensor.toml", SENSOR.as_bytes());
    let ran = place.run(&["run", "in/day/one"]).expect(0);
    assert!(!ran.err.contains("above"), "{}", ran.err);
}

#[test]
fn info_has_the_same_facts_as_json() {
    let place = Place::with_pictures(2);
    place.run(&["run", "in", "-q", "-o", "a.csv", "-o", "a.mcap"]).expect(0);
    let info =
        |file: &str| -> Value { serde_json::from_str(&place.run(&["info", file, "--json"]).expect(0).out).unwrap() };
    for (file, kind) in [("a.csv", "results"), ("a.mcap", "recording")] {
        let facts = info(file);
        assert_eq!(facts["kind"], kind);
        assert_eq!(facts["pictures"], 2);
        assert_eq!(facts["time_s"], serde_json::json!([0.0, 1.0]));
        assert_eq!(facts["bodies"][0]["statuses"]["ok"], 2);
        assert!(facts["bodies"][0]["sigma_deg"]["median"].as_f64().unwrap() > 0.0);
        assert_eq!(facts["is_complete"], true);
    }
    assert_eq!(info("a.mcap")["camera"]["fx_px"], 300.0);
    assert_eq!(info("in/sensor.toml")["bodies"][0]["altitude_km"], 400.0);
    assert_eq!(info("in/0000.png")["width_px"], 320);
    place.write("frames.csv", b"file,altitude_km\n0000.png,400\n0001.png,\n");
    assert_eq!(info("frames.csv")["with_altitude"], 1);
}

#[test]
fn evaluate_prints_its_report_as_json() {
    let place = Place::with_pictures(2);
    place.run(&["run", "in", "-q", "-o", "a.csv"]).expect(0);
    let row = |i: u32| format!("000{i}.png,{i},earth-sphere,1,0,0.927184,0.374607,70.38,400,,,,,,,1,0,0,0\n");
    let columns = "file,time_s,body,limb,axis_x,axis_y,axis_z,half_angle_deg,altitude_km,sun_x,sun_y,sun_z,moon_x,\
                   moon_y,moon_z,qw,qx,qy,qz\n";
    place.write("truth.csv", format!("{columns}{}{}", row(0), row(1)).as_bytes());
    let args = ["evaluate", "a.csv", "--truth", "truth.csv", "--json"];
    let printed = place.run(&[&args[..], &["-o", "report.json"]].concat()).expect(0).out;
    let report: Value = serde_json::from_str(&printed).unwrap();
    assert_eq!(report["frames"].as_array().unwrap().len(), 2);
    assert_eq!(report, serde_json::from_str::<Value>(&place.read("report.json")).unwrap());
}

#[test]
fn messages_are_as_detailed_as_is_asked_for() {
    let place = Place::with_pictures(1);
    let says = |command: &mut Command| {
        let ran = Ran::from_output(&command.output().unwrap(), &place.path("")).expect(0);
        (ran.err.contains("sensor: in/sensor.toml"), ran.err.contains("0000.png: ok"))
    };
    assert_eq!(says(&mut place.command(&["run", "in"])), (false, false));
    assert_eq!(says(&mut place.command(&["run", "in", "-v"])), (true, false));
    assert_eq!(says(&mut place.command(&["-vv", "run", "in"])), (true, true));
    assert_eq!(says(place.command(&["run", "in"]).env("HZN_LOG", "info")), (true, false));
    assert_eq!(says(place.command(&["run", "in"]).env("HZN_LOG", "debug")), (true, true));
    let refused = place.command(&["run", "in"]).env("HZN_LOG", "loud").output().unwrap();
    Ran::from_output(&refused, &place.path("")).expect(2).says("HZN_LOG=loud: the levels are warn, info and debug");
}

#[test]
fn manual_pages_and_completions_have_every_command() {
    let place = Place::new();
    let page = place.run(&["man", "calibrate", "sky"]).expect(0).out;
    assert!(page.contains(".TH hzn-calibrate-sky 1") && page.contains("\\-\\-ignore\\-sigmas"), "{page}");
    place.run(&["man", "calibrate", "skies"]).expect(2).says("calibrate has no command \"skies\"");
    place.run(&["man", "-o", "man"]).expect(0);
    for name in ["hzn.1", "hzn-run.1", "hzn-camera-convert.1"] {
        assert!(place.read(&format!("man/{name}")).contains("Examples:") || name == "hzn.1");
    }
    place.run(&["man", "-o", "man"]).expect(2).says("exists already");
    for (shell, word) in
        [("powershell", "Register-ArgumentCompleter"), ("elvish", "edit:completion"), ("fish", "complete")]
    {
        let text = place.run(&["completions", shell]).expect(0).out;
        assert!(text.contains(word) && text.contains("ignore-sigmas"), "{shell}");
    }
}

#[cfg(unix)]
#[test]
fn a_folder_that_grows_is_watched_until_the_user_ends_it() {
    use std::time::{Duration, Instant};

    use nix::sys::signal::{Signal, kill};
    use nix::unistd::Pid;

    let place = Place::new();
    let args = ["run", "in", "--watch", "-q", "-j", "2", "-o", "out.csv"];
    let mut child = place.command(&args).stderr(Stdio::piped()).spawn().unwrap();
    let wait_for = |rows: usize| {
        let end = Instant::now() + Duration::from_secs(60);
        let count = || std::fs::read_to_string(place.path("out.csv.part")).map_or(0, |text| text.lines().count());
        while count() < 1 + rows {
            assert!(Instant::now() < end, "{} of {rows} rows", count());
            std::thread::sleep(Duration::from_millis(50));
        }
    };
    let png = |shift: f64| {
        let mut bytes = std::io::Cursor::new(Vec::new());
        limb(320, 240, shift).write_to(&mut bytes, image::ImageFormat::Png).unwrap();
        bytes.into_inner()
    };
    // The folder is empty at first; later a picture arrives in two parts.
    std::thread::sleep(Duration::from_millis(300));
    place.write("in/b.png", &png(0.0));
    wait_for(1);
    let late = png(1.0);
    place.write("in/a.png", &late[..late.len() / 2]);
    std::thread::sleep(Duration::from_millis(300));
    place.write("in/a.png", &late);
    wait_for(2);
    kill(Pid::from_raw(child.id() as i32), Signal::SIGINT).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(0));
    let found = rows(&place.read("out.csv"));
    let results: Vec<_> = found.iter().map(|row| (cell(row, "file"), cell(row, "status"))).collect();
    assert_eq!(results, [("b.png", "ok"), ("a.png", "ok")]);
    place.run(&["run", "in/a.png", "--watch"]).expect(2).says("only one folder can be watched");
}

#[cfg(target_os = "linux")]
#[test]
fn a_watched_run_ends_when_its_output_fails() {
    let place = Place::with_pictures(1);
    let args = ["run", "in", "--watch", "-q"];
    let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
    let output = place.command(&args).stdout(full).output().unwrap();
    Ran::from_output(&output, &place.path("")).expect(1).says("results cannot be written to stdout");
}
