//! The state of the window on a flight computer.

use crate::work::Line;

/// Lengths of the time axis that can be chosen, s, with their names.
pub(super) const SPANS: [(f64, &str); 4] = [(60.0, "1 min"), (300.0, "5 min"), (900.0, "15 min"), (3600.0, "1 h")];

/// The window on a flight computer.
pub(super) struct LiveView {
    /// The line.
    pub(super) line: Line,
    pub(super) axis: Axis,
    pub(super) typed: Typed,
}

/// The time axis of all plots.
#[derive(Debug)]
pub(super) struct Axis {
    pub(super) span_s: f64,
    /// The axis ends at the newest answer.
    pub(super) follows: bool,
    /// Where the axis ends, s.
    pub(super) end_s: f64,
}

/// The telecommand that is typed.
#[derive(Debug, Default)]
pub(super) struct Typed {
    pub(super) text: String,
    /// The packets of the text, or why it is refused.
    pub(super) preview: Option<Result<String, String>>,
}

impl LiveView {
    /// Makes the window on a line.
    pub(super) fn new(line: Line) -> Self {
        let axis = Axis { span_s: SPANS[0].0, follows: true, end_s: 0.0 };
        Self { line, axis, typed: Typed::default() }
    }
}
