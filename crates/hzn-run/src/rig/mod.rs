//! The run over several cameras (heads) that are one sensor, as rig.toml describes them.
//!
//! Each head has its own pictures, sensor and thread of answers, as in [`engine::run`](crate::engine::run): its row is
//! that of its sensor. [`open`] opens all of them. [`Epochs`] pairs their pictures by time. [`run`] processes the
//! epochs on all cores, and joins the answers of the heads in the order of time, so that the rows are the same for any
//! number of threads.

mod coarse;
mod epochs;
mod joint;
mod levels;
mod memory;
mod mounts;
mod open;
mod plan;
mod resume;
mod seen;
mod start;
mod sync;

pub use epochs::{Epoch, Epochs};
pub use joint::Joiner;
pub use memory::{Memory, digest};
pub use open::{OpenHead, Opened, Request, open};
pub use plan::{FinishedEpoch, HeadPlan, Plan, look, run};
pub use resume::{go_to, run_again_from};
pub use seen::{Repeat, Seen};
pub use start::Start;
