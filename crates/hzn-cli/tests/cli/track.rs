//! The tracker of `hzn run`, `[track]` in sensor.toml.

use crate::common::{Place, SENSOR, cell, limb, without_time};

/// Returns a folder with a sequence of 16 pictures: a limb that moves, a picture without one, a file that is no
/// picture, and a leap.
fn sequence(track: &str) -> Place {
    let place = Place::new();
    place.write("in/sensor.toml", format!("{SENSOR}{track}").as_bytes());
    for i in 0..16u32 {
        let name = format!("in/{i:04}.png");
        let shift = f64::from(i) * 8.0 - if i >= 12 { 300.0 } else { 0.0 };
        match i {
            3 => image::GrayImage::from_pixel(320, 240, image::Luma([20])).save(place.path(&name)).unwrap(),
            8 => place.write(&name, b"no picture"),
            _ => limb(320, 240, shift).save(place.path(&name)).unwrap(),
        }
    }
    place
}

const TRACK: &str = "\n[track]\nfull_every = 5\n";

#[test]
fn the_rows_do_not_depend_on_the_number_of_threads() {
    let place = sequence(TRACK);
    let rows = |jobs: &str, more: &[&str]| {
        let out = format!("{jobs}{}.csv", more.len());
        place.run(&[&["run", "in", "-j", jobs, "-o", &out][..], more].concat()).expect(3);
        without_time(&place.read(&out))
    };
    let one = rows("1", &[]);
    assert_eq!(one, rows("8", &[]));
    assert_eq!(one, rows("3", &[]));
    // The drawing of a picture needs a record of the work, which must not change it.
    assert_eq!(one, rows("2", &["--overlay", "drawn"]));
    let status: Vec<&str> = one.iter().map(|row| cell(row, "status")).collect();
    let lost = |i: usize| [("no-limb", 3), ("unreadable", 8)].into_iter().find(|(_, k)| *k == i).map(|(name, _)| name);
    let expected: Vec<&str> = (0..16).map(|i| lost(i).unwrap_or("ok")).collect();
    assert_eq!(status, expected);
    // Blocks begin at 0, 5, 10 and 15. After a gap, and at the leap, the whole picture is searched.
    let tracked: Vec<usize> = (0..16).filter(|&i| cell(&one[i], "tracked") == "true").collect();
    assert_eq!(tracked, [1, 2, 6, 7, 11, 13, 14]);
    assert!(one.iter().all(|row| ["", "true"].contains(&cell(row, "tracked"))));
}

#[test]
fn without_the_key_nothing_is_tracked_and_a_full_search_has_the_same_row() {
    let (with, without) = (sequence(TRACK), sequence(""));
    let rows = |place: &Place| without_time(&place.run(&["run", "in", "-j", "2"]).expect(3).out);
    let (with, without) = (rows(&with), rows(&without));
    assert!(without.iter().all(|row| cell(row, "tracked").is_empty()));
    for (with, without) in with.iter().zip(&without).filter(|(with, _)| cell(with, "tracked").is_empty()) {
        assert_eq!(with, without);
    }
}

/// A run that goes on begins with a full search, and does not compare a tracked row with one that is not.
#[test]
fn an_interrupted_run_goes_on() {
    let place = sequence(TRACK);
    place.run(&["run", "in", "-o", "whole.csv"]).expect(3);
    let whole = place.read("whole.csv");
    // A line for the names, and seven pictures, of which the last one was tracked.
    place.write("part.csv.part", whole.split_inclusive('\n').take(8).collect::<String>().as_bytes());
    place.run(&["run", "in", "-o", "part.csv", "--resume"]).expect(3).says("after 7 that were finished before");
    let (whole, part) = (without_time(&whole), without_time(&place.read("part.csv")));
    assert_eq!(whole[..7], part[..7]);
    assert_eq!((cell(&whole[7], "tracked"), cell(&part[7], "tracked")), ("true", ""));
    assert_eq!(whole[10..], part[10..]);
}
