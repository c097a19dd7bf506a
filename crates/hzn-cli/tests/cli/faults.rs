//! Faults of disks, of files and of their makers: nothing is lost, nothing fills the memory, and every message says
//! what to do.

use crate::common::{Place, Ran, cell, limb, without_time};

/// Makes results of `n` pictures that look as if their run was killed.
fn unfinished(place: &Place, out: &str, n: usize) -> Vec<u8> {
    let pictures: Vec<String> = (0..n).map(|i| format!("in/{i:04}.png")).collect();
    let mut args = vec!["run", "-q", "-o", out];
    args.extend(pictures.iter().map(String::as_str));
    place.run(&args).expect(0);
    std::fs::rename(place.path(out), place.path(&format!("{out}.part"))).unwrap();
    std::fs::read(place.path(&format!("{out}.part"))).unwrap()
}

#[test]
fn a_refused_resume_does_not_finish_the_file() {
    let place = Place::with_pictures(4);
    for out in ["a.csv", "a.jsonl", "a.mcap"] {
        unfinished(&place, out, 2);
        let refused = place.run(&["run", "in/0001.png", "in/0003.png", "-o", out, "--resume"]).expect(2);
        refused.says("its last picture is 0001.png, but the input has 0003.png");
        assert!(!place.path(out).exists(), "{out} has its final name, but its run is not finished");
        place.run(&["run", "in", "-o", out, "--resume"]).expect(0).says("2 that were finished before");
        assert!(place.path(out).exists());
    }
}

#[test]
fn a_durable_run_gives_the_same_results() {
    let place = Place::with_pictures(5);
    for out in ["a.csv", "a.jsonl", "a.mcap"] {
        place.run(&["run", "in", "-o", out]).expect(0);
        place.run(&["run", "in", "-o", &format!("durable-{out}"), "--durable"]).expect(0);
        let rows = |file: &str| {
            place.run(&["export", file, "-o", "rows.csv", "--force"]).expect(0);
            without_time(&place.read("rows.csv"))
        };
        assert_eq!(rows(out), rows(&format!("durable-{out}")));
    }
    place.run(&["run", "in", "--durable"]).expect(2).says("--output");
}

#[test]
fn a_changed_digit_is_found() {
    let place = Place::with_pictures(4);
    for out in ["a.csv", "a.jsonl"] {
        let whole = unfinished(&place, out, 4);
        let text = String::from_utf8(whole.clone()).unwrap();
        // A digit of the axis in the second row.
        let row = text.find("0001.png").unwrap();
        let digit = row + text[row..].find("0.").unwrap() + 4;
        let mut changed = whole.clone();
        changed[digit] = if changed[digit] == b'5' { b'6' } else { b'5' };
        let part = format!("{out}.part");
        place.write(&part, &changed);
        let ran = place.run(&["run", "in", "-o", out, "--resume"]).expect(2).says("row 2: the checksum does not fit");
        assert!(ran.err.contains("--force starts over"), "{}", ran.err);
        assert_eq!(std::fs::read(place.path(&part)).unwrap(), changed, "a refused file stays as it is");
        place.run(&["info", &part]).expect(0);
        place.write(&format!("changed-{out}"), &changed);
        place
            .run(&["export", &format!("changed-{out}"), "-o", &format!("x-{out}.csv")])
            .expect(1)
            .says("the checksum does not fit");
        let ran = place.run(&["recover", &part]).expect(0).says("1 row kept");
        assert!(ran.err.contains("only the rows before it are kept"), "{}", ran.err);
        place.run(&["run", "in", "-o", out, "--resume"]).expect(0);
        place.run(&["export", out, "-o", "rows.csv", "--force"]).expect(0).says("4 rows");
    }
}

#[test]
fn a_second_run_is_told_about_the_first() {
    let place = Place::with_pictures(2);
    for out in ["a.csv", "a.mcap"] {
        let live = hzn_mcap::create_part(&place.path(&format!("{out}.part"))).unwrap();
        place.run(&["run", "in", "-o", out]).expect(2).says("another run is writing it");
        drop(live);
        crate::common::wait_until_free(&place.path(&format!("{out}.part")));
        place.run(&["run", "in", "-o", out]).expect(2).says("was left by a run that did not end");
    }
}

