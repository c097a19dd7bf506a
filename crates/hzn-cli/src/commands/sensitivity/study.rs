//! The result of one subject, before it is written.

use super::table::Table;
use crate::plot::Chart;

/// The result of one subject.
pub(super) struct Study {
    pub(super) table: Table,
    pub(super) chart: Option<Chart>,
    pub(super) notes: Vec<String>,
}
