//! The image circle of a lens in a rendered picture.

use hzn_core::camera::{self, Camera};
use rayon::prelude::*;

use crate::detector::Plane;
use crate::error::SceneError;

/// Returns the lens without its image circle, or with a wider one, as far as it stays monotone. The scene continues
/// beyond the circle, so the blur takes light from there, as with a stop close to the detector.
pub(crate) fn lens_without_circle(config: &camera::Config) -> Result<Camera<f64>, SceneError> {
    let with = |theta_max_deg| Camera::try_new(&camera::Config { theta_max_deg, ..config.clone() });
    let wider = config.theta_max_deg.map(|deg| deg + 3.0);
    with(None).or_else(|_| with(wider)).or_else(|_| with(config.theta_max_deg)).map_err(SceneError::from)
}

/// Removes all light beyond the image circle.
pub(crate) fn apply_image_circle(mut light: Plane, camera: &Camera<f64>) -> Plane {
    if let Some((c, a, b)) = camera.image_circle_px() {
        let w = light.width;
        light.data.par_chunks_mut(w).enumerate().for_each(|(y, row)| {
            let dy = (y as f64 - c.v) / b;
            for (x, p) in row.iter_mut().enumerate() {
                let dx = (x as f64 - c.u) / a;
                if dx * dx + dy * dy > 1.0 {
                    *p = 0.0;
                }
            }
        });
    }
    light
}
