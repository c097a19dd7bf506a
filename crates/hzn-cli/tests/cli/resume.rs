//! Tests of runs that end early, on a full disk or by a signal, and of their continuation.

#[cfg(target_os = "linux")]
use crate::common::limited;
use crate::common::{Place, without_time};
use std::time::{Duration, Instant};

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_reported() {
    let place = Place::with_pictures(3);
    // /dev/full replaces the unfinished file: every write to it reports a full disk.
    std::os::unix::fs::symlink("/dev/full", place.path("a.csv.part")).unwrap();
    place.run(&["run", "in", "-o", "a.csv", "--force"]).expect(1).says("the disk is full");
    std::os::unix::fs::symlink("/dev/full", place.path("a.mcap.part")).unwrap();
    place.run(&["run", "in", "-o", "a.mcap", "--force"]).expect(1).says("no space is left").says("resume the run");
    std::os::unix::fs::symlink("/dev/full", place.path("o.png")).unwrap();
    place.run(&["explain", "in/0000.png", "--overlay", "o.png", "--force"]).expect(1).says("the disk is full");
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let output = place.command(&["run", "in"]).stdout(full).output().unwrap();
    crate::common::Ran::from_output(&output, &place.path("")).expect(1).says("cannot be written to stdout");
}

/// A limit on the file size simulates a disk that fills up during a run.
#[cfg(target_os = "linux")]
#[test]
fn a_disk_that_fills_up_keeps_what_is_finished() {
    let place = Place::with_pictures(600);
    place.run(&["run", "in", "-o", "whole.csv", "-q"]).expect(0);
    let whole = without_time(&place.read("whole.csv"));
    for (out, blocks) in [("a.csv", 60), ("a.jsonl", 120), ("a.mcap", 800)] {
        limited(&place, &format!("ulimit -f {blocks}"), &["run", "in", "-o", out])
            .expect(1)
            .says("ulimit -f")
            .says("resume the run to");
        assert!(!place.path(out).exists());
        let info = place.run(&["info", &format!("{out}.part")]).expect(0).out;
        assert!(!info.contains("pictures         0"), "{out}: {info}");
        place.run(&["run", "in", "-o", out, "--resume"]).expect(0).says("that were finished before");
        place.run(&["export", out, "-o", "rows.csv", "--force"]).expect(0);
        assert_eq!(without_time(&place.read("rows.csv")), whole, "{out}");
    }
}

/// Starts a run of many pictures, waits until some are finished, and ends it with the signal `end`.
#[cfg(unix)]
fn end_early(place: &Place, out: &str, end: &str) -> Option<i32> {
    let mut child =
        place.command(&["run", "in", "-o", out, "-j", "1"]).stderr(std::process::Stdio::null()).spawn().unwrap();
    let part = place.path(&format!("{out}.part"));
    let begin = Instant::now();
    // The file is larger than the part before the first picture.
    let grown = |part: &std::path::Path| std::fs::metadata(part).is_ok_and(|m| m.len() > 100_000);
    while !grown(&part) && begin.elapsed() < Duration::from_secs(30) && child.try_wait().unwrap().is_none() {
        std::thread::sleep(Duration::from_millis(2));
    }
    if out.ends_with(".mcap") {
        // Pictures precede their results in a recording; the pause lets the results follow.
        std::thread::sleep(Duration::from_millis(60));
    }
    let id = child.id().to_string();
    std::process::Command::new("kill").args([end, &id]).status().unwrap();
    child.wait().unwrap().code()
}

#[cfg(unix)]
#[test]
fn killed_and_continued_gives_the_same() {
    let place = Place::with_pictures(2000);
    place.run(&["run", "in", "-o", "whole.csv", "-q"]).expect(0);
    let whole = without_time(&place.read("whole.csv"));
    for out in ["a.csv", "a.jsonl", "a.mcap"] {
        let code = end_early(&place, out, "-9");
        assert_eq!(code, None, "{out}: ended before it was killed");
        assert!(!place.path(out).exists());
        place.run(&["run", "in", "-o", out]).expect(2).says("--resume");
        place.run(&["run", "in", "-o", out, "--resume"]).expect(0).says("that were finished before");
        place.run(&["export", out, "-o", "rows.csv", "--force"]).expect(0);
        assert_eq!(without_time(&place.read("rows.csv")), whole, "{out}");
    }
}

