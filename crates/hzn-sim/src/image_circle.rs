//! The image circle of a lens, and its blind centre, in a rendered picture.

use hzn_core::camera::{self, Camera};
use hzn_core::pixel::ImagePoint;
use rayon::prelude::*;

use crate::detector::Plane;
use crate::error::SceneError;

/// Centre and semi-axes along x and y, in pixels.
type Ellipse = (ImagePoint<f64>, f64, f64);

/// Returns the lens without its image circle, or with a wider one, as far as it stays monotone. The scene continues
/// beyond the circle, so the blur takes light from there, as with a stop close to the detector.
pub(crate) fn lens_without_circle(config: &camera::Config) -> Result<Camera<f64>, SceneError> {
    let with =
        |theta_max_deg| Camera::try_new(&camera::Config { theta_max_deg, theta_min_deg: None, ..config.clone() });
    let wider = config.theta_max_deg.map(|deg| deg + 3.0);
    with(None).or_else(|_| with(wider)).or_else(|_| with(config.theta_max_deg)).map_err(SceneError::from)
}

/// Removes all light beyond the image circle and in the blind centre.
pub fn apply_image_circle(light: Plane, camera: &Camera<f64>) -> Plane {
    let light = darken(light, camera.image_circle_px(), |radius2| radius2 > 1.0);
    darken(light, camera.blind_centre_px(), |radius2| radius2 < 1.0)
}

/// Removes the light where `is_dark` holds for the squared distance from the centre of an ellipse, in semi-axes.
fn darken(mut light: Plane, ellipse: Option<Ellipse>, is_dark: impl Fn(f64) -> bool + Sync) -> Plane {
    let Some((c, a, b)) = ellipse else { return light };
    let w = light.width;
    light.data.par_chunks_mut(w).enumerate().for_each(|(y, row)| {
        let dy = (y as f64 - c.v) / b;
        for (x, p) in row.iter_mut().enumerate() {
            let dx = (x as f64 - c.u) / a;
            if is_dark(dx * dx + dy * dy) {
                *p = 0.0;
            }
        }
    });
    light
}
