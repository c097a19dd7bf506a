//! The content of a report.

use hzn_evaluate::{Case, Evaluation};
use serde::Serialize;

/// Everything that a report shows. Its JSON is this structure.
#[derive(Debug, Serialize)]
pub(super) struct Report {
    pub(super) results: String,
    pub(super) truth: String,
    pub(super) evaluations: Vec<Evaluation>,
    pub(super) frames: Vec<Case>,
    /// Hashes of the sensors, for the last line of the page.
    #[serde(skip)]
    pub(super) sensors: Vec<String>,
}
