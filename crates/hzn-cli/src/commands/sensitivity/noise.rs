//! The edge noise of a sensor, and where it comes from.

use std::path::Path;

use hzn_core::covariance::Noise;
use hzn_core::{Config, covariance};
use hzn_sim::scenario::{self, median_rms_px};

use crate::exit::{Stop, failed, usage};

/// Number of pictures on which the RMS of a simulated scene is measured.
const PICTURES: u32 = 12;

/// The RMS of the residuals about a limb.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct EdgeNoise {
    pub(super) rms_px: f64,
    /// Where it comes from, in words.
    pub(super) source: String,
}

impl EdgeNoise {
    /// Returns the noise of a sensor.toml, for a sensor that looks for one body: `told` if the command line tells it,
    /// else that of the file. A file that leaves the noise to the residuals of each picture has only a floor; a
    /// simulated scene next to it shows then how large they are.
    pub(super) fn of_sensor(path: &Path, sensor: &Config, told: Option<f64>) -> Result<Self, Stop> {
        let own = noise_of(sensor);
        if let Some(rms_px) = told {
            return Ok(Self { rms_px, source: "--sigma-px".into() });
        }
        if own.noise == Noise::Given {
            return Ok(Self { rms_px: own.sigma_px, source: format!("sigma_px of {}", path.display()) });
        }
        let scene_path = path.with_file_name("scene.toml");
        if !scene_path.is_file() {
            return Err(usage(format!(
                "{}: [covariance] noise = {:?} measures the noise in every picture, and sigma_px = {} is only its \
                 floor; give --sigma-px, for example the median of the column rms_px of hzn run",
                path.display(),
                own.noise.name(),
                own.sigma_px
            )));
        }
        let name = scene_path.display().to_string();
        let scenario = scenario::load(&name, None, None)?;
        let one = scenario.by_camera().into_iter().find(|one| one.camera == sensor.camera).unwrap_or(scenario);
        let rms_px = median_rms_px(&one, sensor, PICTURES).map_err(|e| scenario::refused(&name, &e))?;
        let rms_px = rms_px.ok_or_else(|| failed(format!("{name}: no picture has an answer; give --sigma-px")))?;
        let source = format!("RMS of the residuals in {PICTURES} pictures of {name}");
        Ok(Self { rms_px, source })
    }
}

/// Returns the noise model of a sensor that looks for one body.
pub(super) fn noise_of(sensor: &Config) -> &covariance::Config {
    sensor.body.covariance.as_ref().unwrap_or(&sensor.covariance)
}
