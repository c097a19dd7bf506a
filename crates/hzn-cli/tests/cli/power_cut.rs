//! Power cuts at any moment, simulated: a recorder logs what a run does to its files, and the test computes what a disk
//! may contain after each prefix of the log.
//!
//! Until a file is synced, the disk has any part of what was written to it; the test takes nothing and everything. A
//! name is on the disk when its folder was synced; before, it may be there or not. These are the promises of POSIX.
//! Real file systems keep more, so this is the worst case.
#![cfg(target_os = "linux")]

use std::collections::{BTreeMap, HashMap};
use std::path::Path;
use std::process::Command;

use crate::campaign::number;
use crate::common::Place;

/// One step of the program.
#[derive(Debug)]
enum Step {
    Open { fd: i32, truncate: bool, path: String },
    Write { fd: i32, bytes: Vec<u8> },
    Truncate { fd: i32, size: usize },
    Seek { fd: i32, at: usize },
    Sync { fd: i32 },
    Rename { from: String, to: String },
    Unlink { path: String },
}

fn parse(mut log: &[u8]) -> Vec<Step> {
    let mut steps = Vec::new();
    while let Some(end) = log.iter().position(|b| *b == b'\n') {
        let line = String::from_utf8(log[..end].to_vec()).unwrap();
        log = &log[end + 1..];
        let [kind, fd, n, a, b] = <[&str; 5]>::try_from(line.split('\t').collect::<Vec<_>>()).unwrap();
        let (fd, n): (i32, usize) = (fd.parse().unwrap(), n.parse().unwrap());
        steps.push(match kind {
            "o" => Step::Open { fd, truncate: n == 1, path: a.to_owned() },
            "w" => {
                let (bytes, rest) = log.split_at(n);
                log = rest;
                Step::Write { fd, bytes: bytes.to_vec() }
            }
            "t" => Step::Truncate { fd, size: n },
            "l" => Step::Seek { fd, at: n },
            "s" => Step::Sync { fd },
            "r" => Step::Rename { from: a.to_owned(), to: b.to_owned() },
            "u" => Step::Unlink { path: a.to_owned() },
            other => panic!("{other}"),
        });
    }
    steps
}

/// A file: what the program sees, and what is surely on the disk.
#[derive(Debug, Clone, Default)]
struct Inode {
    now: Vec<u8>,
    synced: Vec<u8>,
}

type Names = BTreeMap<String, usize>;

/// The files of a folder.
#[derive(Debug, Default)]
struct Disk {
    inodes: Vec<Inode>,
    names: Names,
    synced_names: Names,
    /// The file of a descriptor and the offset of its next write; `None` for a folder.
    open: BTreeMap<i32, (Option<usize>, usize)>,
}

impl Disk {
    /// Makes a disk with a file on it.
    fn with(files: &[(&str, Vec<u8>)]) -> Self {
        let mut disk = Self::default();
        for (name, bytes) in files {
            disk.names.insert((*name).to_owned(), disk.inodes.len());
            disk.inodes.push(Inode { now: bytes.clone(), synced: bytes.clone() });
        }
        disk.synced_names = disk.names.clone();
        disk
    }

