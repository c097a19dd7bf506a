//! What a terminal would obey reaches no terminal: neither from a name nor from the content of a file.
#![cfg(unix)]

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use crate::common::{Place, SENSOR, commands};
use hzn_core::status::Status;
use hzn_mcap::{FrameRecord, Options, Row, RowMeta, Writer};

/// Writes the clipboard, colours, reverses the order of reading, and begins a line that looks like one of hzn.
const EVIL: &str = "\x1b]52;c;aGk\x07\u{9b}31m\u{202e}\u{2066}\x7f\r\nFAKE";
/// The same, as hzn shows it.
const SHOWN: &str = r"\x1b]52;c;aGk\x07\x9b31m\u{202e}\u{2066}\x7f\r\nFAKE";
/// The evil text in the arguments below.
const E: &str = "{E}";

/// Commands that print an evil text: as the name of a file that is there, of one that is missing, from the content of a
/// file, or as a word that is refused.
const CASES: &[&[&str]] = &[
    &["info", "metadata.mcap"],
    &["info", "foreign.mcap"],
    &["info", "row.csv"],
    &["info", "truth.csv"],
    &["info", "columns.csv"],
    &["info", "key.toml"],
    &["info", "{E}.toml"],
    &["run", "d{E}", "-o", "a.csv"],
    &["run", "d{E}", "-o", "{E}.csv", "--force"],
    &["run", "in", "--frames", "frames.csv", "-o", "b.csv"],
    &["run", "in", "-o", "no{E}/x.csv"],
    &["run", "in", "--overlay", "d{E}"],
    &["run", "in", "--wcs", "w{E}"],
    &["run", "{E}"],
    &["run", "in", "--raw", "{E}"],
    &["run", "in", "--{E}"],
    &["{E}"],
    &["help", "{E}"],
    &["explain", "d{E}/0000{E}.png"],
    &["explain", "d{E}/x{E}.png", "--sensor", "in/sensor.toml"],
    &["explain", "in", "--overlay", "o{E}.png"],
    &["export", "{E}"],
    &["export", "metadata.mcap", "-o", "no{E}/a.csv"],
    &["recover", "{E}"],
    &["recover", "metadata.mcap", "-o", "{E}.mcap"],
    &["fuse", "--nadir", "c{E}.csv", "--imu", "i.csv", "--gnss", "g.csv", "--mount", "a=b", "-o", "n.csv"],
    &["fuse", "--nadir", "{E}", "--imu", "i.csv", "--gnss", "g.csv", "-o", "n.csv"],
    &["simulate", "{E}", "-o", "o"],
    &["simulate", "enceladus", "-o", "d{E}"],
    &["simulate", "enceladus", "--frames", "1", "-q", "-o", "sim{E}"],
    &["init", "-o", "{E}.new.toml"],
    &["init", "{E}"],
    &["evaluate", "row.csv", "--truth", "truth.csv"],
    &["evaluate", "{E}.csv", "--truth", "truth.csv"],
    &["sensitivity", "--sensor", "{E}"],
    &["sensitivity", "--body", "{E}"],
    &["calibrate", "board", "d{E}", "--board", "9x6"],
    &["calibrate", "points", "{E}", "--size", "320x240"],
    &["calibrate", "sky", "{E}"],
    &["calibrate", "check", "{E}"],
    &["calibrate", "noise", "d{E}"],
    &["camera", "show", "key.toml"],
    &["camera", "show", "{E}.yaml"],
    &["camera", "convert", "in/sensor.toml", "-o", "{E}.converted.toml"],
    &["telemetry", "{E}"],
    &["telemetry", "metadata.mcap", "--housekeeping", "no{E}/x.csv"],
    &["telecommand", "ping", "-o", "no{E}/x.bin"],
    &["telecommand", "--to", "{E}", "ping"],
    &["demo", "d{E}"],
    &["completions", "{E}"],
    &["man", "{E}"],
    &["migrate", "{E}.missing.toml"],
    &["prepare", "{E}.missing.toml"],
    &["schema", "{E}"],
    &["key", "{E}"],
    &["key", "no{E}/k.key", "--spacecraft", "1"],
    &["run", "rig/rig.toml"],
    &["calibrate", "rig", "rig/rig.toml"],
    &["calibrate", "rig", "{E}.missing.toml"],
    &["calibrate", "mount", "kalibr", "{E}"],
    #[cfg(target_os = "linux")]
    &["fly", "-", "--sensor", "{E}"],
    #[cfg(target_os = "linux")]
    &["fly", "-", "--sensor", "in/sensor.toml", "--state", "in/0000.png/{E}"],
];

