//! The field of view of a camera.

use hzn_core::camera::{self, Camera};
use hzn_core::pixel::ImagePoint;

/// Slightly inside the picture's outer corner, in pixels: without an image circle the lens ends at the farthest corner.
const SIDE_PX: f64 = -0.5 + 1e-6;

/// Returns the largest angle off axis that the picture shows, in radians: the image circle, or the farthest corner.
pub(super) fn end_rad(c: &camera::Config, camera: &Camera<f64>) -> f64 {
    let (right, bottom) = (f64::from(c.width) - 1.0 - SIDE_PX, f64::from(c.height) - 1.0 - SIDE_PX);
    let corners = [(SIDE_PX, SIDE_PX), (right, SIDE_PX), (SIDE_PX, bottom), (right, bottom)];
    let off_axis = |(u, v)| camera.unproject(ImagePoint { u, v }).map(|ray| ray.xyz()[2].clamp(-1.0, 1.0).acos());
    match camera.image_circle_px() {
        Some(_) => camera.theta_max_rad(),
        None => corners.into_iter().filter_map(off_axis).reduce(f64::max).unwrap_or(camera.theta_max_rad()),
    }
}

/// Returns the angles that the picture shows, in words.
pub(super) fn field_of_view(c: &camera::Config, camera: &Camera<f64>) -> String {
    let side = SIDE_PX;
    let (right, bottom) = (f64::from(c.width) - 1.0 - side, f64::from(c.height) - 1.0 - side);
    let angle = |a: (f64, f64), b: (f64, f64)| {
        let ray = |(u, v)| camera.unproject(ImagePoint { u, v });
        Some(ray(a)?.angle_rad(&ray(b)?).to_degrees())
    };
    let text = |deg: Option<f64>| deg.map_or("beyond the image circle".to_owned(), |d| format!("{d:.2} deg"));
    format!(
        "{} horizontally, {} vertically, {} from corner to corner",
        text(angle((side, c.cy_px), (right, c.cy_px))),
        text(angle((c.cx_px, side), (c.cx_px, bottom))),
        text(angle((side, side), (right, bottom)))
    )
}
