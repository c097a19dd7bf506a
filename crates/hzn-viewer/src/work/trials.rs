//! Trials that find the cause of a refusal: the same picture with Otsu's threshold, and with a cone of any half-angle.

use hzn_core::error::ConfigError;
use hzn_core::image::ImageView;
use hzn_core::status::Status;
use hzn_core::{Config, threshold};
use hzn_files::FrameData;
use hzn_run::diagnosis::AnyCone;
use hzn_run::engine::AnySensor;
use hzn_run::engine::trace::Edge;

/// Sensors for the trials with one configuration.
pub struct Trials {
    /// The sensor with Otsu's threshold; `None` if the sensor itself uses it.
    otsu: Option<AnySensor>,
    /// A sensor that finds a cone of any half-angle.
    any_cone: AnyCone,
}

/// Result of the trial with Otsu's threshold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OtsuTrial {
    /// Otsu's threshold in counts.
    pub level: u16,
    /// The picture has an answer with this threshold.
    pub answered: bool,
}

fn uses_otsu(config: &Config) -> bool {
    let of_body = config.each_body().iter().all(|b| b.threshold.is_none());
    of_body && config.threshold.method == threshold::Method::Otsu && config.threshold.scale == 1.0
}

fn with_otsu(config: &Config) -> Config {
    let mut config = config.clone();
    config.threshold = threshold::Config::default();
    config.each_body_mut().iter_mut().for_each(|b| b.threshold = None);
    config
}

impl Trials {
    /// Makes the sensors. It returns `None` if one of them cannot be made; then there are no trials.
    pub fn new(config: &Config, flight: bool) -> Option<Self> {
        let otsu = if uses_otsu(config) { None } else { Some(AnySensor::new(&with_otsu(config), flight).ok()?) };
        Some(Self { otsu, any_cone: AnyCone::new(config, flight).ok()? })
    }

    /// Takes another configuration.
    ///
    /// # Errors
    /// The sensors cannot be made.
    pub fn reconfigure(&mut self, config: &Config, flight: bool) -> Result<(), ConfigError> {
        self.any_cone.reconfigure(config)?;
        match (&mut self.otsu, uses_otsu(config)) {
            (otsu, true) => *otsu = None,
            (Some(otsu), false) => otsu.reconfigure(&with_otsu(config))?,
            (otsu, false) => *otsu = Some(AnySensor::new(&with_otsu(config), flight)?),
        }
        Ok(())
    }

    /// Returns the result with Otsu's threshold for each body; `None` if the sensor itself uses this threshold, or if
    /// the picture is not `refused`.
    pub fn try_otsu(
        &mut self,
        view: &ImageView<'_>,
        data: Option<&FrameData>,
        refused: bool,
    ) -> Option<Vec<OtsuTrial>> {
        let found = self.otsu.as_mut().filter(|_| refused)?.process(view, data, None);
        let trial = |r: &hzn_core::Report<f64>| OtsuTrial { level: r.level, answered: r.status == Status::Ok };
        found.iter().map(|p| p.report.as_ref().ok().map(trial)).collect()
    }

    /// Returns the longest edge that a cone of any half-angle fits.
    pub fn try_any_cone(&mut self, view: &ImageView<'_>, data: Option<&FrameData>) -> Option<Edge> {
        self.any_cone.find(view, data)
    }
}
