//! An output replaces no file without the user's consent.

use crate::common::{Place, wait_until_free};

/// Returns the beginning of an MCAP of another program.
fn foreign() -> Vec<u8> {
    let library = b"another program";
    let mut header = [0u32.to_le_bytes(), (library.len() as u32).to_le_bytes()].concat();
    header.extend(library);
    let magic = [0x89, b'M', b'C', b'A', b'P', b'0', b'\r', b'\n'];
    [&magic[..], &[1], &(header.len() as u64).to_le_bytes(), &header, &[0; 300]].concat()
}

#[test]
fn resume_continues_only_results_of_hzn() {
    let place = Place::with_pictures(2);
    for (name, bytes) in [
        ("notes.jsonl", b"my notes\n".to_vec()),
        ("before.jsonl", b"{\"index\":0,\"name\":\"of another version\"}\n".to_vec()),
        ("notes.csv", b"my,notes\n1,2\n".to_vec()),
        ("noise.mcap", (0..200_000u32).map(|i| (i * 7 % 251) as u8).collect()),
        ("other.mcap", foreign()),
        ("left.mcap.part", foreign()),
    ] {
        place.write(name, &bytes);
        let out = name.strip_suffix(".part").unwrap_or(name);
        let ran = place.run(&["run", "in", "-o", out, "--resume"]).expect(2);
        assert!(
            ran.err.contains(out)
                && (ran.err.contains("recording of hzn") || ran.err.contains("does not have the columns"))
        );
        assert_eq!(std::fs::read(place.path(name)).unwrap(), bytes, "{name}");
    }
    // A file that our crash left before any result was written counts as empty.
    for (name, bytes) in [("a.mcap.part", &foreign()[..5]), ("b.jsonl.part", b""), ("c.jsonl.part", b"{\"ind")] {
        place.write(name, bytes);
        place.run(&["run", "in", "-o", name.strip_suffix(".part").unwrap(), "--resume"]).expect(0);
    }
    place.write("notes.jsonl.part", b"my notes\n");
    place.run(&["recover", "notes.jsonl.part", "-o", "kept.jsonl"]).expect(1).says("does not have the columns");
    assert_eq!(place.read("notes.jsonl.part"), "my notes\n");
}

#[test]
fn the_input_is_no_output() {
    let place = Place::with_pictures(3);
    place.run(&["run", "in", "-o", "a.mcap"]).expect(0);
    let before = std::fs::read(place.path("a.mcap")).unwrap();
    for more in ["--force", "--resume", "--quiet"] {
        place.run(&["run", "a.mcap", "-o", "a.mcap", more]).expect(2).says("a.mcap: is the input itself");
    }
    assert_eq!(std::fs::read(place.path("a.mcap")).unwrap(), before);
}

#[test]
fn one_run_at_a_time_writes_a_file() {
    let place = Place::with_pictures(3);
    for out in ["a.csv", "a.jsonl", "a.mcap"] {
        let part = place.path(&format!("{out}.part"));
        let other = hzn_mcap::create_part(&part).unwrap();
        std::fs::write(&part, b"its frames").unwrap();
        for how in ["--resume", "--force"] {
            let ran = place.run(&["run", "in", "-o", out, how]).expect(1);
            assert!(ran.err.contains("another run is writing it; wait until that ends"), "{}", ran.err);
            assert_eq!(std::fs::read(&part).unwrap(), b"its frames");
        }
        // After its process has ended, the lock on the file is free.
        drop(other);
        wait_until_free(&part);
        place.run(&["run", "in", "-o", out, "--force"]).expect(0);
    }
}

#[cfg(target_os = "linux")]
#[test]
fn recover_on_a_full_disk_says_what_there_is() {
    let place = Place::with_pictures(2);
    place.run(&["run", "in", "-o", "a.mcap"]).expect(0);
    std::fs::rename(place.path("a.mcap"), place.path("a.mcap.part")).unwrap();
    let before = std::fs::read(place.path("a.mcap.part")).unwrap();
    std::os::unix::fs::symlink("/dev/full", place.path("a.recovering.mcap.part")).unwrap();
    let ran = place.run(&["recover", "a.mcap.part"]).expect(1);
    assert!(ran.err.contains("no space is left") && ran.err.contains("a.mcap.part is unchanged"), "{}", ran.err);
    assert!(!ran.err.contains("--resume"));
    assert_eq!(std::fs::read(place.path("a.mcap.part")).unwrap(), before);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_leaves_no_empty_file() {
    let place = Place::with_pictures(2);
    let init = ["init", "in", "--fov", "56", "--altitude", "400", "-o", "s.toml"];
    let explain = ["explain", "in/0000.png", "--overlay", "o.png"];
    for (command, output) in [(&init[..], "s.toml"), (&explain[..], "o.png")] {
        std::os::unix::fs::symlink("/dev/full", place.path(&format!("{output}.part"))).unwrap();
        place.run(command).expect(1).says("the disk is full");
        assert!(!place.path(output).exists(), "{output}");
        // The next call finds nothing to replace.
        place.run(command).expect(0);
        assert!(std::fs::metadata(place.path(output)).unwrap().len() > 100, "{output}");
    }
}

#[test]
fn outputs_that_cannot_be_are_told_at_once() {
    let place = Place::with_pictures(2);
    let overlay = place.run(&["explain", "in/0000.png", "--overlay", "no/o.png"]).expect(2);
    assert!(overlay.out.is_empty() && overlay.err.contains("no/o.png: the folder does not exist"), "{}", overlay.err);
    let unused = "--format is for a table on stdout: a.csv has the format of its ending";
    place.run(&["run", "in", "--format", "jsonl", "-o", "a.csv"]).expect(0).says(unused);
    for args in [&["run", "in", "--format", "jsonl", "-o", "b.csv", "-o", "-"][..], &["run", "in", "-o", "c.csv"]] {
        let ran = place.run(args).expect(0);
        assert!(!ran.err.contains("--format"), "{}", ran.err);
    }
}
