//! The results that an output contains already.

use crate::engine::LastAnswer;

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
}

impl StoredResults {
    /// Records the answers in a picture's rows, one row for each body.
    pub(super) fn record_answers(&mut self, rows: &[hzn_mcap::Row]) {
        self.last_answers.resize(rows.len().max(self.last_answers.len()), None);
        for (answer, row) in self.last_answers.iter_mut().zip(rows) {
            *answer = LastAnswer::from_row(row).or(*answer);
        }
    }
}
