//! The parts of a request that its answer depends on.

use crate::model::{Contrast, Look};

/// The last request. An equal request is not sent again.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct RequestKey {
    pub(super) index: usize,
    pub(super) versions: Vec<u64>,
    pub(super) look: Look,
    pub(super) contrast: (Contrast, f32),
    pub(super) undistorted: bool,
    pub(super) touched: bool,
    pub(super) flight: bool,
    pub(super) title: String,
}