#[test]
fn warnings_are_counted_and_not_repeated() {
    let place = Place::with_pictures(2);
    let rows: String = (0..100_000).map(|i| format!("{i:06}.png,400\n")).collect();
    place.write("in/frames.csv", format!("file,altitude_km\n{rows}").as_bytes());
    let ran = place.run(&["run", "in", "-q"]).expect(0).says("99997 further rows without a picture");
    assert!(ran.err.len() < 2000, "{} bytes", ran.err.len());
    // Values are looked at only in the rows of the pictures.
    let place = Place::with_pictures(8);
    let rows: String = (0..50_000).map(|i| format!("{i:04}.png,300,6778.137,0,0\n")).collect();
    place.write("in/frames.csv", format!("file,altitude_km,x_km,y_km,z_km\n{rows}").as_bytes());
    let ran = place.run(&["run", "in", "-q"]).expect(0).says("5 further rows with a warning of this kind");
    assert!(ran.err.len() < 2000, "{} bytes: {}", ran.err.len(), ran.err);
    let place = Place::with_pictures(1);
    (0..200).for_each(|i| place.write(&format!("in/z{i:03}.png"), b"no picture"));
    let ran = place.run(&["run", "in"]).expect(3).says("further ones are only counted");
    assert_eq!(ran.err.lines().filter(|line| line.starts_with("unreadable: ")).count(), 20);
}

