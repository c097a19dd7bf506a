//! Pictures that repeat an earlier one to the last bit: a camera that stands still.

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
        run.err.contains("warning: 3 pictures repeat an earlier one to the last bit (the first is 0003.png)"),
        "{}",
        run.err
    );
}

/// Two buffers in turn, a recorder that plays a part again, and a picture without a limb in between.
#[test]
fn old_buffers_have_no_answer() {
    for shown in [[0, 1, 2, 1, 2, 1, 2, 3], [0, 1, 2, 3, 0, 1, 2, 3], [0, 1, 9, 1, 9, 1, 9, 2]] {
        let place = Place::new();
        let mut table = String::from("file,time_s\n");
        for (i, &what) in shown.iter().enumerate() {
            let path = place.path(&format!("in/{i:04}.png"));
            if what == 9 {
                image::GrayImage::new(320, 240).save(path).unwrap();
            } else {
                limb(320, 240, 3.0 * f64::from(what)).save(path).unwrap();
            }
            table += &format!("{i:04}.png,{i}.5\n");
        }
        place.write("in/frames.csv", table.as_bytes());
        let run = place.run(&["run", "in", "-q"]).expect(0);
        for (i, status) in statuses(&run.out).iter().enumerate() {
            let is_new = !shown[..i].contains(&shown[i]);
            assert_eq!(status.trim() == "ok", is_new && shown[i] != 9, "{shown:?} {i}: {status}");
        }
    }
}

/// A picture whose answer the sequence refuses has no mask, nor that of an earlier run.
#[test]
fn a_repeated_picture_has_no_mask() {
    let place = frozen(true);
    std::fs::create_dir(place.path("masks")).unwrap();
    place.write("masks/0004.png", b"of an earlier run");
    let run = place.run(&["run", "in", "-o", "a.csv", "--mask-pictures", "masks", "--force"]).expect(0);
    let has_mask: Vec<bool> = (0..8).map(|i| place.path(&format!("masks/{i:04}.png")).exists()).collect();
    assert_eq!(has_mask, [true, true, true, false, false, false, true, true]);
    assert!(run.err.contains("no mask: 0004.png: rejected"), "{}", run.err);
}

/// Copies of a picture without times are no contradiction.
#[test]
fn copies_without_times_are_told_only() {
    let place = frozen(false);
    let run = place.run(&["run", "in"]).expect(0);
    assert!(statuses(&run.out).iter().all(|status| status.trim() == "ok"), "{}", run.out);
    assert!(run.err.contains("note: 3 pictures repeat an earlier one to the last bit"), "{}", run.err);
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
