//! The image circle of a fisheye.

use hzn_core::camera::Config;

/// Smallest angle off axis of a rim in the pictures that is written into the file. A smaller edge that is round about
/// the picture's centre may be the Earth itself, which is as large from below 1000 km only.
const MIN_SEEN_DEG: f64 = 60.0;
/// Largest `theta_max_deg`, and largest angle that a picture may have in its corners without one.
pub(super) const MAX_DEG: f64 = 175.0;

/// The image circle of a fisheye, with its radius as the angle off axis: `theta_max_deg` of sensor.toml.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ImageCircle {
    /// The pictures show its rim.
    Seen {
        /// Radius, degrees.
        theta_max_deg: f64,
    },
    /// The picture's corners cannot be in the image, so that the circle is assumed to touch its sides.
    Assumed {
        /// Radius, degrees.
        theta_max_deg: f64,
    },
}

impl ImageCircle {
    /// Returns the image circle of the lens, if it has one.
    /// `seen_px` is the radius of the rim in the pictures.
    pub(super) fn choose(seen_px: Option<f64>, camera: &Config, fov_deg: f64) -> Option<Self> {
        if camera.model.is_planar() {
            return None;
        }
        let deg = |px: f64| (px / camera.fx_px).to_degrees();
        let [width, height] = [camera.width, camera.height].map(f64::from);
        let seen = seen_px.map(deg).filter(|d| (MIN_SEEN_DEG..MAX_DEG).contains(d));
        let assumed = (deg(0.5 * width.hypot(height)) > MAX_DEG).then(|| (0.5 * fov_deg).min(MAX_DEG));
        seen.map(|theta_max_deg| Self::Seen { theta_max_deg })
            .or(assumed.map(|theta_max_deg| Self::Assumed { theta_max_deg }))
    }
}
