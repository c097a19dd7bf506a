//! The results that an output contains already.

use std::ops::Range;
use std::path::Path;
use std::time::SystemTime;

use hzn_core::status::Status;
use hzn_files::rig::JOINT;

use super::chain::Links;
use crate::checked_row::sum;
use crate::engine::{LastAnswer, StoredAnswer};
use crate::source::Payload;
use crate::source::identity::{changed, digest};

/// The results that an output contains already.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StoredResults {
    /// Number of pictures.
    pub frames: u64,
    /// Number of rows; a picture has one for each body.
    pub rows: u64,
    /// The last row.
    pub last: Option<hzn_mcap::Row>,
    /// The last answer of each body.
    pub last_answers: Vec<Option<LastAnswer>>,
    /// The checksum of each row, see [`checked_row::sum`](crate::checked_row::sum). With them, a picture that is
    /// processed again can be compared with its row. A table of a million rows takes 60 MB in all.
    pub sums: Vec<u32>,
    /// The answer of each row, for `gates.fixed_edge`: its later answers depend on all earlier ones.
    pub answers: Vec<Option<StoredAnswer>>,
    /// The time of each picture.
    pub times_s: Vec<Option<f64>>,
    /// With a rig, its epochs; `answers`, `times_s` and `last_answers` are then empty.
    pub epochs: Vec<StoredEpoch>,
    /// The time of the last write before the output was opened.
    pub written: Option<SystemTime>,
    /// What the file next to the output says of the pictures and their rows.
    pub(super) links: Links,
}

impl StoredResults {
    /// Returns whether a file was changed, replaced or moved since the results were last written. A file that cannot be
    /// examined counts as changed, because nothing is known of it.
    pub fn is_older_than(&self, file: &Path) -> bool {
        let Some(written) = self.written else { return true };
        std::fs::metadata(file).ok().and_then(|data| changed(&data)).is_none_or(|changed| changed >= written)
    }

    /// Returns whether the pictures with this number were changed since they were processed: the one of a run, or those
    /// of a rig. What is known of each picture decides; without it, whether a file is newer than the results.
    pub fn is_changed<'a>(&self, n: u64, pictures: impl Iterator<Item = &'a Payload> + Clone) -> bool {
        let now = || all_identities(pictures.clone().map(Payload::identity));
        match self.links.identity(n) {
            Some(known) => now() != Some(known),
            None => pictures.clone().filter_map(Payload::file).any(|file| self.is_older_than(file)),
        }
    }

    /// Returns the first picture from which on the rows are not those that were written for the pictures, as the file
    /// next to the output says; `None` if it says nothing against them.
    pub fn contradicted_from(&self) -> Option<u64> {
        self.links.contradicted_from().filter(|from| *from < self.frames)
    }

    /// Records the answers and checksums of a picture's rows, one row for each body.
    pub(super) fn record(&mut self, rows: &[hzn_mcap::Row]) {
        // A row that came from a file can be written again.
        self.sums.extend(rows.iter().map(|row| sum(row).unwrap_or_default()));
        self.answers.extend(rows.iter().map(StoredAnswer::from_row));
        self.times_s.extend(rows.first().map(|row| row.time_s));
        self.last_answers.resize(rows.len().max(self.last_answers.len()), None);
        for (answer, row) in self.last_answers.iter_mut().zip(rows) {
            *answer = LastAnswer::from_row(row).or(*answer);
        }
    }
}

/// The rows of an epoch of a rig that an output contains: the joint answer first, then those of the heads.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredEpoch {
    /// Place of its first row among the sums, and number of its rows.
    rows: Range<usize>,
    heads: Vec<StoredHead>,
}

/// The picture of a head in a stored epoch.
#[derive(Debug, Clone, PartialEq)]
struct StoredHead {
    /// Checksums of the names of the head and of its picture.
    name: [u32; 2],
    time_s: Option<f64>,
    /// Whether it has an answer about its first body.
    is_ok: bool,
    answers: Vec<Option<StoredAnswer>>,
}

/// A picture of a head in the results of an earlier run.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StoredPicture<'a> {
    picture: u32,
    /// Its time in seconds.
    pub(crate) time_s: Option<f64>,
    /// Whether it has an answer about the first body.
    pub(crate) is_ok: bool,
    /// The answer of each body.
    pub(crate) answers: &'a [Option<StoredAnswer>],
}

impl StoredPicture<'_> {
    /// Returns whether the picture has this name.
    pub(crate) fn has_name(&self, name: &str) -> bool {
        crc32fast::hash(name.as_bytes()) == self.picture
    }
}

impl StoredEpoch {
    /// Returns the picture of a head; `None` if it had none.
    pub(crate) fn picture(&self, head: &str) -> Option<StoredPicture<'_>> {
        let own = crc32fast::hash(head.as_bytes());
        let found = self.heads.iter().find(|stored| stored.name[0] == own)?;
        Some(StoredPicture {
            picture: found.name[1],
            time_s: found.time_s,
            is_ok: found.is_ok,
            answers: &found.answers,
        })
    }

    /// Returns the number of heads that have a picture.
    pub fn pictures(&self) -> usize {
        self.heads.len()
    }
}

impl StoredResults {
    /// Records the rows of an epoch of a rig.
    pub(super) fn record_epoch(&mut self, rows: &[hzn_mcap::Row]) {
        let first = self.sums.len();
        self.sums.extend(rows.iter().map(|row| sum(row).unwrap_or_default()));
        let mut heads: Vec<StoredHead> = Vec::new();
        for row in rows {
            let Some(head) = row.head.as_deref().filter(|head| *head != JOINT) else { continue };
            let name = [head, &row.file].map(|text| crc32fast::hash(text.as_bytes()));
            let answer = StoredAnswer::from_row(row);
            match heads.last_mut().filter(|last| last.name == name) {
                Some(last) => last.answers.push(answer),
                None => heads.push(StoredHead {
                    name,
                    time_s: row.time_s,
                    is_ok: row.status == Status::Ok,
                    answers: vec![answer],
                }),
            }
        }
        self.epochs.push(StoredEpoch { rows: first..self.sums.len(), heads });
        self.frames += 1;
        self.rows += rows.len() as u64;
    }

    /// Returns the checksums of the rows of a picture, or of an epoch of a rig.
    pub(super) fn sums_of(&self, n: u64) -> &[u32] {
        if !self.epochs.is_empty() {
            return self.sums_of_epoch(n);
        }
        let each = self.sums.len() / (self.frames as usize).max(1);
        let first = n as usize * each;
        self.sums.get(first..first + each).unwrap_or_default()
    }

    /// Returns the checksums of the rows of an epoch.
    pub(super) fn sums_of_epoch(&self, index: u64) -> &[u32] {
        let rows = self.epochs.get(index as usize).map(|epoch| epoch.rows.clone());
        rows.and_then(|rows| self.sums.get(rows)).unwrap_or_default()
    }
}

/// Returns what tells the pictures that belong together from others, if it is known of each.
pub(crate) fn all_identities(each: impl Iterator<Item = Option<u64>>) -> Option<u64> {
    each.collect::<Option<Vec<_>>>().filter(|each| !each.is_empty()).map(digest)
}