#[cfg(unix)]
#[test]
fn recover_closes_what_a_crash_left() {
    let place = Place::with_pictures(2000);
    for out in ["a.csv", "a.mcap"] {
        end_early(&place, out, "-9");
        // The end of the last write is cut off.
        let part = place.path(&format!("{out}.part"));
        let file = std::fs::OpenOptions::new().write(true).open(&part).unwrap();
        file.set_len(std::fs::metadata(&part).unwrap().len() - 3).unwrap();
        let ran =
            place.run(&["recover", &format!("{out}.part")]).expect(0).says(" bytes without whole pictures dropped");
        let kept = ran.err.split_whitespace().nth(1).unwrap().to_owned();
        place.run(&["export", out, "-o", "kept.csv", "--force"]).expect(0).says(&format!("{kept} rows"));
        place.run(&["info", out]).expect(0);
        assert!(!place.path(&format!("{out}.part")).exists());
        // The recovered file can be continued.
        place.run(&["run", "in", "-o", out, "--resume"]).expect(0);
        place.run(&["export", out, "-o", "rows.csv", "--force"]).expect(0).says("2000 rows");
    }
}

#[cfg(unix)]
#[test]
fn interrupted_leaves_a_valid_file() {
    let place = Place::with_pictures(2000);
    for out in ["a.csv", "a.mcap"] {
        assert_eq!(end_early(&place, out, "-INT"), Some(130), "{out}");
        assert!(place.path(out).exists());
        place.run(&["info", out]).expect(0);
        let chain = place.path(&format!("{out}.part.chain"));
        assert!(chain.exists(), "the run may be continued");
        place.run(&["run", "in", "-o", out, "--resume"]).expect(0);
        assert!(!chain.exists(), "the run is over");
        place.run(&["export", out, "-o", "rows.csv", "--force"]).expect(0).says("2000 rows");
    }
}

#[test]
fn another_input_is_not_appended() {
    let place = Place::with_pictures(4);
    place.run(&["run", "in/0000.png", "in/0002.png", "-o", "a.csv"]).expect(0);
    let before = place.read("a.csv");
    let err = place.run(&["run", "in", "-o", "a.csv", "--resume"]).expect(2).err;
    insta::assert_snapshot!(err, @"error: a.csv: its last picture is 0002.png, but the input has 0001.png in this place; \
                                   give the input that it was begun with, or start over with --force");
    let err = place.run(&["run", "in/0000.png", "-o", "a.csv", "--resume"]).expect(2).err;
    insta::assert_snapshot!(err, @"error: a.csv: contains 2 pictures, but the input has only 1; give the input that it was \
                                   begun with, or start over with --force");
    assert_eq!(place.read("a.csv"), before);
}

#[test]
fn another_sensor_is_not_appended() {
    let place = Place::with_pictures(4);
    for out in ["a.csv", "a.jsonl", "a.mcap"] {
        place.run(&["run", "in/0000.png", "in/0001.png", "-o", out]).expect(0);
        let before = std::fs::read(place.path(out)).unwrap();
        place
            .run(&["run", "in", "-o", out, "--resume", "--altitude-km", "410"])
            .expect(2)
            // A recording contains its sensor.
            .says(if out == "a.mcap" { "was begun with another sensor.toml" } else { "now gives another result" });
        assert!(std::fs::read(place.path(out)).unwrap() == before, "{out}");
        place.write("other.toml", format!("{}[consensus]\nseed = 2\n", crate::common::SENSOR).as_bytes());
        let ran = place.run(&["run", "in", "-o", out, "--resume", "-s", "other.toml"]);
        assert!(ran.code == 2 && ran.err.contains("--force"), "{out}: {}", ran.err);
        assert!(std::fs::read(place.path(out)).unwrap() == before, "{out}");
        place.run(&["run", "in", "-o", out, "--resume"]).expect(0).says("2 pictures: 2 ok");
    }
}

