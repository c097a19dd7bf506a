//! The state of the window that calibrates.

use super::board_form::BoardForm;
use crate::work::calibration::Calibration;
use crate::work::measured::Measured;

/// A calibration: in progress, or with its result.
pub(super) struct CalibrationWindow {
    pub(super) name: &'static str,
    /// What is asked before the pictures of a board are chosen.
    pub(super) form: Option<BoardForm>,
    /// Work in progress; `None` when it has ended.
    pub(super) running: Option<Calibration>,
    /// The result, or why there is none.
    pub(super) result: Option<Result<Measured, String>>,
    /// Version of the session that was calibrated. The result belongs to it alone.
    pub(super) version: u64,
}