/// The only command that prints nothing of its own: it starts the window.
const WITHOUT: &str = "view";

/// Returns a folder with files whose names and contents are evil.
fn place() -> Place {
    let place = Place::with_pictures(2);
    let folder = format!("d{EVIL}");
    fs::create_dir(place.path(&folder)).unwrap();
    for name in ["sensor.toml", "0000.png"] {
        let to = name.replace("0000", &format!("0000{EVIL}"));
        fs::copy(place.path(&format!("in/{name}")), place.path(&format!("{folder}/{to}"))).unwrap();
    }
    place.write(&format!("{folder}/x{EVIL}.png"), b"no picture");
    place.write(&format!("{EVIL}.toml"), b"x");
    place.write("key.toml", format!("{SENSOR}\n[{:?}]\na = 1\n", "KEY").replace("KEY", &toml_escape()).as_bytes());
    let rig = format!("[rig]\n\"{}\" = 1\n\n[[head]]\nname = \"a\"\npictures = \"../in\"\n", toml_escape());
    // Elsewhere, the truth would be that of a rig.
    fs::create_dir(place.path("rig")).unwrap();
    place.write("rig/rig.toml", rig.as_bytes());
    place.write("frames.csv", format!("file,altitude_km\n\"{EVIL}.png\",400\n").as_bytes());
    place.write("columns.csv", format!("a,\"{EVIL}\"\n1,2\n").as_bytes());
    let truth = "file,time_s,body,limb,axis_x,axis_y,axis_z,half_angle_deg,altitude_km,sun_x,sun_y,sun_z,moon_x,moon_y,\
                 moon_z,qw,qx,qy,qz\n";
    place.write("truth.csv", format!("{truth}\"{EVIL}.png\",0,\"{EVIL}\",1,0,1,0,70,400,,,,,,,1,0,0,0\n").as_bytes());
    let meta = RowMeta {
        index: 0,
        file: format!("{EVIL}.png"),
        time_s: Some(0.0),
        body: EVIL.to_owned(),
        altitude_km: Some(400.0),
    };
    let row = Row::unprocessed(&meta, Status::NoLimb, EVIL);
    let metadata = BTreeMap::from([(EVIL.to_owned(), EVIL.to_owned())]);
    let options = Options { sensor_toml: SENSOR.to_owned(), metadata, ..Options::default() };
    let mut writer = Writer::create(place.path("metadata.mcap"), &options).unwrap();
    writer.write(&FrameRecord::new(row)).unwrap();
    writer.finish().unwrap();
    place.run(&["export", "metadata.mcap", "-o", "row.csv"]).expect(0);
    foreign(&place.path("foreign.mcap"));
    place
}

/// Returns the evil text inside of a TOML string.
fn toml_escape() -> String {
    EVIL.chars()
        .map(|c| if c.is_ascii_graphic() { c.to_string() } else { format!("\\u{:04x}", u32::from(c)) })
        .collect()
}

/// Writes a recording of another program with an evil topic.
fn foreign(path: &Path) {
    let mut writer = mcap::Writer::new(fs::File::create(path).unwrap()).unwrap();
    let schema = writer.add_schema("sensor_msgs/msg/CompressedImage", "ros2msg", b"").unwrap();
    let channel = writer.add_channel(schema, EVIL, "cdr", &BTreeMap::new()).unwrap();
    let header = mcap::records::MessageHeader { channel_id: channel, sequence: 0, log_time: 1, publish_time: 1 };
    writer.write_to_known_channel(&header, b"no picture").unwrap();
    writer.finish().unwrap();
}

#[track_caller]
fn assert_harmless(text: &str, what: &[&str]) {
    let obeyed =
        |c: char| matches!(u32::from(c), 0..=0x9 | 0xb..=0x1f | 0x7f..=0x9f | 0x202a..=0x202e | 0x2066..=0x2069);
    assert!(!text.contains(obeyed), "{what:?} prints {text:?}");
    assert!(!text.lines().any(|line| line.starts_with("FAKE")), "{what:?} prints {text:?}");
}