/// A picture in the middle is replaced between two runs, and the table of the pictures is edited.
#[test]
fn changed_pictures_are_not_mixed_with_their_old_results() {
    let place = Place::with_pictures(5);
    let table = |altitudes: [u32; 5]| {
        let rows = altitudes.iter().enumerate().map(|(i, km)| format!("{i:04}.png,{i},{km}\n")).collect::<String>();
        place.write("in/frames.csv", format!("file,time_s,altitude_km\n{rows}").as_bytes());
    };
    table([400; 5]);
    for out in ["a.csv", "a.jsonl", "a.mcap"] {
        place.run(&["run", "in/0000.png", "in/0001.png", "in/0002.png", "-o", out]).expect(0);
        let before = std::fs::read(place.path(out)).unwrap();
        let resume = || place.run(&["run", "in", "-o", out, "--resume"]);
        let refuse = |what: &str| {
            // The second time, the results must not look newer than what was changed after them.
            for _ in 0..2 {
                resume().expect(2).says(what).says("--force");
                assert!(std::fs::read(place.path(out)).unwrap() == before, "{out}");
            }
            let part = format!("{out}.part");
            std::fs::rename(place.path(out), place.path(&part)).unwrap();
            resume().expect(2).says(what);
            place.run(&["recover", &part]).expect(0);
            resume().expect(2).says(what);
            std::fs::write(place.path(out), &before).unwrap();
        };
        let old = std::fs::read(place.path("in/0001.png")).unwrap();
        let time = std::fs::metadata(place.path("in/0001.png")).unwrap().modified().unwrap();
        std::fs::copy(place.path("in/0003.png"), place.path("in/0001.png")).unwrap();
        // Programs that copy may keep the time of the contents.
        let file = std::fs::File::options().write(true).open(place.path("in/0001.png")).unwrap();
        file.set_modified(if cfg!(unix) { time } else { std::time::SystemTime::now() }).unwrap();
        refuse("the picture 0001.png was changed since these results were written");
        place.write("in/0001.png", &old);
        table([410, 400, 400, 400, 400]);
        refuse("its picture 0000.png, now gives another result");
        // What changes no result is no obstacle.
        table([400, 400, 400, 410, 400]);
        let ran = resume().expect(0);
        assert!(ran.err.contains("frames.csv was changed since these results were written"), "{}", ran.err);
        table([400; 5]);
    }
}

/// Writes a file in the place of another one. A link to the old file keeps it. Its time of writing is an hour ago.
#[cfg(target_os = "linux")]
fn replace(place: &Place, name: &str, bytes: &[u8]) {
    std::fs::remove_file(place.path(name)).unwrap();
    place.write(name, bytes);
    shift_time(place, name, -1);
}

/// Lets a file look as if it was written so many hours from now.
#[cfg(target_os = "linux")]
fn shift_time(place: &Place, name: &str, hours: i64) {
    let shift = Duration::from_secs(3600 * hours.unsigned_abs());
    let now = std::time::SystemTime::now();
    let time = if hours < 0 { now - shift } else { now + shift };
    std::fs::File::options().write(true).open(place.path(name)).unwrap().set_modified(time).unwrap();
}

