//! Pictures that are the one before to the last bit: a camera that stands still.

use crate::common::{Place, cell, limb, without_time};

/// Returns a folder of eight pictures with a table of times; the fourth to sixth repeat the third.
fn frozen(times: bool) -> Place {
    let place = Place::new();
    let mut table = String::from(if times { "file,time_s\n" } else { "file\n" });
    for i in 0..8 {
        let shown = if (3..6).contains(&i) { 2 } else { i };
        limb(320, 240, 3.0 * f64::from(shown)).save(place.path(&format!("in/{i:04}.png"))).unwrap();
        table += &if times { format!("{i:04}.png,{i}.5\n") } else { format!("{i:04}.png\n") };
    }
    place.write("in/frames.csv", table.as_bytes());
    place
}

fn statuses(text: &str) -> Vec<String> {
    without_time(text).iter().map(|row| format!("{} {}", cell(row, "status"), cell(row, "detail"))).collect()
}

#[test]
fn a_camera_that_stands_still_has_no_answer() {
    let run = frozen(true).run(&["run", "in", "-q"]).expect(0);
    let fixed = |i: usize| (3..6).contains(&i);
    for (i, status) in statuses(&run.out).iter().enumerate() {
        assert_eq!(status.starts_with("rejected") && status.contains("fixed"), fixed(i), "{i}: {status}");
        assert_eq!(status.trim() == "ok", !fixed(i), "{i}: {status}");
    }
    assert!(
        run.err.contains("warning: 3 pictures are the one before to the last bit (the first is 0003.png)"),
        "{}",
        run.err
    );
}

/// Copies of a picture without times are no contradiction.
#[test]
fn copies_without_times_are_told_only() {
    let place = frozen(false);
    let run = place.run(&["run", "in"]).expect(0);
    assert!(statuses(&run.out).iter().all(|status| status.trim() == "ok"), "{}", run.out);
    assert!(run.err.contains("note: 3 pictures are the one before to the last bit"), "{}", run.err);
    assert!(!place.run(&["run", "in", "-q"]).expect(0).err.contains("last bit"));
}

/// A key lets such answers through, and says so.
#[test]
fn the_key_of_fixed_edges_holds_for_repeated_pictures() {
    let place = frozen(true);
    let sensor = place.read("in/sensor.toml");
    place.write("in/sensor.toml", format!("{sensor}\n[gates]\nfixed_edge = \"warn\"\n").as_bytes());
    let run = place.run(&["run", "in"]).expect(0);
    let suspect = statuses(&run.out).iter().filter(|status| status.contains("ok suspect: fixed")).count();
    assert_eq!(suspect, 3, "{}", run.out);
    assert!(run.err.contains("refuses their answers"), "{}", run.err);
}

/// A continued run knows the bytes of the picture before its first one.
#[test]
fn a_continued_run_finds_the_same_repeats() {
    let place = frozen(true);
    place.run(&["run", "in", "-o", "whole.csv"]).expect(0);
    let text = place.read("whole.csv");
    for rows in 1..8 {
        let begun: String = text.split_inclusive('\n').take(1 + rows).collect();
        place.write("part.csv.part", begun.as_bytes());
        place.run(&["run", "in", "-o", "part.csv", "--resume"]).expect(0);
        assert_eq!(statuses(&place.read("part.csv")), statuses(&text), "after {rows} rows");
        std::fs::remove_file(place.path("part.csv")).unwrap();
    }
}
