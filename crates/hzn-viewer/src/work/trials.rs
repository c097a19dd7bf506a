//! Trials that find the cause of a refusal: the same picture with Otsu's threshold, with a cone of any half-angle, and
//! with both, because a wrong threshold and a wrong lens can come together.

use hzn_core::camera::Camera;
use hzn_core::error::ConfigError;
use hzn_core::image::ImageView;
use hzn_core::status::Status;
use hzn_core::verdict::Verdict;
use hzn_core::{Config, Report, Solution, threshold};
use hzn_files::FrameData;
use hzn_run::diagnosis::{self, AnyCone, FitFacts};
use hzn_run::engine::AnySensor;
use hzn_run::engine::trace::Edge;
use hzn_run::explain;

/// Sensors for the trials with one configuration.
pub struct Trials {
    /// The sensor with Otsu's threshold; `None` if the sensor itself uses it.
    otsu: Option<AnySensor>,
    /// A sensor that finds a cone of any half-angle.
    any_cone: AnyCone,
    /// The same with Otsu's threshold; `None` if the sensor itself uses it.
    otsu_any_cone: Option<AnyCone>,
}

/// Result of the trial with Otsu's threshold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OtsuTrial {
    /// Otsu's threshold in counts.
    pub level: u16,
    /// The picture has an answer with this threshold.
    pub answered: bool,
    /// With this threshold a limb of another size is found, and with the threshold in use none of any size.
    pub finds_limb: bool,
}

impl OtsuTrial {
    /// Returns whether the threshold in use hides the limb.
    pub fn is_better(&self) -> bool {
        self.answered || self.finds_limb
    }
}

/// A cone of any half-angle that fits an edge.
#[derive(Debug, Clone)]
pub struct ConeTrial {
    /// The edge.
    pub edge: Edge,
    /// The edge is found with Otsu's threshold only.
    pub needs_otsu: bool,
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
        let any_cone = AnyCone::new(config, flight).ok()?;
        if uses_otsu(config) {
            return Some(Self { otsu: None, any_cone, otsu_any_cone: None });
        }
        let config = with_otsu(config);
        let otsu = Some(AnySensor::new(&config, flight).ok()?);
        Some(Self { otsu, any_cone, otsu_any_cone: Some(AnyCone::new(&config, flight).ok()?) })
    }

    /// Takes another configuration.
    ///
    /// # Errors
    /// The sensors cannot be made.
    pub fn reconfigure(&mut self, config: &Config, flight: bool) -> Result<(), ConfigError> {
        self.any_cone.reconfigure(config)?;
        if uses_otsu(config) {
            (self.otsu, self.otsu_any_cone) = (None, None);
            return Ok(());
        }
        let config = with_otsu(config);
        match (&mut self.otsu, &mut self.otsu_any_cone) {
            (Some(otsu), Some(any_cone)) => {
                otsu.reconfigure(&config)?;
                any_cone.reconfigure(&config)?;
            }
            (otsu, any_cone) => {
                *otsu = Some(AnySensor::new(&config, flight)?);
                *any_cone = Some(AnyCone::new(&config, flight)?);
            }
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
        let trial = |r: &hzn_core::Report<f64>| OtsuTrial {
            level: r.level,
            answered: r.status == Status::Ok,
            finds_limb: false,
        };
        found.iter().map(|p| p.report.as_ref().ok().map(trial)).collect()
    }

    /// Returns the longest edge that a cone of any half-angle fits. With Otsu's threshold it is looked for only where
    /// the threshold in use shows none.
    pub fn try_any_cone(&mut self, view: &ImageView<'_>, data: Option<&FrameData>) -> Option<ConeTrial> {
        if let Some(edge) = self.any_cone.find(view, data) {
            return Some(ConeTrial { edge, needs_otsu: false });
        }
        let edge = self.otsu_any_cone.as_mut()?.find(view, data)?;
        Some(ConeTrial { edge, needs_otsu: true })
    }

    /// Returns what the longest edge of a picture says, with its fit, and whether that needs Otsu's threshold.
    pub fn find_fit(
        &mut self,
        edges: &[Edge],
        report: &Report<f64>,
        altitude_km: Option<f64>,
        camera: &Camera<f64>,
        picture: (&ImageView<'_>, Option<&FrameData>),
    ) -> Option<(FitFacts, Solution<f64>, bool)> {
        let mut needs_otsu = false;
        let (view, data) = picture;
        // The sensor found a limb of another size, also where a longer edge is that of a cloud.
        let has_limb = explain::best_candidate(report).is_some_and(|best| best.verdict == Verdict::HalfAngle);
        let trial = || {
            if let Some(found) = self.try_any_cone(view, data) {
                needs_otsu = found.needs_otsu;
                return Some(found.edge);
            }
            if has_limb { self.any_cone.find_limb(view, data) } else { None }
        };
        let (fit, solution) = diagnosis::find_fit(edges, report, altitude_km, camera, trial)?;
        Some((fit, solution, needs_otsu && fit.is_trial))
    }
}
