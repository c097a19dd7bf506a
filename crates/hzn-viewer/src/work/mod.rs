//! Work on separate threads, so that the window does not wait: opening, decoding, processing and exporting.

#[cfg(test)]
mod answers;
pub mod background;
pub mod board;
pub mod calibration;
mod canvas;
pub mod check;
pub mod coast;
pub mod companion;
pub mod demo;
pub mod engine;
mod entry;
pub mod export;
mod frame_joiner;
pub mod frame_view;
mod frames_table;
pub mod ground;
pub mod job;
pub mod lens_from_limb;
pub mod line;
pub mod measured;
pub mod open;
pub mod paint;
pub mod plots;
mod reader;
pub mod residuals;
pub mod rig;
mod sensor_text;
mod sequence_source;
pub mod sky;
pub mod space;
pub mod stars;
pub mod store;
pub mod study;
mod summary;
pub mod sweep;
pub mod thumbnails;
pub mod trials;

pub use engine::{Engine, FrameRequest, Setup};
pub use frame_view::{BodyResult, FrameView};
pub use job::Job;
pub use line::{Computer, Line};
pub use sensor_text::SensorText;

use std::sync::Arc;

/// Wakes the window. A thread calls it when there is something new to show.
pub type Wake = Arc<dyn Fn() + Send + Sync>;
