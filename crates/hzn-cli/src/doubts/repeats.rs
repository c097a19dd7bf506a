//! Counts pictures that repeat one of the last pictures to the last bit.

use hzn_core::gates::{self, FixedEdge};
use hzn_run::engine::Finished;
use hzn_run::explain;

use crate::tell;

/// Counts pictures that repeat an earlier one.
#[derive(Default)]
pub(crate) struct Repeats {
    pictures: u64,
    /// Those with a time that is told.
    timed: u64,
    first: Option<String>,
}

impl Repeats {
    pub(crate) fn count(&mut self, frame: &Finished) {
        let Some(bytes) = frame.bytes.filter(|bytes| bytes.repeats) else { return };
        self.pictures += 1;
        self.timed += u64::from(bytes.has_time);
        self.first.get_or_insert_with(|| frame.name.clone());
    }

    /// Returns what repeats and what became of it.
    fn describe(&self, gates: &gates::Config) -> Option<String> {
        let first = self.first.as_ref()?;
        let (pictures, repeat) =
            (explain::counted(self.pictures, "picture"), if self.pictures == 1 { "repeats" } else { "repeat" });
        let outcome = if self.timed == 0 {
            "Without told times they may be copies; their answers say nothing new"
        } else if gates.fixed_edge == FixedEdge::Refuse {
            "Their times differ, so the camera or its recorder stood still, and their answers are refused (fixed)"
        } else {
            "Their times differ, so the camera or its recorder stood still: gates.fixed_edge = \"refuse\" refuses \
             their answers"
        };
        Some(format!("{pictures} {repeat} an earlier one to the last bit (the first is {first}). {outcome}"))
    }

    /// Tells it. Copies without times are no fault, so a quiet run says nothing of them.
    pub(crate) fn tell(&self, gates: &gates::Config, quiet: bool) {
        match self.describe(gates) {
            Some(what) if self.timed > 0 => tell::warning(what),
            Some(what) if !quiet => tell::line(format_args!("note: {what}")),
            _ => {}
        }
    }
}
