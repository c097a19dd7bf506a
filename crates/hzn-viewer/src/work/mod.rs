//! Work on separate threads, so that the window does not wait: opening, decoding, processing and exporting.

pub mod engine;
pub mod export;
pub mod frame_view;
pub mod job;
pub mod open;
pub mod paint;
mod reader;
mod sequence_source;
pub mod store;
pub mod sweep;

pub use engine::{Engine, FrameRequest, Setup};
pub use frame_view::{BodyResult, FrameView};
pub use job::Job;

use std::sync::Arc;

/// Wakes the window. A thread calls it when there is something new to show.
pub type Wake = Arc<dyn Fn() + Send + Sync>;