/// The results look newer than all pictures, as those do that were copied, or whose run still wrote when a picture was
/// replaced. Only the file next to them tells what was changed.
#[cfg(target_os = "linux")]
#[test]
fn a_continued_run_knows_which_pictures_and_rows_there_were() {
    let place = Place::with_pictures(600);
    place.run(&["run", "in", "-o", "whole.csv", "-q"]).expect(0);
    let whole = without_time(&place.read("whole.csv"));
    place.run(&["run", "in/0000.png", "in/0001.png", "-o", "other.csv", "--altitude-km", "410"]).expect(0);
    place.run(&["run", "in/0000.png", "in/0001.png", "-o", "other.jsonl", "--altitude-km", "410"]).expect(0);
    place.run(&["run", "in", "-o", "flight.mcap", "-q"]).expect(0);
    let first = std::fs::read(place.path("in/0001.png")).unwrap();
    let third = std::fs::read(place.path("in/0003.png")).unwrap();
    for (input, out, blocks) in
        [("in", "a.csv", 60), ("in", "a.jsonl", 120), ("in", "a.mcap", 800), ("flight.mcap", "b.csv", 60)]
    {
        limited(&place, &format!("ulimit -f {blocks}"), &["run", input, "-o", out]).expect(1);
        let part = format!("{out}.part");
        let chain = place.path(&format!("{part}.chain"));
        let (rows, known) = (std::fs::read(place.path(&part)).unwrap(), std::fs::read(&chain).unwrap());
        assert!(known.len() > 16 * 20, "{out}: {} bytes", known.len());
        let refuse = |what: &str| {
            shift_time(&place, &part, 1);
            let before = std::fs::read(place.path(&part)).unwrap();
            place.run(&["run", input, "-o", out, "--resume"]).expect(2).says(what).says("--force");
            // A recording that is continued is a copy.
            assert!(out == "a.mcap" || std::fs::read(place.path(&part)).unwrap() == before, "{out}");
            assert!(std::fs::read(&chain).unwrap() == known, "{out}");
        };
        let with_picture = |bytes: &[u8]| {
            replace(&place, "in/0001.png", bytes);
            if input != "in" {
                place.run(&["run", "in", "-o", input, "-q", "--force"]).expect(0);
            }
        };
        with_picture(&third);
        refuse("the picture 0001.png was changed since these results were written");
        with_picture(&first);
        if let Some(kind) = out.strip_prefix("a.").filter(|kind| *kind != "mcap") {
            // A row of another run, with a right checksum and in the right place.
            let head = usize::from(kind == "csv");
            let (own, other) = (String::from_utf8(rows.clone()).unwrap(), place.read(&format!("other.{kind}")));
            let line = |text: &str, n: usize| text.split_inclusive('\n').nth(head + n).unwrap().to_owned();
            place.write(&part, own.replace(&line(&own, 1), &line(&other, 1)).as_bytes());
            let note = format!("{out}: from picture 1 on, the rows are not those that were written");
            refuse(&note);
            refuse("its picture 0001.png, now gives another result");
            place.write(&part, &rows);
        }
        // A file of another run is no obstacle: the pictures are compared.
        place.write(&format!("{part}.chain"), &[&known[..16], &known[48..]].concat());
        shift_time(&place, &part, 1);
        let ran = place.run(&["run", input, "-o", out, "--resume"]).expect(0).says("that were finished before");
        ran.says("from picture 0 on, the rows are not those");
        assert!(!chain.exists());
        place.run(&["export", out, "-o", "rows.csv", "--force"]).expect(0);
        assert_eq!(without_time(&place.read("rows.csv")), whole, "{out}");
    }
}

/// Each row is as it was written, but one is missing or at another place.
#[test]
fn rows_that_were_removed_or_moved_are_noticed() {
    let place = Place::with_pictures(6);
    place.run(&["run", "in", "-o", "a.csv"]).expect(0);
    place.run(&["run", "in", "-o", "a.jsonl"]).expect(0);
    for (out, head) in [("a.csv", 1), ("a.jsonl", 0)] {
        let text = place.read(out);
        let whole: Vec<&str> = text.split_inclusive('\n').collect();
        std::fs::remove_file(place.path(out)).unwrap();
        let mut removed = whole[..5].to_vec();
        removed.remove(head + 1);
        // As many rows as pictures, and the last one is right.
        let mut twice = whole[..5].to_vec();
        twice[head + 1] = whole[head];
        let mut swapped = whole[..5].to_vec();
        swapped.swap(head, head + 1);
        for (rows, what) in [
            (removed, "picture 2 is at the place of picture 1"),
            (twice, "picture 0 is at the place of picture 1"),
            (swapped, "picture 1 is at the place of picture 0"),
        ] {
            place.write(&format!("{out}.part"), rows.concat().as_bytes());
            place.run(&["run", "in", "-o", out, "--resume"]).expect(2).says(what).says("--force starts over");
        }
        place.write(&format!("{out}.part"), whole[..5].concat().as_bytes());
        place.run(&["run", "in", "-o", out, "--resume"]).expect(0).says("that were finished before");
        std::fs::remove_file(place.path(out)).unwrap();
    }
}
