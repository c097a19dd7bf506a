//! The run over a sequence: it uses all cores, returns results in order, and has a bounded number of pictures in
//! memory.
//!
//! ```text
//!   source ──► jobs ──► N threads (decode, process, draw) ──► results ──► put in order ──► sink
//!      ▲                                                                       │
//!      └───────────────────────── tickets (a fixed number) ◄───────────────────┘
//! ```
//!
//! The source is read only while a ticket is free. A ticket comes back when its picture is written. Therefore memory
//! does not grow with the sequence, even if one picture or the disk is slow.

mod annotate;
mod answers;
mod expected_limb;
mod outcome;
mod plan;
mod pool;
mod prior;
mod process;
mod sensor;
mod sequence;
#[cfg(test)]
mod tests;
mod tiles;
mod told_sun;
pub mod trace;
mod turns;
mod widen;

pub use annotate::annotate;
pub use answers::{Answered, Measured, measure_answers};
pub use expected_limb::ExpectedLimb;
pub use outcome::{BodyOutcome, Bytes, Finished, Repeats, Sums, Unprocessed};
pub use plan::Plan;
pub use pool::End;
#[cfg(feature = "recordings")]
pub(crate) use pool::{InOrder, Work, run_in_order};
#[cfg(feature = "recordings")]
pub(crate) use prior::prior;
pub use process::process_one;
pub use sensor::{AnySensor, LastAnswer, Processed, check_frames, find_refused};
pub use sequence::{Sink, process_alone, run};
pub use tiles::Tiles;
pub use trace::{Trace, Traces, Watch};
pub use turns::{REMEMBERED, StoredAnswer, Turns};
pub use widen::{widen_report, widen_solution};
