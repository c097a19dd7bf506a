//! The error classes of star sensors, ECSS-E-ST-60-20C, for a sequence of directions.
//!
//! The standard separates errors by how fast they change while a body moves over the detector: the bias is constant,
//! the error over the field of view changes slowly, the pixel error changes within some pixels, and the temporal noise
//! is new in every picture. In a sequence these are parts of the error at different numbers of pictures:
//!
//! - bias: the mean over the sequence;
//! - temporal noise: ½ of the mean square difference between consecutive pictures is its variance;
//! - field of view: the variance of means over [`WINDOW`] pictures about the bias, without the share of the noise in
//!   it;
//! - pixel: the rest of the variance.
//!
//! A body that moves over several pixels from picture to picture shows its pixel error as temporal noise.

use serde::Serialize;

/// Number of consecutive pictures whose mean counts as slow.
pub const WINDOW: usize = 8;

/// 1-sigma of each class about one axis, degrees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ErrorClasses {
    /// The mean error.
    pub bias_deg: f64,
    /// Error that changes over the field of view.
    pub field_of_view_deg: f64,
    /// Error that changes within some pictures.
    pub pixel_deg: f64,
    /// Error that is new in every picture.
    pub temporal_deg: f64,
}

impl ErrorClasses {
    /// Separates a sequence of errors in degrees; `None` for fewer than three windows.
    pub fn new(errors_deg: &[f64]) -> Option<Self> {
        let n = errors_deg.len();
        if n < 3 * WINDOW {
            return None;
        }
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let bias_deg = mean(errors_deg);
        let variance = errors_deg.iter().map(|e| (e - bias_deg) * (e - bias_deg)).sum::<f64>() / n as f64;
        let steps = errors_deg.windows(2).map(|w| (w[1] - w[0]) * (w[1] - w[0])).sum::<f64>() / (n - 1) as f64;
        let temporal = (0.5 * steps).min(variance);
        let slow: Vec<f64> = errors_deg.windows(WINDOW).map(|w| mean(w) - bias_deg).map(|e| e * e).collect();
        let field_of_view = (mean(&slow) - temporal / WINDOW as f64).clamp(0.0, variance - temporal);
        let pixel = (variance - temporal - field_of_view).max(0.0);
        Some(Self {
            bias_deg,
            field_of_view_deg: field_of_view.sqrt(),
            pixel_deg: pixel.sqrt(),
            temporal_deg: temporal.sqrt(),
        })
    }
}
