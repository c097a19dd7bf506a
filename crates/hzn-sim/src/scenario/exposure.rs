//! The exposure of the pictures.

use serde::{Deserialize, Serialize};

use crate::error::SceneError;
use crate::scene::Scene;

/// `[exposure]`: a fixed gain, or a controller that follows the mean brightness with a lag.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Exposure {
    /// Factor on the light. It has no effect if `target_mean` is set.
    pub gain: f64,
    /// Mean brightness that the controller aims at, as a fraction of full scale before the tone curve. Without it the
    /// gain is fixed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target_mean: Option<f64>,
    /// Time in which the controller corrects 63 % of an error, seconds. With 0 every picture has the right gain at
    /// once.
    pub lag_s: f64,
    /// Smallest and largest gain of the controller.
    pub limits: [f64; 2],
}

impl Default for Exposure {
    fn default() -> Self {
        Self { gain: 1.0, target_mean: None, lag_s: 0.5, limits: [0.2, 5.0] }
    }
}

/// Factor by which pictures are reduced to measure their mean light.
const REDUCTION: f64 = 24.0;

impl Exposure {
    /// Sets the exposure of scenes that are in the order of time.
    pub(crate) fn set(&self, scenes: &mut [(f64, Scene)]) -> Result<(), SceneError> {
        let mut gain = self.gain;
        let mut last: Option<f64> = None;
        for (time_s, scene) in scenes {
            if let Some(target) = self.target_mean {
                let mean = mean_light(scene)?;
                let right = (target / mean.max(1e-6)).clamp(self.limits[0], self.limits[1]);
                let share = match last {
                    Some(before) if self.lag_s > 0.0 => 1.0 - libm::exp(-(*time_s - before) / self.lag_s),
                    _ => 1.0,
                };
                // The gain changes in stops, like apertures and exposure times.
                gain *= libm::pow(right / gain, share);
                last = Some(*time_s);
            }
            scene.exposure = gain;
        }
        Ok(())
    }
}

/// Returns the mean light of a picture at a gain of 1, from a picture of only a few thousand pixels.
fn mean_light(scene: &Scene) -> Result<f64, SceneError> {
    let c = &scene.camera;
    let scale = REDUCTION.min(f64::from(c.width.min(c.height)) / 8.0).max(1.0);
    let mut small = scene.clone();
    let size = |n: u16| ((f64::from(n) / scale).round() as u16).max(2);
    let centre = |c: f64| (c + 0.5) / scale - 0.5;
    small.camera.width = size(c.width);
    small.camera.height = size(c.height);
    small.camera.fx_px /= scale;
    small.camera.fy_px /= scale;
    small.camera.cx_px = centre(c.cx_px);
    small.camera.cy_px = centre(c.cy_px);
    for part in &mut small.foreground {
        part.polygon_px.iter_mut().for_each(|p| *p = p.map(centre));
    }
    (small.motion, small.halves) = (None, None);
    small.exposure = 1.0;
    small.detector = crate::Detector { psf_sigma_px: 0.0, bits: 16, ..crate::Detector::default() };
    let picture = small.render()?;
    let (w, h) = (picture.width(), picture.height());
    let sum: f64 = (0..h).flat_map(|y| (0..w).map(move |x| (x, y))).map(|(x, y)| f64::from(picture.at(x, y))).sum();
    Ok(sum / 65535.0 / (f64::from(w) * f64::from(h)))
}
