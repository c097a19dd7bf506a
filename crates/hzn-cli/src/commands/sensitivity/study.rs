//! The result of one subject, before it is written.

use hzn_plot::Chart;

use super::table::Table;

/// The result of one subject.
pub(super) struct Study {
    pub(super) table: Table,
    pub(super) chart: Option<Chart>,
    pub(super) notes: Vec<String>,
}
