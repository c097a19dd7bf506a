//! Answers of the sensor compared with the truth: how many there are, how accurate they are, and whether their
//! covariances are right.
//!
//! ```text
//!   answers ─┐
//!            ├─ pair ─► Case (one a frame and body) ─► Evaluation::new ─► shares, errors, honesty, groups
//!   truth  ──┘
//! ```
//!
//! Nothing is left out silently. An answer without a truth is a [`Mismatch`], and so is a truth without an answer. A
//! picture that was not answered counts as unanswered. An answer to a picture without a limb in view counts as a false
//! answer.

mod attitudes;
mod case;
mod classes;
mod convention;
pub mod heads;
mod honesty;
mod integrity;
mod means;
mod position;
mod quantile;
mod summary;

pub use attitudes::{Sighting, find_attitude_convention};
pub use case::{Answer, Case, MeasuredDirection, Mismatch, Miss, limb_in_view_px, pair};
pub use classes::{ErrorClasses, WINDOW};
pub use convention::describe_conventions;
pub use honesty::{Honesty, Within};
pub use integrity::{Integrity, IntegrityRange, share_interval};
pub use means::{LENGTHS, Means};
pub use position::{MeasuredPosition, PositionErrors, PositionMiss};
pub use summary::{Errors, Evaluation, Group, GroupRow, Horace, PictureError};

#[cfg(test)]
mod tests;
