//! Light and cover of a figure at a place of the picture.

use crate::detector::Plane;

/// What a figure does to a pixel: of the light behind it 1 − `cover` is left, and `light` is added.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Spot {
    pub(super) light: f32,
    pub(super) cover: f32,
}

/// The picture that figures are drawn for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Canvas {
    /// Columns and rows.
    pub(super) width: f64,
    pub(super) height: f64,
    /// Diagonal in pixels, the unit of lengths.
    pub(super) diagonal: f64,
    /// Principal point.
    pub(super) centre: [f64; 2],
    /// Pixels a radian in the middle.
    pub(super) focal_px: f64,
}

/// A figure in the picture.
pub(super) trait Shape: Send + Sync {
    /// At a place in pixels.
    fn at(&self, x: f32, y: f32) -> Spot;

    /// Onto a picture.
    fn paint(&self, plane: &mut Plane) {
        let width = plane.width;
        for (y, row) in plane.data.chunks_mut(width).enumerate() {
            for (x, pixel) in row.iter_mut().enumerate() {
                let spot = self.at(x as f32, y as f32);
                *pixel = *pixel * (1.0 - spot.cover) + spot.light;
            }
        }
    }
}

/// An edge blurred to a Gaussian's standard deviation `soft`: 0 where `inside` is far below 0, 1 far above.
#[inline(always)]
pub(super) fn step(inside: f32, soft: f32) -> f32 {
    // Within 0.02 of the Gaussian's integral, and exactly 0 and 1 from 2.2 sigma on.
    let t = (0.5 + inside / (4.4 * soft)).clamp(0.0, 1.0);
    t * t * t * (t * (6.0 * t - 15.0) + 10.0)
}