#[test]
fn no_command_prints_what_a_terminal_obeys() {
    let place = place();
    for args in CASES {
        let evil: Vec<String> = args.iter().map(|arg| arg.replace(E, EVIL)).collect();
        let ran = place.run(&evil.iter().map(String::as_str).collect::<Vec<_>>());
        assert_harmless(&ran.out, args);
        assert_harmless(&ran.err, args);
        // The text was printed, and nothing of it is missing.
        let all = ran.out + &ran.err;
        assert!(all.contains(SHOWN), "{args:?} prints {all:?}");
    }
}

#[test]
fn every_command_is_in_the_table() {
    let place = Place::new();
    for group in [&[][..], &["calibrate"], &["camera"]] {
        let all = commands(&place, &[group, &["--help"]].concat());
        assert!(all.len() > 2, "{all:?}");
        for name in all.iter().filter(|name| *name != "help" || group.is_empty()) {
            let words = [group, &[name.as_str()]].concat();
            let is_listed = CASES.iter().any(|args| args.starts_with(&words));
            // On other systems there is no `fly`.
            assert!(is_listed != (name == WITHOUT), "{words:?}");
        }
    }
}

/// A recording whose names are evil, and which is read all the same.
#[test]
fn what_is_made_of_a_hostile_recording_prints_nothing_of_it() {
    let place = place();
    place.run(&["run", &format!("d{EVIL}"), "-o", "evil.mcap", "-q"]).expect(3);
    for args in [
        &["export", "evil.mcap", "-o", "evil.csv"][..],
        &["export", "evil.mcap", "--images", "images"],
        &["export", "evil.mcap", "--overlay", "drawn"],
        &["run", "evil.mcap", "-o", "again.csv"],
        &["recover", "evil.mcap", "-o", "kept.mcap"],
        &["info", "evil.mcap"],
        &["explain", "evil.mcap"],
    ] {
        let ran = place.run(args);
        assert!(matches!(ran.code, 0 | 3), "{args:?}: {}", ran.err);
        assert_harmless(&ran.out, args);
        assert_harmless(&ran.err, args);
    }
}

/// A name need not be text. Its bytes that are none are shown as U+FFFD, which no terminal obeys.
#[test]
#[cfg(target_os = "linux")]
fn names_that_are_no_text_are_shown_as_text() {
    use std::os::unix::ffi::OsStrExt;
    let place = Place::with_pictures(1);
    let name = |bytes: &[u8]| std::ffi::OsStr::from_bytes(bytes).to_owned();
    let folder = name(b"d\xff\x9b\x1b[2J");
    let at = place.path("").join(&folder);
    fs::create_dir(&at).unwrap();
    fs::copy(place.path("in/sensor.toml"), at.join("sensor.toml")).unwrap();
    fs::copy(place.path("in/0000.png"), at.join(name(b"\xfe\x1b]0;x\x07.png"))).unwrap();
    fs::write(at.join(name(b"z\xfe\x1b]0;x\x07.png")), "no picture").unwrap();
    let picture = at.join(name(b"z\xfe\x1b]0;x\x07.png"));
    for (args, code) in [
        (vec!["run".into(), folder.clone(), "-o".into(), "a.csv".into()], 3),
        (vec!["run".into(), folder.clone(), "-o".into(), name(b"o\xff\x1b.txt")], 2),
        (vec!["explain".into(), picture.clone().into_os_string()], 3),
        (vec!["info".into(), picture.into_os_string()], 1),
        (vec!["export".into(), name(b"no\xff\x1b.mcap")], 2),
    ] {
        let output = place.command(&[]).args(&args).output().unwrap();
        let all = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
        assert_harmless(&all, &[]);
        assert!(output.status.code() == Some(code) && all.contains("\u{fffd}"), "{args:?}: {:?} {all}", output.status);
    }
    let rows = place.rows("a.csv");
    let files: Vec<&str> = rows.iter().map(|row| crate::common::cell(row, "file")).collect();
    assert!(files.len() == 2 && files.contains(&"\u{fffd}\x1b]0;x\x07.png"), "{files:?}");
}

