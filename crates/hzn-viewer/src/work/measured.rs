//! What a calibration measured, and how far it is.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64};

use super::Wake;

/// The limb height that a picture measures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeightOf {
    /// Height, km.
    pub km: f64,
    /// 1-sigma from edge noise, km.
    pub sigma_km: f64,
    /// Whether the picture counts, because its height agrees with the others.
    pub counts: bool,
}

/// What was measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// Lines of the report: name and value.
    pub lines: Vec<(String, String)>,
    /// Keys that would change.
    pub keys: Vec<String>,
    /// The text of the sensor.toml with these keys, or why it must not be changed.
    pub text: Result<String, String>,
    /// The limb height of each answered picture.
    pub heights: Vec<HeightOf>,
    /// The limb height of all pictures, km.
    pub height_km: f64,
    /// What else a plot shows.
    pub marks: Option<Marks>,
}

/// Points of a plot.
#[derive(Debug, Clone, PartialEq)]
pub struct Marks {
    /// The title of the plot.
    pub title: &'static str,
    /// The points, and whether each of them counts.
    pub points: Vec<([f64; 2], bool)>,
}

/// How far a calibration is, and whether it is to stop.
#[derive(Clone)]
pub struct Steps {
    /// True if nobody waits for the result any more.
    pub stop: Arc<AtomicBool>,
    /// Number of pictures that are processed.
    pub done: Arc<AtomicU64>,
    /// Wakes the window.
    pub wake: Wake,
}
