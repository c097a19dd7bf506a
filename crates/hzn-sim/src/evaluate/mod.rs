//! Answers of the sensor beside the truth: how many, how good, how honest.
//!
//! ```text
//!   answers ─┐
//!            ├─ pair ─► Case (one a frame and body) ─► Evaluation::new ─► shares, errors, honesty, groups
//!   truth  ──┘
//! ```
//!
//! Nothing is left out quietly: an answer without a truth and a truth without an answer are a [`Mismatch`], a frame
//! that was not answered counts as such, and an answer where no limb is in view counts as a false one.

mod case;
mod honesty;
mod summary;

pub use case::{Answer, Case, MeasuredDirection, Mismatch, Miss, limb_in_view_px, pair};
pub use honesty::{Honesty, Within};
pub use summary::{Errors, Evaluation, Group, GroupRow, Horace};

#[cfg(test)]
mod tests;