#[test]
fn overlays_of_different_folders_do_not_collide() {
    let place = Place::with_pictures(1);
    std::fs::create_dir(place.path("in/a")).unwrap();
    for (name, shift) in [("in/a/x.png", 0.0), ("in/a_x.png", 20.0)] {
        limb(320, 240, shift).save(place.path(name)).unwrap();
    }
    let args = ["run", "in/a/x.png", "in/a_x.png", "-s", "in/sensor.toml", "--overlay", "drawn"];
    place.run(&args).expect(0);
    let mut names: Vec<String> = std::fs::read_dir(place.path("drawn"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    assert_eq!(names, ["in%2Fa%2Fx.png", "in%2Fa_x.png"]);
}

#[cfg(unix)]
mod unix {
    use super::*;
    use crate::common::limited;
    use std::os::unix::fs::{PermissionsExt, symlink};
    use std::process::Command;

    #[test]
    fn devices_and_pipes_are_unreadable_pictures() {
        let place = Place::with_pictures(1);
        let made = Command::new("mkfifo").arg(place.path("in/pipe.png")).status().unwrap();
        assert!(made.success());
        symlink("/dev/zero", place.path("in/zero.png")).unwrap();
        let what = "is a device, a pipe or a socket, not a file";
        let ran = place.run(&["run", "in", "-o", "a.csv"]).expect(3);
        assert_eq!(ran.err.matches(what).count(), 2, "{}", ran.err);
        let rows = place.rows("a.csv");
        assert_eq!(rows.len(), 3);
        assert!(rows[1..].iter().all(|row| cell(row, "status") == "unreadable" && cell(row, "detail").contains(what)));
        place.run(&["run", "/dev/zero", "-s", "in/sensor.toml"]).expect(3).says(what);
        assert!(place.run(&["explain", "in/pipe.png"]).expect(3).out.contains(what));
        place.run(&["run", "in/pipe.png", "in/0000.png", "--raw", "320x240:mono8"]).expect(3).says(what);
    }

    #[test]
    fn huge_text_files_are_refused() {
        let place = Place::with_pictures(1);
        let huge = |name: &str, gigabytes: u64| {
            std::fs::File::create(place.path(name)).unwrap().set_len(gigabytes << 30).unwrap();
        };
        for (name, args) in [
            ("big.toml", vec!["run", "in", "-s", "big.toml"]),
            ("big.csv", vec!["run", "in", "--frames", "big.csv"]),
            ("scene.toml", vec!["simulate", "./scene.toml", "-o", "sim"]),
            ("camera.yaml", vec!["camera", "convert", "camera.yaml", "-o", "out.yaml"]),
        ] {
            huge(name, 3);
            let ran = limited(&place, "ulimit -v 1000000", &args);
            assert!(
                ran.code == 2 && ran.err.contains("MB; such a file is expected to be smaller"),
                "{name}: {}",
                ran.err
            );
        }
        // A TOML needs a hundred times its size while it is read.
        place.write("wide.toml", "a = [[1, 2], [3, 4]]\n".repeat(100_000).as_bytes());
        limited(&place, "ulimit -v 1000000", &["run", "in", "-s", "wide.toml"]).expect(2).says("is larger than 1 MB");
        limited(&place, "ulimit -v 1000000", &["run", "in", "-s", "/dev/zero"]).expect(2).says("is larger than 1 MB");
        let rows: String = (0..2_000_001).map(|i| format!("{i}\n")).collect();
        place.write("rows.csv", format!("file\n{rows}").as_bytes());
        place.run(&["run", "in", "--frames", "rows.csv"]).expect(2).says("has more than 2000000 rows");
    }

    /// The limit of the file size ends a program by a signal, unless the program asks for an error.
    #[test]
    fn a_limit_of_the_file_size_is_an_error_with_a_message() {
        let place = Place::with_pictures(600);
        for (out, blocks) in [("a.csv", 60), ("a.mcap", 800)] {
            let ran = limited(&place, &format!("ulimit -f {blocks}"), &["run", "in", "-o", out]);
            ran.expect(1).says("ulimit -f").says("resume the run to");
            place.run(&["run", "in", "-o", out, "--resume"]).expect(0).says("that were finished before");
        }
    }

    /// Programs in place of ffmpeg and ffprobe write down how they were called.
    #[test]
    fn names_of_videos_are_no_options_and_no_protocols() {
        let place = Place::with_pictures(0);
        let path = std::env::var("PATH").unwrap();
        std::fs::create_dir(place.path("bin")).unwrap();
        for tool in ["ffprobe", "ffmpeg"] {
            let script = format!(
                "#!/bin/sh\nfor a in \"$@\"; do echo \"$a\" >> '{}'; done\nexit 1\n",
                place.path("calls").display()
            );
            place.write(&format!("bin/{tool}"), script.as_bytes());
            let mode = std::fs::Permissions::from_mode(0o755);
            std::fs::set_permissions(place.path(&format!("bin/{tool}")), mode).unwrap();
        }
        for name in ["-y.mp4", "pipe:0.mp4", "concat:a|b.mp4", "list.ts"] {
            place.write(name, b"#EXTM3U\n");
            let mut command = place.command(&["run", "-s", "in/sensor.toml", "--", name]);
            command.env("PATH", format!("{}:{path}", place.path("bin").display()));
            let ran = Ran::from_output(&command.output().unwrap(), &place.path(""));
            ran.expect(2).says("ffprobe cannot read it");
            let calls = place.read("calls");
            let words: Vec<&str> = calls.lines().collect();
            let at = words.iter().position(|word| *word == "-protocol_whitelist").unwrap();
            let file = format!("file:{}", std::path::absolute(place.path(name)).unwrap().display());
            assert_eq!(words[at + 1..], ["file", "-i", &file], "{calls}");
            std::fs::remove_file(place.path("calls")).unwrap();
        }
    }

    /// Returns an MCAP with chunks of zeros, each of `megabytes` when it is uncompressed.
    fn bomb(chunks: usize, megabytes: usize, sensor: bool) -> Vec<u8> {
        let record = |op: u8, content: &[u8]| [&[op], &(content.len() as u64).to_le_bytes()[..], content].concat();
        let text = |text: &str| [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat();
        let magic = [0x89, b'M', b'C', b'A', b'P', b'0', b'\r', b'\n'];
        let zeros =
            zstd::stream::encode_all(std::io::Read::take(std::io::repeat(0), (megabytes as u64) << 20), 1).unwrap();
        let head =
            [[0u64, 0, (megabytes as u64) << 20].map(u64::to_le_bytes).concat(), 0u32.to_le_bytes().to_vec()].concat();
        let chunk = record(6, &[head, text("zstd"), (zeros.len() as u64).to_le_bytes().to_vec(), zeros].concat());
        let size = (crate::common::SENSOR.len() as u64).to_le_bytes();
        let attached =
            [&[0; 16][..], &text("sensor.toml"), &text("text"), &size, crate::common::SENSOR.as_bytes(), &[0; 4]]
                .concat();
        let attached = if sensor { record(9, &attached) } else { Vec::new() };
        [
            &magic[..],
            &record(1, &[text(""), text("hzn 0")].concat()),
            &attached,
            &chunk.repeat(chunks),
            &record(15, &[0; 4]),
            &magic,
        ]
        .concat()
    }

    #[test]
    fn small_recordings_stay_small_in_memory() {
        let place = Place::with_pictures(1);
        let one = bomb(1, 800, true);
        assert!(one.len() < 100_000, "{}", one.len());
        let mut files = vec![("ours.mcap", one), ("many.mcap", bomb(30, 60, true))];
        if std::env::var_os("HZN_ALL").is_some() {
            files.push(("other.mcap", bomb(1, 800, false)));
        }
        for (name, file) in files {
            place.write(name, &file);
            let ran = limited(&place, "ulimit -v 700000", &["info", name]);
            assert!(ran.code == 3 && ran.err.contains("damaged"), "{name}: {} {}", ran.out, ran.err);
            let ran = limited(&place, "ulimit -v 1500000", &["run", name, "-j", "1", "-s", "in/sensor.toml"]);
            assert!(ran.code == 2 && ran.err.contains("damaged"), "{name}: {}", ran.err);
            limited(&place, "ulimit -v 700000", &["recover", name, "-o", "kept.mcap", "--force"]).expect(0);
        }
    }
}
