//! Counts of the pictures by status and reason, kept until the results change.

use crate::model::ResultHistory;
use crate::model::cause::{self, Counted};

/// Counts that are kept until the results change.
#[derive(Debug, Default)]
pub(super) struct Summary {
    of: Option<(u64, usize)>,
    counted: Vec<Counted>,
}

impl Summary {
    /// Returns the counts of the newest results of a body.
    pub(super) fn update(&mut self, rows: &ResultHistory, body: usize) -> &[Counted] {
        let key = (rows.generation(), body);
        if self.of != Some(key) {
            self.of = Some(key);
            self.counted = cause::count((0..rows.len()).filter_map(|i| rows.cause(i, body)));
        }
        &self.counted
    }
}