    fn apply(&mut self, step: &Step) {
        match step {
            Step::Open { fd, path, .. } if path == "." => drop(self.open.insert(*fd, (None, 0))),
            // Only the files of the run are of interest; they have no folder in their names.
            Step::Open { fd, path, .. } if !path.starts_with("out.") => drop(self.open.remove(fd)),
            Step::Open { fd, truncate, path } => {
                let inode = *self.names.entry(path.clone()).or_insert_with(|| {
                    self.inodes.push(Inode::default());
                    self.inodes.len() - 1
                });
                if *truncate {
                    self.inodes[inode].now.clear();
                }
                self.open.insert(*fd, (Some(inode), 0));
            }
            Step::Write { fd, bytes } => {
                let Some((Some(inode), at)) = self.open.get_mut(fd) else { return };
                let now = &mut self.inodes[*inode].now;
                let end = *at + bytes.len();
                now.resize(now.len().max(end), 0);
                now[*at..end].copy_from_slice(bytes);
                *at = end;
            }
            Step::Truncate { fd, size } => {
                if let Some((Some(inode), _)) = self.open.get(fd) {
                    self.inodes[*inode].now.resize(*size, 0);
                }
            }
            Step::Seek { fd, at } => {
                if let Some((_, place)) = self.open.get_mut(fd) {
                    *place = *at;
                }
            }
            Step::Sync { fd } => match self.open.get(fd) {
                Some((Some(inode), _)) => {
                    let inode = &mut self.inodes[*inode];
                    inode.synced = inode.now.clone();
                }
                Some((None, _)) => self.synced_names = self.names.clone(),
                None => {}
            },
            Step::Rename { from, to } => {
                if let Some(inode) = self.names.remove(from) {
                    self.names.insert(to.clone(), inode);
                }
            }
            Step::Unlink { path } => drop(self.names.remove(path)),
        }
    }

    /// Calls `check` with the files that the disk may contain if power is cut now.
    fn each_outcome(&self, mut check: impl FnMut(&BTreeMap<String, Vec<u8>>)) {
        for names in [&self.synced_names, &self.names] {
            for part in [0, 1, 2] {
                let content = |inode: &usize| {
                    let Inode { now, synced } = &self.inodes[*inode];
                    match part {
                        0 => synced.clone(),
                        1 => now.clone(),
                        // Half of what was appended since the last sync.
                        _ => now[..now.len().min(synced.len() + now.len().saturating_sub(synced.len()) / 2)].to_vec(),
                    }
                };
                check(&names.iter().map(|(name, inode)| (name.clone(), content(inode))).collect());
            }
        }
    }
}

/// The rows that were recovered from each content. A step changes one file, so most contents occur many times.
type Seen = HashMap<Vec<u8>, Option<Vec<hzn_mcap::Row>>>;

/// Returns the rows of a file that may be cut off anywhere, without processing times; `None` if it cannot be recovered.
fn recovered(folder: &Path, ending: &str, bytes: &[u8]) -> Option<Vec<hzn_mcap::Row>> {
    let [file, out] = ["cut", "kept"].map(|name| folder.join(format!("{name}.{ending}")));
    std::fs::write(&file, bytes).unwrap();
    let _ = std::fs::remove_file(&out);
    if ending == "mcap" {
        hzn_mcap::recover(&file, &out).ok()?;
    } else {
        let found = hzn_run::sink::recover_text(&file, &out, hzn_run::sink::target(&out).unwrap()).ok()?;
        assert_eq!(found.damage, None);
    }
    Some(rows(&out))
}

fn rows(file: &Path) -> Vec<hzn_mcap::Row> {
    let rows = hzn_run::results::read(file).unwrap().rows;
    rows.into_iter().map(|row| hzn_mcap::Row { elapsed_us: None, ..row }).collect()
}

/// Makes the recorder, or returns `false` without a C compiler.
fn make_recorder(place: &Place) -> bool {
    let source = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/recorder.c");
    let mut cc = Command::new("cc");
    cc.args(["-shared", "-fPIC", "-O1", "-o"]).arg(place.path("recorder.so")).arg(source).arg("-ldl");
    match cc.status() {
        Ok(status) => assert!(status.success()),
        Err(e) => eprintln!("power cuts left out: no C compiler: {e}"),
    }
    place.path("recorder.so").exists()
}

fn record(place: &Place, args: &[&str]) -> Vec<Step> {
    let log = place.path("log");
    let _ = std::fs::remove_file(&log);
    let mut command = place.command(args);
    command.env("LD_PRELOAD", place.path("recorder.so")).env("HZN_RECORD_LOG", &log);
    assert!(command.status().unwrap().success());
    let steps = parse(&std::fs::read(&log).unwrap());
    assert!(steps.iter().any(|step| matches!(step, Step::Rename { .. })), "the recorder sees the run");
    steps
}

