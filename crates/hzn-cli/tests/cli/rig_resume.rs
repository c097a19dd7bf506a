//! `hzn run rig.toml --resume`: a continued run gives what an uninterrupted one gives.

use std::fs;

use crate::common::{Place, cell, without_time};

const EPOCHS: usize = 9;

/// Simulates the scene `ring` with two of its heads and small pictures, in which every kind of epoch occurs: with all
/// pictures, without one, with a dark picture, and with one that repeats the one before.
fn ring() -> Place {
    let place = Place::new();
    let scene = place.run(&["simulate", "ring", "--show"]).expect(0).out;
    let scene = scene.replace("width = 640\nheight = 480", "width = 160\nheight = 120").replace("554.0", "138.5");
    place.write("ring.toml", scene.replace("319.5", "79.5").replace("239.5", "59.5").as_bytes());
    let frames = EPOCHS.to_string();
    place.run(&["simulate", "ring.toml", "-o", "ring", "--frames", &frames, "-q"]).expect(0);
    let text = place.read("ring/rig.toml");
    let [start, first, second, ..] = text.split("[[head]]").collect::<Vec<_>>()[..] else { panic!("{text}") };
    place.write("ring/rig.toml", format!("{start}[[head]]{first}[[head]]{second}").as_bytes());
    let file = |head: &str, n: usize| place.path(&format!("ring/{head}/{head}-{n:05}.png"));
    let black = image::ImageBuffer::<image::Luma<u16>, _>::new(160, 120);
    fs::remove_file(file("right", 2)).unwrap();
    fs::copy(file("front", 3), file("front", 4)).unwrap();
    // From here on the right head has no limb, and both have none at the end.
    (5..EPOCHS).for_each(|n| black.save(file("right", n)).unwrap());
    (7..EPOCHS).for_each(|n| black.save(file("front", n)).unwrap());
    place
}

fn resume(place: &Place, out: &str, args: &[&str]) -> crate::common::Ran {
    place.run(&[&["run", "ring/rig.toml", "-o", out, "--resume"], args].concat())
}

fn rows(place: &Place, file: &str) -> Vec<Vec<(String, String)>> {
    place.run(&["export", file, "-o", "rows.csv", "--force"]).expect(0);
    without_time(&place.read("rows.csv"))
}

/// Ends a run at every number of lines, also in the middle of an epoch and of a line.
#[test]
fn a_rig_that_is_continued_anywhere_gives_the_same() {
    let place = ring();
    place.run(&["run", "ring/rig.toml", "-o", "whole.csv", "-q", "-j", "1"]).expect(0);
    let whole = rows(&place, "whole.csv");
    assert!(whole.iter().any(|row| cell(row, "detail").contains("no picture")), "an epoch without a picture");
    assert!(whole.iter().any(|row| cell(row, "heads_excluded") == "front"), "a frozen head");
    let coarse = |row: &&Vec<(String, String)>| cell(row, "head") == "rig" && !cell(row, "coarse_x").is_empty();
    assert!(whole.iter().filter(coarse).count() >= 2, "a coarse direction after the last limb");
    place.run(&["run", "ring/rig.toml", "-o", "whole.jsonl", "-q"]).expect(0);
    for (out, head) in [("whole.csv", 1), ("whole.jsonl", 0)] {
        let text = place.read(out);
        let lines: Vec<&str> = text.split_inclusive('\n').collect();
        let ending = out.rsplit_once('.').unwrap().1;
        for n in (head..lines.len()).step_by(if head == 1 { 1 } else { 5 }) {
            let cut = format!("cut{n}.{ending}");
            let half = &lines[n][..lines[n].len() / 2];
            place.write(&format!("{cut}.part"), format!("{}{half}", lines[..n].concat()).as_bytes());
            resume(&place, &cut, &["-q"]).expect(0);
            assert_eq!(rows(&place, &cut), whole, "{cut}");
        }
    }
}

#[test]
fn a_rig_continues_recordings_and_several_outputs() {
    let place = ring();
    place.run(&["run", "ring/rig.toml", "-o", "whole.mcap", "-q"]).expect(0);
    let whole = rows(&place, "whole.mcap");
    let bytes = fs::read(place.path("whole.mcap")).unwrap();
    // The first runs have one batch; the results of a killed run have several, so pictures are left out here.
    for part in [3, 5, 8, 10] {
        let cut = format!("cut{part}.mcap");
        place.write(&format!("{cut}.part"), &bytes[..bytes.len() * part / 10]);
        resume(&place, &cut, &["-q"]).expect(0);
        assert_eq!(rows(&place, &cut), whole, "{cut}");
        place.run(&["export", &cut, "--images", &format!("images{part}")]).expect(0);
        let picture = |folder: &str| fs::read(place.path(&format!("{folder}/front/front-00008.png"))).unwrap();
        assert_eq!(picture(&format!("images{part}")), picture("ring"));
    }
    // A recording of a part of the epochs, which a run closed, and a table that was begun later.
    let moved = |from: &str, to: &str| {
        for n in 4..EPOCHS {
            let file = |head: &str| format!("{head}/{head}-{n:05}.png");
            for head in ["front", "right"] {
                fs::create_dir_all(place.path(&format!("{to}/{head}"))).unwrap();
                fs::rename(place.path(&format!("{from}/{}", file(head))), place.path(&format!("{to}/{}", file(head))))
                    .unwrap();
            }
        }
    };
    moved("ring", "later");
    place.run(&["run", "ring/rig.toml", "-o", "a.mcap", "-o", "a.csv", "-q"]).expect(0);
    assert_eq!(rows(&place, "a.mcap"), whole[..rows(&place, "a.csv").len()]);
    let table = place.read("a.csv");
    let first: Vec<&str> = table.split_inclusive('\n').take(6).collect();
    moved("later", "ring");
    fs::remove_file(place.path("a.csv")).unwrap();
    place.write("a.csv.part", first.concat().as_bytes());
    place
        .run(&["run", "ring/rig.toml", "-o", "a.mcap", "-o", "a.csv", "--resume"])
        .expect(0)
        .says("that were finished before");
    assert_eq!((rows(&place, "a.mcap"), rows(&place, "a.csv")), (whole.clone(), whole));
}

