//! Setup of the studies: number of pictures, scenes with their sensors, presets.

use std::path::PathBuf;

use anyhow::{Context, anyhow};
use hzn_core::Preset;
use hzn_core::body::Kind;
use hzn_core::{Config, body, covariance};
use hzn_sim::scenario::{FIT_PICTURES, Fit};
use hzn_sim::{Flight, Scenario};

/// Note on the results of sensors whose limb height and noise come from [`simulated`].
pub(super) const OTHER_SEEDS: &str = "**In-sample for the scene, out of sample for the pictures**: the values in \
                                      sensor.toml were measured on other seeds of the same scene: clouds and noise \
                                      differ, air and detector are the same.";

/// Size of a campaign.
pub(crate) struct Effort {
    /// Frames per scene instead of the study's own number.
    pub(crate) frames: Option<usize>,
    /// Folder that keeps the results of long rendered flights for another run.
    pub(crate) recordings: Option<PathBuf>,
}

impl Effort {
    /// Returns the number of frames per scene; `own` is the study's own number.
    pub(crate) fn frames(&self, own: usize) -> usize {
        self.frames.unwrap_or(own)
    }
}

/// Returns the radical inverse. Its points fill 0…1 evenly and are the same in every run.
pub(super) fn halton(mut index: usize, base: usize) -> f64 {
    let (mut out, mut part) = (0.0, 1.0);
    while index > 0 {
        part /= base as f64;
        out += part * (index % base) as f64;
        index /= base;
    }
    out
}

/// Returns the configuration of a published system for a flight. The system has its own methods, but the camera, mask
/// and body of `hzn`. It also has the edge noise of `hzn`, if that is given.
pub(super) fn preset(preset: Preset, flight: &Flight, body: body::Config) -> Config {
    let own = Config::preset(preset, flight.sensor.camera.clone());
    let covariance::Config { noise, sigma_px, correlation_px, .. } = flight.sensor.covariance;
    // If the noise comes from the residuals of the pictures, there is no told noise for a published system.
    let covariance = match noise {
        covariance::Noise::Given => covariance::Config { sigma_px, correlation_px, ..own.covariance },
        _ => own.covariance,
    };
    Config { body, mask: flight.sensor.mask.clone(), covariance, ..own }
}

/// Returns a scene as `hzn simulate` makes it, with JPEG if the scene is stored as JPEG, and the measured values as
/// text for a cell. The sensor has the limb height and the noise that were measured on other seeds.
pub(super) fn simulated(name: &str, count: usize) -> anyhow::Result<(Flight, String)> {
    let mut scenario = Scenario::builtin(name).ok_or_else(|| anyhow!("there is no built-in scene {name}"))?;
    scenario.capture.frames = u32::try_from(count)?;
    let mut flight = scenario.flight().with_context(|| name.to_owned())?;
    let fits = Fit::measure(&scenario, FIT_PICTURES, &|_, _| ()).with_context(|| name.to_owned())?;
    fits.iter().for_each(|fit| fit.apply(&mut flight.sensor));
    let measured = |body: Kind| {
        let Some(fit) = fits.iter().find(|fit| fit.body == body) else { return "nothing could be measured".to_owned() };
        let noise = match fit.noise {
            covariance::Noise::Given => format!("{:.2} px over {:.0} px", fit.sigma_px, fit.correlation_px),
            _ => "edge errors by each picture's residuals".to_owned(),
        };
        let limb = (fit.limb_height_sigma_km > 0.0)
            .then(|| format!("{:.1} km ± {:.1} km, ", fit.limb_height_km, fit.limb_height_sigma_km));
        limb.unwrap_or_default() + &noise
    };
    let text = |body: &Kind| match scenario.bodies.len() {
        1 => format!("`{name}` {}", measured(*body)),
        _ => format!("`{name}`, {}: {}", body.name(), measured(*body)),
    };
    let texts: Vec<String> = scenario.bodies.iter().map(text).collect();
    Ok((flight, texts.join("; ")))
}
