//! Counts pictures that repeat one of the last pictures to the last bit, at least along the limb.

use hzn_core::gates::{self, FixedEdge};
use hzn_run::engine::{self, Finished};
use hzn_run::explain;

use crate::tell;

/// Counts pictures that repeat an earlier one.
#[derive(Default)]
pub(crate) struct Repeats {
    pictures: u64,
    /// Those that repeat only the limb, with other pixels elsewhere.
    limbs: u64,
    /// Those with a time that is told.
    timed: u64,
    first: Option<String>,
}

impl Repeats {
    pub(crate) fn count(&mut self, frame: &Finished) {
        let Some(bytes) = frame.bytes.as_ref().filter(|bytes| bytes.repeats != engine::Repeats::Nothing) else {
            return;
        };
        self.pictures += 1;
        self.limbs += u64::from(bytes.repeats == engine::Repeats::Limb);
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
        let part = if self.limbs == 0 {
            String::new()
        } else if self.limbs == self.pictures {
            " along the limb, though not elsewhere".into()
        } else {
            format!(", {} of them along the limb only", self.limbs)
        };
        Some(format!("{pictures} {repeat} an earlier one to the last bit{part} (the first is {first}). {outcome}"))
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