/// Replays every prefix of a run. `before` are the files on the disk at its begin; their rows are never lost.
fn replay(place: &Place, out: &str, before: &[(&str, Vec<u8>)], steps: &[Step], durable: bool) -> usize {
    let ending = out.rsplit('.').next().unwrap();
    let whole = rows(&place.path(out));
    let folder = place.path("");
    let mut seen = Seen::new();
    let mut recovered = |bytes: &[u8]| match seen.get(bytes) {
        Some(rows) => rows.clone(),
        None => {
            let rows = recovered(&folder, ending, bytes);
            seen.insert(bytes.to_vec(), rows.clone());
            rows
        }
    };
    let kept_before = before.iter().filter_map(|(_, bytes)| recovered(bytes)).map(|rows| rows.len()).max();
    let mut disk = Disk::with(before);
    // Number of rows that are surely on the disk.
    let (mut sure, mut checked) = (kept_before.unwrap_or(0), 0);
    for step in steps {
        disk.apply(step);
        let is_of_run = !matches!(step, Step::Open { path, .. } if !path.starts_with("out."));
        if !is_of_run {
            continue;
        }
        if let (Step::Sync { fd }, true) = (step, durable)
            && let Some((Some(inode), _)) = disk.open.get(fd)
            && let Some(rows) = recovered(&disk.inodes[*inode].now)
            && disk.synced_names.values().any(|there| there == inode)
        {
            sure = sure.max(rows.len());
        }
        disk.each_outcome(|files| {
            checked += 1;
            if let Some(bytes) = files.get(out)
                && !before.iter().any(|(name, content)| *name == out && content == bytes)
            {
                let rows = recovered(bytes);
                assert_eq!(rows.as_ref(), Some(&whole), "{out}: a file with the final name is complete");
            }
            let each = files.values().filter_map(|bytes| recovered(bytes));
            let best = each.max_by_key(Vec::len).unwrap_or_default();
            assert_eq!(best, whole[..best.len()], "{out}: the rows that are kept are right");
            assert!(best.len() >= sure, "{out}: {} rows of {sure} are left after {step:?}", best.len());
        });
    }
    disk.each_outcome(|files| assert!(files.contains_key(out), "{out}: after the end, the file is there"));
    checked
}

#[test]
fn a_power_cut_loses_no_finished_picture() {
    // The number of contents grows with that of the pictures, and so does the time to check one of them.
    let place = Place::with_pictures(number("HZN_CUTS", 5) as usize);
    if !make_recorder(&place) {
        return;
    }
    let mut checked = 0;
    for out in ["out.csv", "out.jsonl", "out.mcap"] {
        for durable in [false, true] {
            let mut args = vec!["run", "in", "-o", out, "-j", "1", "-q", "--force"];
            args.extend(durable.then_some("--durable"));
            let _ = std::fs::remove_file(place.path(out));
            let steps = record(&place, &args);
            checked += replay(&place, out, &[], &steps, durable);

            // A run that replaces an earlier file.
            let earlier = std::fs::read(place.path(out)).unwrap();
            let steps = record(&place, &args);
            checked += replay(&place, out, &[(out, earlier)], &steps, durable);

            // A run that continues what a killed one left.
            place.run(&["run", "in/0000.png", "in/0001.png", "in/0002.png", "-o", out, "-q", "--force"]).expect(0);
            let part = format!("{out}.part");
            std::fs::rename(place.path(out), place.path(&part)).unwrap();
            let left = std::fs::read(place.path(&part)).unwrap();
            let mut args = vec!["run", "in", "-o", out, "-j", "1", "-q", "--resume"];
            args.extend(durable.then_some("--durable"));
            let steps = record(&place, &args);
            checked += replay(&place, out, &[(&part, left)], &steps, durable);
        }
    }
    println!("{checked} contents of a disk after a power cut");
    assert!(checked > 500, "{checked}");
}
