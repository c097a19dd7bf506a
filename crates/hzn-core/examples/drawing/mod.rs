//! Draws the pictures of the examples.

use std::vec::Vec;

use hzn_core::camera::{Camera, Config};
use hzn_core::frames::{Cam, UnitVec3};
use hzn_core::pixel::ImagePoint;

/// A body of half-angle `half_angle_rad` around `axis`, row by row: 10 counts of sky, 190 of ground, and an edge that
/// is two pixels wide.
pub(crate) fn limb(lens: &Config, axis: &UnitVec3<Cam, f64>, half_angle_rad: f64) -> Vec<u8> {
    let camera = Camera::<f64>::try_new(lens).expect("the example's lens");
    let (width, height) = (usize::from(camera.width()), usize::from(camera.height()));
    let (focal_px, _) = camera.focal_px();
    let brightness = |i: usize| {
        let point = ImagePoint { u: (i % width) as f64, v: (i / width) as f64 };
        let Some(ray) = camera.unproject(point) else { return 0 };
        let above_limb_px = (ray.angle_rad(axis) - half_angle_rad) * focal_px;
        (10.0 + 180.0 * (0.5 - above_limb_px / 2.0).clamp(0.0, 1.0)) as u8
    };
    (0..width * height).map(brightness).collect()
}