/// What was changed is refused, and the results stay as they are.
#[test]
fn a_rig_continues_no_other_run() {
    let place = ring();
    let rig = place.read("ring/rig.toml");
    for out in ["a.csv", "a.mcap"] {
        place.run(&["run", "ring/rig.toml", "-o", out, "-q"]).expect(0);
        let before = fs::read(place.path(out)).unwrap();
        let refuse = |what: &str| {
            resume(&place, out, &[]).expect(2).says(what).says("--force");
            assert!(fs::read(place.path(out)).unwrap() == before, "{out}: {what}");
        };
        let file = |n: usize| place.path(&format!("ring/front/front-{n:05}.png"));
        let old = fs::read(file(1)).unwrap();
        fs::copy(file(6), file(1)).unwrap();
        refuse("its epoch 1, front-00001.png, now gives another result");
        fs::write(file(1), old).unwrap();
        fs::rename(file(6), place.path("away.png")).unwrap();
        refuse("the results have 2 pictures in epoch 6, but the input has 1");
        fs::rename(place.path("away.png"), file(6)).unwrap();
        // Another rig: a recording contains its text, and a table the answers.
        place.write("ring/rig.toml", rig.replace("sync_s", "limb_tilt_sigma_km = 30.0\nsync_s").as_bytes());
        match out {
            "a.mcap" => refuse("was begun with another sensor.toml"),
            // The pictures that were put back are newer than the results, so their epochs are compared.
            _ => refuse("its epoch 0, front-00000.png, now gives another result"),
        }
        place.write("ring/rig.toml", rig.as_bytes());
    }
    // The recording of a rig is not replaced by that of one camera.
    let bytes = fs::read(place.path("a.mcap")).unwrap();
    place.run(&["run", "ring/front", "-o", "a.mcap", "--resume"]).expect(2).says("--force");
    assert!(fs::read(place.path("a.mcap")).unwrap() == bytes);
    // An epoch that is missing in the middle.
    let text = place.read("a.csv");
    let lines: Vec<&str> = text.split_inclusive('\n').collect();
    place.write("b.csv.part", [&lines[..4], &lines[7..]].concat().concat().as_bytes());
    resume(&place, "b.csv", &[]).expect(2).says("rows were removed or moved");
}

/// A limb that is tracked comes from the picture before it, so neither threads nor an interruption may change it.
#[test]
fn a_tracking_rig_gives_the_same_on_any_number_of_threads_and_continued() {
    let place = ring();
    for head in ["front", "right"] {
        let name = format!("ring/{head}/sensor.toml");
        place.write(&name, format!("{}\n[track]\nfull_every = 4\n", place.read(&name)).as_bytes());
    }
    place.run(&["run", "ring/rig.toml", "-o", "one.csv", "-q", "-j", "1"]).expect(0);
    place.run(&["run", "ring/rig.toml", "-o", "three.csv", "-q", "-j", "3"]).expect(0);
    let whole = rows(&place, "one.csv");
    assert_eq!(rows(&place, "three.csv"), whole);
    let text = place.read("one.csv");
    place.write("cut.csv.part", text.split_inclusive('\n').take(9).collect::<String>().as_bytes());
    resume(&place, "cut.csv", &["-q"]).expect(0);
    assert_eq!(rows(&place, "cut.csv"), whole);
}

/// The results look newer than the pictures, and the file next to them tells what was changed.
#[cfg(target_os = "linux")]
#[test]
fn a_rig_knows_which_pictures_there_were() {
    let place = ring();
    place.run(&["run", "ring/rig.toml", "-o", "whole.csv", "-q"]).expect(0);
    let whole = rows(&place, "whole.csv");
    let limit = fs::metadata(place.path("whole.csv")).unwrap().len() * 3 / 4 / 1024;
    let args = ["run", "ring/rig.toml", "-o", "a.csv", "-q"];
    crate::common::limited(&place, &format!("ulimit -f {limit}"), &args).expect(1);
    let file = |n: usize| place.path(&format!("ring/front/front-{n:05}.png"));
    let late = || {
        let part = fs::File::options().write(true).open(place.path("a.csv.part")).unwrap();
        part.set_modified(std::time::SystemTime::now() + std::time::Duration::from_secs(3600)).unwrap();
    };
    let old = fs::read(file(1)).unwrap();
    fs::copy(file(6), file(1)).unwrap();
    late();
    resume(&place, "a.csv", &[]).expect(2).says("its epoch 1, front-00001.png, now gives another result");
    fs::write(file(1), old).unwrap();
    late();
    resume(&place, "a.csv", &["-q"]).expect(0);
    assert_eq!(rows(&place, "a.csv"), whole);
    assert!(!place.path("a.csv.part.chain").exists());
}
