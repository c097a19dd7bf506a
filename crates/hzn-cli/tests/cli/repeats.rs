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

/// Returns a picture with its own noise, as a camera has it; `shift` moves the limb.
fn noisy(shift: f64, seed: u32) -> image::GrayImage {
    let mut state = seed.wrapping_mul(2_654_435_761).wrapping_add(7);
    let mut picture = limb(320, 240, shift);
    for pixel in picture.pixels_mut() {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        pixel.0[0] += (state >> 24) as u8 % 4;
    }
    picture
}

/// Changes a picture that was shown before, number `i` of the sequence.
type Change = fn(&mut image::GrayImage, u8);

fn sequence(shown: impl Fn(u8) -> image::GrayImage) -> (Vec<String>, String) {
    let place = Place::new();
    let mut table = String::from("file,time_s\n");
    for i in 0..8 {
        shown(i).save(place.path(&format!("in/{i:04}.png"))).unwrap();
        table += &format!("{i:04}.png,{i}.5\n");
    }
    place.write("in/frames.csv", table.as_bytes());
    let run = place.run(&["run", "in", "-q"]).expect(0);
    let flight = place.run(&["run", "in", "-q", "--flight"]).expect(0);
    assert_eq!(statuses(&flight.out), statuses(&run.out), "--flight");
    (statuses(&run.out), run.err)
}

/// A camera that stands still with a counter in a pixel, a burnt-in clock, a row of telemetry, or a new upper part.
#[test]
fn an_old_limb_in_a_picture_that_is_new_elsewhere_has_no_answer() {
    let counter: Change = |picture, i| picture.get_pixel_mut(0, 0).0[0] = i;
    let clock: Change = |picture, i| (0..60).for_each(|k| picture.get_pixel_mut(4 + k % 20, 4 + k / 20).0[0] = 9 * i);
    let telemetry: Change = |picture, i| (0..32).for_each(|x| picture.get_pixel_mut(x, 0).0[0] ^= i);
    // The limb lies in the rows 105 to 130.
    let upper: Change = |picture, i| {
        let new = noisy(3.0 * f64::from(i), 40 + u32::from(i));
        (0..80 * 320).for_each(|k| picture.put_pixel(k % 320, k / 320, *new.get_pixel(k % 320, k / 320)));
    };
    for (what, change) in [("counter", counter), ("clock", clock), ("telemetry", telemetry), ("upper part", upper)] {
        let frozen = |i: u8| (3..6).contains(&i);
        let (statuses, err) = sequence(|i| {
            let of = if frozen(i) { 2 } else { i };
            let mut picture = noisy(3.0 * f64::from(of), of.into());
            change(&mut picture, i);
            picture
        });
        for (i, status) in (0..).zip(&statuses) {
            assert_eq!(status.starts_with("rejected") && status.contains("fixed"), frozen(i), "{what} {i}: {status}");
            assert_eq!(status.trim() == "ok", !frozen(i), "{what} {i}: {status}");
        }
        assert!(err.contains("warning: 3 pictures repeat an earlier one to the last bit along the limb"), "{err}");
    }
}

/// A vehicle that keeps the limb at one place in the picture is no camera that stands still: its pictures have noise.
#[test]
fn a_limb_at_rest_has_answers() {
    let (statuses, err) = sequence(|i| noisy(0.0, i.into()));
    assert!(statuses.iter().all(|status| status.trim() == "ok"), "{statuses:?}");
    assert!(!err.contains("repeat"), "{err}");
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
    continued(&place, &text);
    for i in 3..6 {
        let path = place.path(&format!("in/{i:04}.png"));
        let mut picture = image::open(&path).unwrap().to_luma8();
        picture.get_pixel_mut(0, 0).0[0] = i;
        picture.save(path).unwrap();
    }
    place.run(&["run", "in", "-o", "whole.csv", "--force"]).expect(0);
    assert_eq!(statuses(&place.read("whole.csv")), statuses(&text), "with a counter");
    continued(&place, &text);
}

fn continued(place: &Place, text: &str) {
    for rows in 1..8 {
        let begun: String = text.split_inclusive('\n').take(1 + rows).collect();
        place.write("part.csv.part", begun.as_bytes());
        place.run(&["run", "in", "-o", "part.csv", "--resume"]).expect(0);
        assert_eq!(statuses(&place.read("part.csv")), statuses(text), "after {rows} rows");
        std::fs::remove_file(place.path("part.csv")).unwrap();
    }
}
