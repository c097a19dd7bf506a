//! Light and cover of a figure at a point of the picture.

use hzn_core::camera;
use hzn_sim::detector::Plane;

/// Effect of a figure on a pixel: 1 − `cover` of the light behind it is left, and `light` is added.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Spot {
    pub(super) light: f32,
    pub(super) cover: f32,
}

/// The picture for which figures are drawn.
#[derive(Debug, Clone, Copy)]
pub(super) struct Canvas {
    /// Number of columns.
    pub(super) width: f64,
    /// Number of rows.
    pub(super) height: f64,
    /// Diagonal in pixels, the unit of lengths.
    pub(super) diagonal: f64,
    /// Principal point, pixels.
    pub(super) centre: [f64; 2],
    /// Pixels per radian in the middle.
    pub(super) focal_px: f64,
}

impl Canvas {
    pub(super) fn from_camera(camera: &camera::Config) -> Self {
        let (width, height) = (f64::from(camera.width), f64::from(camera.height));
        let diagonal = libm::hypot(width, height);
        Self { width, height, diagonal, centre: [camera.cx_px, camera.cy_px], focal_px: camera.fx_px }
    }
}

/// A figure in the picture.
pub(super) trait Shape: Send + Sync {
    /// Returns the spot at a point in pixels.
    fn sample(&self, x: f32, y: f32) -> Spot;

    /// Paints the figure onto a picture.
    fn paint(&self, plane: &mut Plane) {
        let width = plane.width;
        for (y, row) in plane.data.chunks_mut(width).enumerate() {
            for (x, pixel) in row.iter_mut().enumerate() {
                let spot = self.sample(x as f32, y as f32);
                *pixel = *pixel * (1.0 - spot.cover) + spot.light;
            }
        }
    }
}

/// Returns an edge blurred to a Gaussian of standard deviation `soft`: 0 far outside (`inside` below 0), 1 far inside.
#[inline(always)]
pub(super) fn step(inside: f32, soft: f32) -> f32 {
    // The value is within 0.02 of the Gaussian's integral, and exactly 0 and 1 from 2.2 sigma on.
    let t = (0.5 + inside / (4.4 * soft)).clamp(0.0, 1.0);
    t * t * t * (t * (6.0 * t - 15.0) + 10.0)
}