/// The command runs in a terminal that the program `script` makes.
#[test]
#[cfg(target_os = "linux")]
fn a_real_terminal_gets_nothing_that_it_obeys() {
    let place = place();
    let hzn = place.command(&[]);
    for (args, code) in
        [(format!("run 'd{EVIL}' -q"), 3), ("info metadata.mcap".to_owned(), 0), (format!("info '{EVIL}.toml'"), 2)]
    {
        let mut script = std::process::Command::new("script");
        script.args(["-qec", &format!("{} {args}", hzn.get_program().display()), "/dev/null"]);
        script.current_dir(place.path("")).stdin(std::process::Stdio::null()).env("NO_COLOR", "1");
        let output = match script.output() {
            Ok(output) => output,
            Err(e) => return eprintln!("the terminal is left out: no program script: {e}"),
        };
        // A terminal begins its lines with a carriage return.
        let shown = String::from_utf8(output.stdout).unwrap().replace("\r\n", "\n");
        assert_eq!(output.status.code(), Some(code), "{shown}");
        assert_harmless(&shown, &[&args]);
        assert!(shown.contains(SHOWN), "{args} prints {shown:?}");
    }
}

#[test]
fn files_and_pipes_get_the_bytes_as_they_are() {
    let place = place();
    let folder = format!("d{EVIL}");
    let piped = place.command(&["run", &folder, "-q"]).output().unwrap().stdout;
    let piped = String::from_utf8(piped).unwrap();
    place.run(&["run", &folder, "-q", "-o", "a.csv"]).expect(3);
    place.run(&["run", &folder, "-q", "-o", "a.jsonl"]).expect(3);
    assert!(piped.contains(EVIL) && place.read("row.csv").contains(EVIL));
    assert_eq!(crate::common::without_time(&piped), crate::common::without_time(&place.read("a.csv")));
    assert!(place.read("a.jsonl").contains(r"aGk\u0007"), "JSON has its own escapes");
    // The content of a scene is no message either.
    let scene = place.run(&["simulate", "enceladus", "--show"]).expect(0).out + "# \u{202e}\tx\n";
    place.write("scene.toml", scene.as_bytes());
    assert_eq!(place.run(&["simulate", "scene.toml", "--show"]).expect(0).out, scene);
}

/// Everything else goes through `tell`, which makes a text harmless. `progress` only asks whether there is a terminal.
/// The window prints its errors and answers through the same functions, and its measurement prints only numbers.
const MAY_USE_TERMINAL: [&str; 6] = [
    "hzn-cli/src/tell.rs",
    "hzn-cli/src/progress.rs",
    "hzn-run/src/terminal.rs",
    "hzn-viewer/src/main.rs",
    "hzn-viewer/src/measure.rs",
    "hzn-viewer/src/run.rs",
];

#[test]
fn only_few_files_use_the_terminal() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let mut found = Vec::new();
    for entry in fs::read_dir(crates).unwrap() {
        scan(&entry.unwrap().path().join("src"), crates, &mut found);
    }
    found.sort();
    assert_eq!(found, {
        let mut may = MAY_USE_TERMINAL.map(str::to_owned);
        may.sort();
        may
    });
}

/// Finds the files that print, outside of tests.
/// Returns whether a file has only tests.
fn is_of_tests(path: &Path) -> bool {
    path.file_name().and_then(|name| name.to_str()).is_some_and(|name| name.ends_with("tests.rs"))
}

fn scan(folder: &Path, crates: &Path, found: &mut Vec<String>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            scan(&path, crates, found);
        } else if path.extension().is_some_and(|ending| ending == "rs") && !is_of_tests(&path) {
            let text = fs::read_to_string(&path).unwrap();
            let code = text.split("#[cfg(test)]\nmod ").next().unwrap().lines();
            let prints = |line: &str| {
                let code = line.split("//").next().unwrap();
                ["io::stdout", "io::stderr", "print!(", "println!(", "dbg!("].iter().any(|call| code.contains(call))
            };
            if code.into_iter().any(prints) {
                found.push(path.strip_prefix(crates).unwrap().to_str().unwrap().to_owned());
            }
        }
    }
}
