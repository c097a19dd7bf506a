//! Counts of the pictures by status and reason, and the answers that miss the truth, kept until the results change.

use std::collections::HashMap;

use hzn_files::truth::Truth;

use crate::model::cause::{self, Counted};
use crate::model::{ResultHistory, quantity};

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

/// Pictures whose answer misses the truth by more than its 3-sigma, kept until the results change.
#[derive(Debug, Default)]
pub(super) struct Missed {
    of: Option<(u64, usize, usize)>,
    pictures: Vec<usize>,
}

impl Missed {
    /// Returns the pictures for the newest results of a body.
    pub(super) fn update(
        &mut self,
        rows: &ResultHistory,
        truth: &HashMap<String, Vec<Truth>>,
        body: usize,
    ) -> &[usize] {
        let key = (rows.generation(), truth.len(), body);
        if self.of != Some(key) {
            self.of = Some(key);
            let of_row = |row: &hzn_mcap::Row| truth.get(&row.file)?.iter().find(|t| t.body == row.body);
            let misses = |i: &usize| rows.newest(*i, body).is_some_and(|row| quantity::misses_truth(row, of_row(row)));
            self.pictures = (0..rows.len()).filter(misses).collect();
        }
        &self.pictures
    }
}
