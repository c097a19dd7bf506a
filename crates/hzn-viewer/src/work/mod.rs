//! What happens beside the window, on threads of its own: opening, decoding, processing, exporting.

pub mod engine;
pub mod export;
pub mod frame_view;
pub mod job;
pub mod open;
pub mod paint;
mod reader;
pub mod store;
pub mod sweep;
mod walk;

pub use engine::{Ask, Engine, Setup};
pub use frame_view::{BodyResult, FrameView};
pub use job::Job;

use std::sync::Arc;

/// Called by a thread that has something new to show.
pub type Wake = Arc<dyn Fn() + Send + Sync>;
