//! The folder of the recordings, with its share of the disk.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use hzn_mcap::{part_path, recover};

use crate::tell::Tell;

/// Parts into which the share of the disk is divided. When it is full, the oldest part is removed.
pub(super) const PARTS: u64 = 8;

/// A folder with numbered recordings.
#[derive(Debug)]
pub(super) struct Folder {
    path: PathBuf,
    limit_bytes: u64,
    next: u64,
}

/// A recording of the folder, finished or not.
#[derive(Debug)]
struct Entry {
    number: u64,
    path: PathBuf,
    bytes: u64,
    is_finished: bool,
}

impl Folder {
    pub(super) fn open(path: &Path, limit_bytes: u64) -> io::Result<Self> {
        fs::create_dir_all(path)?;
        let mut folder = Self { path: path.to_owned(), limit_bytes, next: 1 };
        fs::read_dir(path)?;
        folder.next = folder.entries().last().map_or(1, |last| last.number + 1);
        Ok(folder)
    }

    /// Returns the most bytes of a recording.
    pub(super) fn file_bytes(&self) -> u64 {
        self.limit_bytes / PARTS
    }

    fn file(&self, number: u64) -> PathBuf {
        self.path.join(format!("fly-{number:06}.mcap"))
    }

    /// Returns the recordings, the oldest first.
    fn entries(&self) -> Vec<Entry> {
        entries(&self.path)
    }

    /// Removes the oldest recordings until there is room for one more within the share of the disk. Returns the path of
    /// the new one.
    pub(super) fn make_room(&mut self) -> PathBuf {
        self.free(self.file_bytes(), u64::MAX);
        let path = self.file(self.next);
        self.next += 1;
        path
    }

    /// Removes recordings older than number `below`, the oldest first, until there is room for `bytes` more.
    fn free(&self, bytes: u64, below: u64) {
        let entries = self.entries();
        let mut used: u64 = entries.iter().map(|entry| entry.bytes).sum();
        for entry in entries.iter().filter(|entry| entry.number < below) {
            if used + bytes <= self.limit_bytes {
                return;
            }
            if fs::remove_file(&entry.path).is_ok() {
                used -= entry.bytes;
            }
        }
    }

    /// Removes the oldest finished recording. Returns its name; `None` if there is none but the newest recording.
    pub(super) fn remove_oldest(&self) -> Option<String> {
        let entries = self.entries();
        let (_, older) = entries.split_last()?;
        let oldest = older.iter().find(|entry| entry.is_finished)?;
        fs::remove_file(&oldest.path).ok()?;
        Some(oldest.path.display().to_string())
    }

    /// Closes the recordings that are not finished. Nobody may be writing them.
    pub(super) fn recover(&mut self, tell: &Tell) {
        for entry in self.entries().into_iter().filter(|entry| !entry.is_finished) {
            let file = self.file(entry.number);
            // `recover` writes to `NAME.part` first, so the recording needs another name meanwhile.
            let input = part_path(&part_path(&file));
            if entry.path != input && input.exists() {
                // A crash interrupted an earlier recovery; this is its incomplete copy.
                let _ = fs::remove_file(&entry.path);
                continue;
            }
            // The copy has at most the bytes that the recording was allowed to have.
            self.free(entry.bytes.max(self.file_bytes()), entry.number);
            if entry.path != input && fs::rename(&entry.path, &input).is_err() {
                continue;
            }
            let name = file.display();
            match recover(&input, &file) {
                Ok(found) => {
                    let _ = fs::remove_file(&input);
                    tell(&format!("{name}: {} answers were recovered", found.frames));
                }
                // Nothing was written before the end.
                Err(hzn_mcap::Error::NotMcap { .. }) => {
                    let _ = fs::remove_file(&input);
                }
                Err(e) => {
                    let _ = fs::rename(&input, part_path(&file));
                    tell(&format!("{name}.part stays as it is: {e}"));
                }
            }
        }
    }
}

/// Returns the recordings of a folder, the oldest first.
fn entries(folder: &Path) -> Vec<Entry> {
    let mut entries: Vec<Entry> = Vec::new();
    for file in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = file.file_name().to_string_lossy().into_owned();
        let base = name.trim_end_matches(".part");
        let is_finished = base == name;
        let number = base.strip_prefix("fly-").and_then(|n| n.strip_suffix(".mcap")).and_then(|n| n.parse().ok());
        if let (Some(number), Ok(meta)) = (number, file.metadata()) {
            entries.push(Entry { number, path: file.path(), bytes: meta.len(), is_finished });
        }
    }
    entries.sort_by_key(|entry| entry.number);
    entries
}

/// Removes the finished recording with the smallest number in one of these folders; `with_unfinished`, also one that is
/// not finished, if there is no other. Returns its name.
pub(super) fn remove_oldest_of(folders: &[PathBuf], with_unfinished: bool) -> Option<String> {
    let all = folders.iter().flat_map(|folder| entries(folder));
    let oldest = all.filter(|entry| entry.is_finished || with_unfinished);
    let oldest = oldest.min_by_key(|entry| (!entry.is_finished, entry.number))?;
    fs::remove_file(&oldest.path).ok()?;
    Some(oldest.path.display().to_string())
}
