//! The results that an output contains already.

use std::path::Path;
use std::time::{Duration, SystemTime};

use crate::checked_row::sum;
use crate::engine::{LastAnswer, StoredAnswer};

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
    /// The time of the last write before the output was opened.
    pub written: Option<SystemTime>,
}

impl StoredResults {
    /// Returns whether a file was changed, replaced or moved since the results were last written. A file that cannot be
    /// examined counts as changed, because nothing is known of it.
    pub fn is_older_than(&self, file: &Path) -> bool {
        let Some(written) = self.written else { return true };
        changed(file).is_none_or(|changed| changed >= written)
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

/// Returns when a file got its contents or its place. A copy may keep the time of the original's contents, but not that
/// of its entry, which a file system without such a time does not have.
fn changed(file: &Path) -> Option<SystemTime> {
    let data = std::fs::metadata(file).ok()?;
    let modified = data.modified().ok()?;
    #[cfg(unix)]
    let entered = {
        use std::os::unix::fs::MetadataExt;
        let whole = u64::try_from(data.ctime()).ok().map(Duration::from_secs);
        let part = u64::try_from(data.ctime_nsec()).ok().map(Duration::from_nanos);
        whole.zip(part).map(|(whole, part)| SystemTime::UNIX_EPOCH + whole + part)
    };
    #[cfg(not(unix))]
    let entered = None;
    Some(entered.map_or(modified, |entered: SystemTime| entered.max(modified)))
}
