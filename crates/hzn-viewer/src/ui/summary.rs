//! Counts of the pictures by status and reason, and the answers that are conspicuous, kept until the results change.

use std::collections::HashMap;

use hzn_files::truth::Truth;

use crate::model::cause::{self, Counted};
use crate::model::quantity::{self, ExpectedRms};
use crate::model::sheet::Key;
use crate::model::{ResultHistory, Session};

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

/// Pictures whose answer misses the truth by more than its 3-sigma, or whose residuals are too large, kept until the
/// results change.
#[derive(Debug, Default)]
pub(super) struct Missed {
    of: Option<(u64, usize, usize, u64)>,
    pictures: Vec<usize>,
    /// The RMS that the residuals of an answer should have.
    pub(super) expected_rms: Option<ExpectedRms>,
}

impl Missed {
    /// Returns the pictures for the newest results of a body.
    pub(super) fn update(
        &mut self,
        rows: &ResultHistory,
        truth: &HashMap<String, Vec<Truth>>,
        session: Option<&Session>,
        body: usize,
    ) -> &[usize] {
        let key = (rows.generation(), truth.len(), body, session.map_or(0, Session::version));
        if self.of != Some(key) {
            self.of = Some(key);
            let of_row = |row: &hzn_mcap::Row| truth.get(&row.file)?.iter().find(|t| t.body == row.body);
            let (section, name) = ("covariance", "sigma_px");
            let is_told = |s: &&Session| s.sheet().get(Key { section, name, body }).is_some();
            let told_px = session.filter(is_told).and_then(|s| s.number(section, name, body));
            let all = (0..rows.len()).filter_map(|i| rows.newest(i, body));
            let expected = ExpectedRms::new(told_px, all);
            let is_conspicuous = |row: &hzn_mcap::Row| {
                quantity::misses_truth(row, of_row(row)) || expected.is_some_and(|rms| rms.exceeded_by(row).is_some())
            };
            let marked = |i: &usize| rows.newest(*i, body).is_some_and(is_conspicuous);
            self.pictures = (0..rows.len()).filter(marked).collect();
            self.expected_rms = expected;
        }
        &self.pictures
    }
}
